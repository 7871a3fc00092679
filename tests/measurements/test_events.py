"""When events happened in logs: on the virtual clutch bench, and in falls of known moment."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import sympy as sp

from pipeline.rigs.clutch import ClutchCampaign
from tests.machines.folders import logs_of
from tests.machines.known import EMPTY, built_in
from unmodelled import BadInput, Logs, read_logs
from unmodelled.logs.events import event_times
from unmodelled.systems.model import Event, Output, Parameter, State, System, symbol

h, v, e, g, d, t = sp.symbols("h v e g d t", real=True)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[Logs, System, dict[str, float]]:
    """Every fourth engagement of a campaign, the system, and the true shifting times."""
    folder = tmp_path_factory.mktemp("bench") / "logs"
    ClutchCampaign(sharp=True).write(folder, 8)
    table = folder / "experiments.csv"
    pd.read_csv(table).iloc[::4].to_csv(table, index=False)
    system = built_in("clutch_sharp")
    truth = json.loads((folder / "bench.json").read_text())["shifting_time"]
    return read_logs(folder, system), system, truth


def test_shifting_times_of_the_bench(bench: tuple[Logs, System, dict[str, float]]) -> None:
    logs, system, truth = bench
    found = event_times(logs, system, "shift")
    assert list(found.columns) == ["id", "time", "deviation"]
    assert tuple(found["id"]) == logs.ids
    error = np.abs(found["time"] - [truth[name] for name in found["id"]])
    assert np.median(error) < 0.5e-3
    assert error.max() < 3e-3
    # the errors are what the residuals say
    assert 0.6 < np.sqrt(np.mean((error / found["deviation"]) ** 2)) < 1.5
    assert found["deviation"].max() < 1.5e-3


def test_what_the_outputs_do_not_show_is_refused(bench: tuple[Logs, System, dict[str, float]]) -> None:
    logs, system, _ = bench
    piston = replace(system, events=(Event("touch", symbol("z_M") - symbol("s")),))
    with pytest.raises(BadInput, match=r"events\.touch: needs the state 's', which no output shows"):
        event_times(logs, piston, "touch")
    unknown = replace(system, events=(Event("full", symbol("p_hc0") - symbol("p")),))
    with pytest.raises(BadInput, match=r"events\.full: needs the parameter 'p_hc0', which is still to be"):
        event_times(logs, unknown, "full")


def ball(event: Event) -> System:
    """A ball that falls and may come to lie on the ground; its height is measured."""
    return replace(
        EMPTY,
        name="ball",
        states=(State("h", "m"), State("v", "m/s"), State("e", "m")),
        outputs=(Output("h", "m", "height", h),),
        parameters=(Parameter("g", "m/s^2", 9.81), Parameter("d", "m", 0.25)),
        dynamics=(v, -g, v),
        events=(event,),
    )


def times(folder: Path, event: Event, heights: dict[str, np.ndarray], period: float = 0.002) -> pd.DataFrame:
    """When the event happened in logs of measured heights."""
    tables = [{"t": np.arange(len(height)) * period, "height": height} for height in heights.values()]
    logs = logs_of(ball(event), folder, tables, id=list(heights))
    return event_times(logs, ball(event), event.name)


def height(top: float, period: float = 0.002, duration: float = 1.0) -> np.ndarray:
    """Of a ball let go 0.1 s after the start."""
    t = np.arange(round(duration / period)) * period
    return top - 0.5 * 9.81 * np.maximum(t - 0.1, 0.0) ** 2


TOPS = {"low": 0.8, "middle": 1.5, "high": 2.5}
THROUGH = Event("down", h - d)
HELD = Event("down", h - d, (sp.S.Zero, sp.S.Zero, sp.S.Zero))


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize(("noise", "close"), [(0.0, 1e-6), (0.003, 2e-3)])
def test_falls_of_known_moment(tmp_path: Path, held: bool, noise: float, close: float) -> None:
    """A ball that passes the mark, and one that comes to lie on it."""
    source = np.random.default_rng(1)
    heights = {name: np.maximum(height(top), 0.25) if held else height(top) for name, top in TOPS.items()}
    heights = {name: x + noise * source.standard_normal(len(x)) for name, x in heights.items()}
    found = times(tmp_path, HELD if held else THROUGH, heights)
    expected = 0.1 + np.sqrt(2.0 * (np.array(list(TOPS.values())) - 0.25) / 9.81)
    np.testing.assert_allclose(found["time"], expected, atol=close, rtol=0.0)
    assert np.all(np.abs(found["time"] - expected) <= 3.5 * found["deviation"] + 1e-6)
    assert np.all(found["deviation"] <= close)


def test_few_samples_are_enough(tmp_path: Path) -> None:
    found = times(tmp_path, THROUGH, {"slow": height(1.5, 0.01)}, 0.01)
    assert found["time"][0] == pytest.approx(0.1 + np.sqrt(2.5 / 9.81), abs=1e-6)


def test_the_first_fall_counts_and_it_must_start_above(tmp_path: Path) -> None:
    """A height that starts below the mark, rises above it, falls, and does all that again."""
    wave = 0.25 - np.sin(2 * np.pi * np.arange(1000) * 0.002)  # falls through 0.25 at 1 s, rises at 0.5 s
    assert times(tmp_path, THROUGH, {"wave": wave})["time"][0] == pytest.approx(1.0, abs=1e-4)


def test_a_dip_of_the_noise_is_no_event(tmp_path: Path) -> None:
    spiky = height(1.5)
    spiky[30:32] = 0.2
    found = times(tmp_path, THROUGH, {"spiky": spiky})
    assert found["time"][0] == pytest.approx(0.1 + np.sqrt(2.5 / 9.81), abs=1e-5)


def test_a_velocity_from_a_measured_position_is_shown_well_enough(tmp_path: Path) -> None:
    found = times(tmp_path, Event("fast", v + 3.0), {"high": height(2.5, duration=0.8)})
    assert found["time"][0] == pytest.approx(0.1 + 3.0 / 9.81, abs=2e-3)


@pytest.mark.parametrize(
    ("heights", "who"),
    [
        ({"high": height(2.5), "short": height(2.5)[:200]}, "short"),
        ({"up": height(2.5)[::-1]}, "up"),
        ({"below": height(0.2)}, "below"),
        ({"last": height(2.5)[: round((0.1 + np.sqrt(4.5 / 9.81)) / 0.002) + 4]}, "last"),
    ],
)
def test_an_experiment_where_it_never_happens_is_named(
    tmp_path: Path, heights: dict[str, np.ndarray], who: str
) -> None:
    with pytest.raises(BadInput, match=rf"^experiment {who}: the event 'down' never happens: [^\n]*$"):
        times(tmp_path, THROUGH, heights)


@pytest.fixture
def high(tmp_path: Path) -> Logs:
    fall = {"t": np.arange(500) * 0.002, "height": height(2.5)}
    return logs_of(ball(THROUGH), tmp_path, [fall], id=["high"])


def test_no_event_of_that_name(high: Logs) -> None:
    system, logs = ball(THROUGH), high
    with pytest.raises(BadInput, match=re.escape("system ball: has no event 'dwon'; did you mean 'down'?")):
        event_times(logs, system, "dwon")
    with pytest.raises(BadInput, match=r"system ball: has no event 'down'$"):
        event_times(logs, replace(system, events=()), "down")


def test_an_expression_without_value_and_other_logs_are_refused(high: Logs) -> None:
    system = ball(Event("down", sp.log(h)))
    with pytest.raises(BadInput, match=r"experiment high: the event 'down' has no finite value at t = 0\.8"):
        event_times(high, system, "down")
    other = replace(system, states=(*system.states[:2], State("q", "m")))
    with pytest.raises(BadInput, match="its names are not those of the logs"):
        event_times(high, other, "down")
