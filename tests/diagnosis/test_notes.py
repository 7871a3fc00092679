"""Notes of an answer: the other end of a lag that is the same in a linear machine, and a shorter horizon."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.diagnoses import Said, diagnosis, told
from tests.diagnosis.studies import HORIZON
from tests.machines.folders import Array, logs_of, motion, recorded, system_of, text_of
from unmodelled.diagnosis.answer.moved_lags import with_moved_lags
from unmodelled.diagnosis.answer.shorter_windows import shorter_windows
from unmodelled.diagnosis.data.result import Verdict
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs

DRIVE, SPEED = Place("actuator", "U"), Place("sensor", "w")
ENDS = {"sensor_lag": (SPEED, "T_y", "c_y"), "actuator_lag": (DRIVE, "T_u", "c_u")}


@pytest.mark.parametrize(("dry", "linear"), [(0.0, True), (2.0, False)])
@pytest.mark.parametrize("family", ENDS)
def test_the_other_end_is_listed_where_it_predicts_as_well(
    family: str, dry: float, linear: bool, tmp_path: Path
) -> None:
    """The planted fan has a drive or a sensor with a lag of 0.06 s."""
    of_sensor = family == "sensor_lag"

    def rates(x: Array, volts: Array) -> list[Array]:
        w, lag = x
        torque = 0.6 * (volts if of_sensor else lag) - 0.2 * w - dry * np.tanh(w / 0.01)
        return [torque / 0.05, ((w if of_sensor else volts) - lag) / 0.06]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        U = np.repeat(rng.uniform(-6.0, 6.0, 15), 20)
        seen = motion(rates, [0.0, 0.0], U, 0.01, substeps=20, held=True)[:, int(of_sensor)]
        noisy = seen + 0.02 * rng.standard_normal(len(U))
        return pd.DataFrame({"t": 0.01 * np.arange(len(U)), "U": U, "w": noisy})

    system = system_of(text_of("fan.yaml", ("F: {value: 0.1", f"F: {{value: {dry}")), tmp_path)
    logs = read_logs(recorded(tmp_path / "logs", run, 4, 5), system)
    place, time, switch = ENDS[family]
    before = told(system, logs, Said(family, place, {time: 0.06, switch: 1.0}))
    (effect,) = with_moved_lags(before).effects
    (other,) = {*ENDS} - {family}
    sites = {found.site for found in effect.indistinguishable}
    assert ((other, ENDS[other][0].channel) in sites) is linear


def test_other_effects_stay_as_they_are(tmp_path: Path) -> None:
    t = 0.01 * np.arange(200)
    table = pd.DataFrame({"t": t, "U": np.sin(3.0 * t), "w": np.sin(3.0 * t - 0.5)})
    system = system_of(text_of("fan.yaml"), tmp_path)
    logs = logs_of(system, tmp_path / "logs", [table] * 4)
    before = told(system, logs, Said("viscous_friction", Place("port", "shaft"), {"d": 0.1}))
    assert with_moved_lags(before) is before


DAMPING = Said("viscous_friction", Place("port", "joint"), {"d": 0.002})


@pytest.mark.parametrize(
    ("verdict", "shrink", "horizon", "advised"),
    [
        *(("main_effect", 0.3, HORIZON, "horizon=0.017"), ("unknown", 0.0, HORIZON, "horizon=0.017")),
        *(("main_effect", 0.8, HORIZON, ""), ("effect", 0.3, HORIZON, ""), ("unknown", 0.0, 0.02, "")),
    ],
)
def test_most_of_the_gap_is_left(
    verdict: Verdict, shrink: float, horizon: float, advised: str, tmp_path: Path
) -> None:
    found = replace(diagnosis(tmp_path, DAMPING), verdict=verdict, shrink=shrink, horizon=horizon)
    notes = list(shorter_windows(found))
    assert [advised in note for note in notes] == [True] * bool(advised)


def test_a_port_without_a_position_has_no_travel(tmp_path: Path) -> None:
    found = replace(diagnosis(tmp_path, DAMPING), verdict="unknown", shrink=0.0)
    (port,) = found.system.ports
    still = replace(found.system, ports=(replace(port, position=None),))
    assert not list(shorter_windows(replace(found, system=still)))
