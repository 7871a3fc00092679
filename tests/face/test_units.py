"""What a user reads is in the units of the system file."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import system_of, text_of
from unmodelled.learning.evaluation import Evaluation, _units


def test_a_system_prints_the_units_of_its_file(tmp_path: Path) -> None:
    said = repr(system_of(text_of("boiler.yaml"), tmp_path)).splitlines()
    assert said[1] == "states: T (K)"  # of the equations
    assert any(line == "outputs: T (degC)" for line in said) and "valve (%)" in said[2]


@pytest.mark.parametrize(
    ("machine", "state", "unit", "error", "factor", "offset"),
    [
        ("boiler.yaml", "T", "degC", "K", 1.0, 273.15),
        ("turntable.yaml", "theta", "deg", "deg", np.pi / 180, 0.0),
        ("pendulum.yaml", "omega", "rad/s", "rad/s", 1.0, 0.0),
    ],
)
def test_held_out_runs_are_judged_in_the_units_of_the_log(
    tmp_path: Path, machine: str, state: str, unit: str, error: str, factor: float, offset: float
) -> None:
    system, si = system_of(text_of(machine), tmp_path), np.array([300.0, 301.0])
    run = {"fold": "a", "repeat": 0, "id": "run1"}
    errors = pd.DataFrame([{**run, "state": state, "rmse": 2.0, "diverged": False}])
    table = {"fold": "a", "id": "run1", "t": [0.0, 1.0], f"{state}_measured": si, state: si + 2.0}
    units = {level: _units(system, level=level) for level in (True, False)}
    nothing = pd.DataFrame()
    found = Evaluation(errors, pd.DataFrame(table), nothing, nothing, units[True], units[False])
    (row,) = found.table().to_dict("records")
    assert (row["unit"], row["median"]) == (error, pytest.approx(2.0 / factor))
    (axis,) = found.plot("run1").axes
    assert axis.get_ylabel() == f"{state} [{unit}]"
    np.testing.assert_allclose(axis.lines[0].get_ydata(), (si - offset) / factor)
