"""Virtual benches that several tests of the diagnosis look at, and what is true of them."""

from pathlib import Path

import pytest

from tests.diagnosis.benches import pendulum
from tests.machines.folders import read_case
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

SYSTEMS = Path(__file__).parents[2] / "systems"
Known = tuple[System, Logs]

CRANK_LAW = """
  F_c: {value: 3.0, unit: N, identify: true, bounds: [0, 10]}
  F_s: {value: 4.5, unit: N}
  v_s: {value: 0.03, unit: m/s}
  stick: {value: 0.002, unit: m/s}
  viscous: {value: 4.0, unit: N s/m, identify: true, bounds: [0, 20]}
  ripple: {value: 0.02, unit: N m}
  share: {value: 0.01, unit: '1'}
signals:
  drive: T*(1 + share*sin(12*theta)) + ripple*sin(6*theta)
"""


@pytest.fixture(scope="session")
def slider_crank(tmp_path_factory: pytest.TempPathFactory) -> Known:
    """The bench without its spring, and all that it does otherwise."""
    from pipeline.rigs.slider_crank import SliderCrankCampaign  # needs MuJoCo, which other tests do not

    folder = tmp_path_factory.mktemp("slider_crank")
    law = "((F_c + (F_s - F_c)*exp(-(v/v_s)**2))*tanh(v/stick) + viscous*v)"
    changes = (
        ("velocity: v}", f"velocity: v, law: '{law}'}}"),
        ("\nsignals:\n", CRANK_LAW),
        ("omega: (T - B_m", "omega: (drive - B_m"),
    )
    pendulum(folder, *changes, text=(SYSTEMS / "slider_crank.yaml").read_text())
    SliderCrankCampaign(spring=False, profiles=[3, 5, 8], samples=600).write(folder / "logs", 0)
    return read_case(folder)
