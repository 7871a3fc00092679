"""What networks have learned is written down: planted laws are found, and the system file holds them."""

from pathlib import Path

import numpy as np
import pytest

import unmodelled as um
from tests.diagnosis.planted import plant
from tests.diagnosis.studies import effect
from unmodelled.learning.fit import Fit
from unmodelled.learning.structures import conservative_and_dissipative, one_per_port

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def found() -> um.LearnedLaws:
    system, logs = um.example("pendulum")
    return um.learned_laws(um.train(system, logs, um.one_per_port(hidden=32)), logs)


def test_the_formula_is_that_of_the_network_and_of_the_friction(found: um.LearnedLaws) -> None:
    (law,) = found.laws
    assert law.explains > 0.99 and "tanh(omega/" in law.form.text
    # the example lacks a dry friction of 0.06 N m
    fast = law.samples[law.samples["velocity"].abs() > 4.0]
    assert np.abs(fast["formula"]).median() == pytest.approx(0.1, abs=0.04)
    samples = law.samples
    np.testing.assert_allclose(law.form(samples["position"], samples["velocity"]), samples["formula"])


def test_the_system_file_simulates_as_the_formulas_do(found: um.LearnedLaws, tmp_path: Path) -> None:
    found.fit.save(tmp_path)
    found.save(tmp_path)
    again = um.read_system(tmp_path / "learned_system.yaml")
    value = um.simulate(again, found.logs).value
    assert value == pytest.approx(found.simulation.value, rel=1e-12)
    assert value < 0.5 * found.known.value
    units = {p.name: p.unit for p in again.parameters}
    assert units["joint_jump"] == "rad/s" and units["joint_c1"] in ("N m", "N m s")
    Fit.load(tmp_path)  # the fit is still there


@pytest.mark.parametrize(
    ("planted", "coordinate"), [("linear_loss", "position"), ("inductance_saturation", "velocity")]
)
def test_ports_with_one_coordinate(tmp_path: Path, planted: str, coordinate: str) -> None:
    plant(tmp_path, effect(planted))
    system = um.read_system(tmp_path / "system.yaml")
    logs = um.read_logs(tmp_path / "logs", system)
    found = um.learned_laws(um.train(system, logs, um.one_per_port(hidden=8)), logs)
    (law,) = found.laws
    assert list(law.units) == [coordinate] and np.isfinite(found.simulation.value)
    other = {"position": "velocity", "velocity": "position"}[coordinate]
    assert law.samples[other].isna().all() and law.samples[coordinate].notna().all()
    found.plot()


def test_networks_that_share_a_port(tmp_path: Path) -> None:
    system, logs = um.example("pendulum")
    found = um.learned_laws(um.train(system, logs, conservative_and_dissipative(8, 1e-5)), logs)
    assert [law.network for law in found.laws] == ["tau_c", "tau_nc"]
    (port,) = found.system.ports
    added = [p.name for p in found.system.parameters if p.name.startswith("joint_")]
    assert port.law is not None and {str(s) for s in port.law.free_symbols} >= set(added)
    um.write_system(found.system, tmp_path / "system.yaml")
    assert um.simulate(um.read_system(tmp_path / "system.yaml"), logs).value == found.simulation.value


def test_networks_with_other_inputs_are_not_written_down() -> None:
    system, logs = um.example("pendulum")
    fit = um.train(system, logs, one_per_port(hidden=4, inputs=["sin(theta)", "omega"]))
    found = um.learned_laws(fit, logs)
    assert not found.laws and "its inputs are not those of the port joint" in found.notes[0]
    assert found.system.ports == fit.system.ports
    with pytest.raises(um.BadInput, match="not written down"):
        found.plot()


def test_logs_of_other_experiments_are_refused(found: um.LearnedLaws) -> None:
    system, logs = um.example("pendulum")
    rows = logs.table()
    others = um.Logs.from_frames({"new": rows[rows["experiment"] == "run1"]}, system)
    with pytest.raises(um.BadInput, match="no experiment was trained on"):
        um.learned_laws(found.fit, others)
