"""System and logs in every form that a caller may give them in."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled as um

SYSTEM, LOGS = um.example("pendulum")
FRAMES = {str(name): frame for name, frame in LOGS.table().groupby("experiment")}


@pytest.mark.parametrize(
    "logs",
    [
        LOGS.source,
        Path(LOGS.source),
        FRAMES,
        list(FRAMES.values()),
        LOGS.table(),
        {name: frame.set_index("t") for name, frame in FRAMES.items()},
    ],
    ids=["text", "path", "by id", "list", "one frame", "time as index"],
)
def test_logs_in_every_form_have_the_same_gap(logs: object) -> None:
    found = um.simulate(SYSTEM.source, logs)  # type: ignore[arg-type]
    assert found.logs.ids == LOGS.ids
    assert found.value == pytest.approx(um.simulate(SYSTEM, LOGS).value, rel=1e-9)


def test_a_result_stands_for_its_system() -> None:
    fit = um.train(SYSTEM.source, LOGS.source, um.one_per_port(hidden=2))
    first = um.simulate(fit, LOGS)
    again = um.simulate(first, Path(LOGS.source))
    assert first.system == SYSTEM and again.value == first.value
    assert um.identifiability(first, FRAMES).system == SYSTEM
    assert np.isfinite(um.evaluate(fit, list(FRAMES.values())).table()["median"]).all()


@pytest.mark.parametrize(
    ("system", "logs", "words"),
    [
        (SYSTEM, 3, "logs: must be logs, the path of their folder, a data frame, or data frames in a list"),
        (SYSTEM, [3], r"logs\['run1'\]: must be a data frame, got int"),
        (SYSTEM, {"a": FRAMES["run1"].to_numpy()}, r"logs\['a'\]: must be a data frame, got ndarray"),
        (SYSTEM, pd.DataFrame({"x": [1.0]}), r"frames\['run1'\]: row 1: column t is missing"),
        (3, LOGS, "system: must be a system, the path of its file, or a result that has one, such as an"),
        ("none.yaml", LOGS, "none.yaml: no such file"),
        (SYSTEM, "none", "none: no such folder"),
    ],
)
def test_anything_else_is_refused(system: object, logs: object, words: str) -> None:
    with pytest.raises(um.BadInput, match=words):
        um.simulate(system, logs)  # type: ignore[arg-type]
