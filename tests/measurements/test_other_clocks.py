"""Commands of another clock: smooth ones are read by splines, steps by straight lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from tests.machines.folders import system_of
from unmodelled.logs.folder import read_logs

Array = NDArray[np.float64]
CRANE = """
schema: system/1
name: crane
states: {x: {unit: m}, v: {unit: m/s}}
inputs: {r: {unit: m}}
outputs: {x: {unit: m}}
parameters: {k: {value: 4, unit: 1/s^2}, d: {value: 1, unit: 1/s}}
dynamics: {x: v, v: k*(r - x) - d*v}
"""


def smooth(t: Array) -> Array:
    return np.sin(4.0 * t) + 0.3 * np.cos(9.0 * t)


def steps(t: Array) -> Array:
    return np.asarray(np.floor(t / 0.7) % 3.0)


@pytest.mark.parametrize(("command", "error"), [(smooth, 3e-3), (steps, 0.0)])
def test_commands_are_read_as_smooth_as_they_are(command: object, error: float, tmp_path: Path) -> None:
    """A smooth command of 12.5 Hz would be off by 2.5 % between its samples; steps do not overshoot."""
    assert callable(command)
    t, slow = 0.01 * np.arange(1000), 0.08 * np.arange(130)
    (tmp_path / "run").mkdir()
    pd.DataFrame({"t": t, "x": np.sin(t)}).to_csv(tmp_path / "run" / "sensor.csv", index=False)
    pd.DataFrame({"t": slow, "r": command(slow)}).to_csv(tmp_path / "run" / "drive.csv", index=False)
    (tmp_path / "mapping.yaml").write_text(
        'schema: mapping/1\nfiles: ["*/"]\ntime: {column: t, unit: s}\n'
        "signals: {x: {column: sensor.x, unit: m}, r: {column: drive.r, unit: m}}\n"
    )
    logs = read_logs(tmp_path, system_of(CRANE, tmp_path))
    u = logs.u[:, 0]
    if command is smooth:
        assert (
            np.abs(u - smooth(t)).max()
            < error
            < 0.2 * np.abs(np.interp(t, slow, smooth(slow)) - smooth(t)).max()
        )
    else:
        np.testing.assert_allclose(u, np.interp(t, slow, steps(slow)), atol=1e-12)
