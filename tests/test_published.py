"""Official splits of public data sets, and a virtual stand-in that is diagnosed and simulated."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from benchmarks.published.__main__ import main
from benchmarks.published.ours import simulate
from benchmarks.published.records import SYSTEMS, read_cascaded_tanks, read_emps, read_silverbox
from pipeline.recordings.emps import FILES
from tests.machines.folders import motion
from tests.recordings import published
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.systems.reader import read_system

SAMPLES, PERIOD = 450, 4.0
#: Outflows and pump of the virtual tanks; the system file has 0.055, 0.07 and 0.05.
OUTFLOW, OUT, PUMP = 0.09, 0.08, 0.06


def tanks(folder: Path) -> None:
    """Two records in the published form, of tanks that lack nothing, but have other numbers than the file."""
    columns: dict[str, np.ndarray] = {}

    def rates(levels: np.ndarray, u: np.ndarray) -> list[np.ndarray]:
        flow, out = np.array([OUTFLOW, OUT]) * np.sqrt(np.maximum(levels, 0.01))
        return [PUMP * u - flow, flow - out]

    for record, seed in (("Est", 0), ("Val", 1)):
        rng = np.random.default_rng(seed)
        pump = np.repeat(rng.uniform(1.5, 3.5, SAMPLES // 15), 15)
        levels = motion(rates, [4.0, 5.0], pump, PERIOD)[:, 1]
        columns |= {f"u{record}": pump, f"y{record}": levels + rng.normal(0.0, 0.005, SAMPLES)}
    pd.DataFrame(columns).to_csv(folder / "dataBenchmark.csv", index=False)


@pytest.mark.long
def test_a_virtual_set_is_diagnosed_and_its_test_simulated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tanks(tmp_path)
    main([f"cascaded_tanks={tmp_path}", f"out={tmp_path / 'out'}"])
    known, reidentified, augmented = read_json(tmp_path / "out" / "cascaded_tanks_ours.json")
    assert "known: no_gap" in known["model"] and known["unit"] == "V"
    assert known["rmse"]["val"] > 0.3 and reidentified["rmse"]["val"] < 0.02
    assert augmented["rmse"] == reidentified["rmse"] and not augmented["laws"]
    assert f"val {known['rmse']['val']:.4g}" in capsys.readouterr().out


def test_no_sample_after_the_first_ones_is_used(tmp_path: Path) -> None:
    tanks(tmp_path)
    records = read_cascaded_tanks(str(tmp_path))
    system = read_system(SYSTEMS / "cascaded_tanks/overflow_withheld.yaml")
    record, seen = records.tests["val"], records.seen
    found = simulate(system, system, record, seen)
    later, sooner = record.copy(), record.copy()
    later.loc[seen:, "y"] = 9.0 - later["y"]
    sooner.loc[: seen - 1, "y"] += 0.5
    assert np.array_equal(simulate(system, system, later, seen), found)
    assert np.abs(simulate(system, system, sooner, seen) - found).max() > 0.1


def test_the_official_splits(tmp_path: Path) -> None:
    published.silverbox(tmp_path)
    records = read_silverbox(str(tmp_path))
    lengths = {"multisine": 21_688, "arrow, full": 40_475, "arrow, no extrapolation": 32_000}
    assert {name: len(record) for name, record in records.tests.items()} == lengths
    rows = np.concatenate([part.index for part in records.training.values()])
    assert (rows.min(), rows.max(), records.seen) == (40_650, 105_711, 50)
    t = np.arange(300)[:, None] * 0.001
    for k, file in enumerate(FILES.values()):
        savemat(tmp_path / file, {"t": t, "vir": 0.0 * t, "qm": k + t})
    moved = read_emps(str(tmp_path))
    largest = max(part["qm"].max() for part in moved.training.values())
    assert largest < 1.0 <= moved.tests["pulses"]["qm"].min()
    assert (len(moved.training), len(moved.tests["pulses"]), moved.seen) == (5, 300, 20)


@pytest.mark.parametrize(
    "words",
    [["out=a"], ["silverbox=a"], ["silverbox=a", "tanks=b", "out=c"], ["emps=a", "out=b", "method=lstm"]],
)
def test_words_that_cannot_be_used(words: list[str]) -> None:
    with pytest.raises(BadInput, match="give out=FOLDER, the path of one or more of silverbox"):
        main(words)


def test_a_method_that_needs_periods_takes_no_other_set(tmp_path: Path) -> None:
    tanks(tmp_path)
    with pytest.raises(BadInput, match="only silverbox"):
        main([f"cascaded_tanks={tmp_path}", f"out={tmp_path / 'out'}", "method=nl_lfr"])
