"""Columns around a path are derivatives of the free runs; a network in every port is fitted around them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import JOINT, effect, fitted, shared_study, study
from unmodelled.diagnosis.columns.columns import Atom, Columns
from unmodelled.diagnosis.columns.jacobians import Jacobians
from unmodelled.diagnosis.columns.path import Path as FreeRun
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.judge.network import AT_REST, HIDDEN, fit_network, with_networks
from unmodelled.effects.place import Place
from unmodelled.systems.model import symbol
from unmodelled.systems.numeric import numpy_system_function

#: Share of a plausible size at which a law is simulated, to compare with its column.
SMALL = 1e-3


def columns_of(folder: Path, bench: Bench) -> Columns:
    base = fitted(Hypothesis.known(study(folder, bench)))
    return Columns(FreeRun.of(base, base.recording))


def simulated(columns: Columns, atom: Atom, k: int) -> np.ndarray:
    """The change of the errors (windows, K, outputs) by a small amplitude, per plausible size of it."""
    path = columns.path
    larger = path.hypothesis.plus(atom.effect, atom.place)
    added, simulation = larger.effects[-1], larger.simulation(path.recording)
    values = dict(zip(simulation.names, simulation.values.tolist(), strict=True))
    known = dict(zip((p.name for p in path.system.parameters), path.values[0].tolist(), strict=True))
    values |= known | dict(zip(added.shapes, atom.shape.values(), strict=True))
    name, amount = added.amplitudes[k], SMALL * float(atom.scale[k])
    sets = np.array([[{**values, name: a}[n] for n in simulation.names] for a in (0.0, amount)])
    y = simulation(sets[None], substeps=2).y
    return np.asarray((y[:, 1] - y[:, 0]) / path.recording.noise / SMALL)


@pytest.mark.parametrize("kind", ["port", "actuator", "sensor", "parameter"])
def test_a_column_is_the_derivative_of_the_free_runs(tmp_path: Path, kind: str) -> None:
    columns = columns_of(tmp_path, Bench(samples=300, runs=4))
    counted, compared = columns.path.recording.counted, 0
    for atoms, found in columns.atoms():
        atom, count = atoms[0], len(atoms[0].scale)
        # sets that differ by a delay are compared at other samples; a filtered output starts elsewhere
        late = "delay" in atom.shape or atom.effect.family in ("sensor_lag", "actuator_rate_limit")
        if atom.place.kind != kind or late or atom.effect.at_levels or atom.place.factor:
            continue
        larger = columns.path.hypothesis.plus(atom.effect, atom.place)
        if larger.effects[-1].shares:
            continue
        for k in range(count):
            wanted, mine = simulated(columns, atom, k)[counted], found[..., k][counted]
            size = np.linalg.norm(wanted) * np.linalg.norm(mine)
            if size > 0.0:
                off = 1.0 - float(np.vdot(wanted, mine)) / size
                assert off < 2e-2, (atom.effect.family, atom.effect.variant, k, off)
                assert np.linalg.norm(mine) == pytest.approx(np.linalg.norm(wanted), rel=0.1)
                compared += 1
    assert compared >= {"port": 20, "actuator": 4, "sensor": 2, "parameter": 1}[kind]


def test_dry_friction_scatters_beside_a_friction_that_all_experiments_share(tmp_path: Path) -> None:
    known = fitted(Hypothesis.known(study(tmp_path, Bench(samples=300, runs=4))))
    rubbing = fitted(known.hypothesis.plus(effect("coulomb_friction"), JOINT))
    every = [[a for _, _, a in Columns(FreeRun.of(b, b.recording)).scatter()] for b in (known, rubbing)]
    varying = [[a.place for a in atoms if a and a.effect.variant == "dry_friction"] for atoms in every]
    assert varying == [[], [JOINT]]


def test_numbers_of_an_effect_have_no_effects_of_their_own(tmp_path: Path) -> None:
    known = Hypothesis.known(study(tmp_path, Bench(samples=300, runs=4)))
    base = fitted(known.plus(effect("coulomb_friction"), JOINT))
    seen = [atoms[0] for atoms, _ in Columns(FreeRun.of(base, base.recording)).atoms()]
    assert not [a for a in seen if a.effect.family == "coulomb_friction" and a.place == JOINT]
    assert {a.place.name for a in seen if a.place.kind == "parameter"} == {"J", "b", "mgl"}


def test_a_lag_hides_the_state_before_it(tmp_path: Path) -> None:
    """The output changes with that state by round-off only, and nothing is divided by round-off."""
    known, sensor = Hypothesis.known(study(tmp_path, Bench(samples=300, runs=4))), Place("sensor", "theta")
    lagging = fitted(known.plus(effect("sensor_lag"), sensor).plus(effect("sensor_gain"), sensor))
    path = FreeRun.of(lagging, lagging.recording)
    anywhere = replace(path, x=np.random.default_rng(0).normal(size=path.x.shape))
    jacobians = Jacobians(anywhere)
    assert 0.0 < np.abs(jacobians.shown[:, :, 0, 0]).max() * path.recording.noise[0] < 1e-9
    assert (jacobians.start_gain[0] == 1.0).all()


#: A column of experiments.csv with a level that holds for both kinds of runs.
#: A second place where an effort may act.
HUB = (
    ("dynamics:", "  hub: {effort: pull, unit: N m, velocity: omega}\ndynamics:"),
    ("- tau)/J", "- tau - pull)/J"),
)
rubbing = shared_study(Bench(friction=0.1, creep=1.0, samples=400))


@pytest.fixture(scope="module")
def base(rubbing: Study) -> FittedHypothesis:
    return FittedHypothesis.of(Hypothesis.known(rubbing), rubbing.recording.thinned(16))


@pytest.fixture(scope="module")
def network(base: FittedHypothesis) -> FittedHypothesis:
    return fit_network(base, 3, base.hypothesis.system.port_names)


def test_it_explains_what_the_physics_leaves_out(base: FittedHypothesis, network: FittedHypothesis) -> None:
    assert network.fit.left.value < 0.5 * base.fit.left.value


def test_its_law_is_that_of_the_friction(network: FittedHypothesis, rubbing: Study) -> None:
    """Where the port went, up to a damping, which the known physics has too."""
    (added,) = network.hypothesis.effects
    system = network.hypothesis.system.with_values(network.fit.values)
    law = sum(symbol(n) * unit for n, unit in zip(added.amplitudes, added.regressors, strict=True))
    function = numpy_system_function(system, [law], efforts_zero=True)
    middle = {name: spread.middle for name, spread in rubbing.scales.of.items()}
    v = np.linspace(-0.6, 0.6, 40) * rubbing.scales.of["omega"].rms
    x, u = np.column_stack([np.full(40, middle["theta"]), v]), np.full((40, 1), middle["torque"])
    effort = function(np.zeros(40), x, u, np.empty(0), np.array(system.values), np.empty((40, 0)))[:, 0]
    planted = 0.1 * np.tanh(v / 1.0)
    found = effort + (network.fit.values["b"] - 0.015) * v
    found -= found.mean()
    assert np.corrcoef(found, planted)[0, 1] > 0.95
    assert np.std(found - planted) < 0.4 * np.std(planted)


def test_the_same_seed_gives_the_same_network(base: FittedHypothesis, network: FittedHypothesis) -> None:
    again = fit_network(base, 3, base.hypothesis.system.port_names)
    assert again.fit.values == network.fit.values and again.fit.loss == network.fit.loss
    assert again.hypothesis.effects[0].regressors == network.hypothesis.effects[0].regressors
    other = with_networks(base.hypothesis, 4, base.hypothesis.system.port_names)
    assert other.effects[0].regressors != network.hypothesis.effects[0].regressors


def test_nothing_is_made_up_where_nothing_was_left_out(tmp_path: Path) -> None:
    """Weights that data do not know stay small, whatever noise they could explain."""
    known = study(tmp_path, Bench(friction=0.0, samples=400))
    recording = known.recording.thinned(16)
    base = FittedHypothesis.of(Hypothesis.known(known), recording)
    with_it = judged_model("neural", fit_network(base, 0, base.hypothesis.system.port_names))
    assert with_it.gap.value < 1.05 * judged_model("re-identified", base).gap.value


def test_nothing_at_level_zero_in_every_port(tmp_path: Path) -> None:
    two = study(tmp_path, Bench(samples=200), *HUB)
    hypothesis = with_networks(Hypothesis.known(two), 0, two.system.port_names)
    assert [e.place.name for e in hypothesis.effects] == ["joint", "hub"]
    weights = [u for u in hypothesis.unknowns if u.name.startswith("network")]
    assert len(weights) == 2 * (HIDDEN + len(AT_REST))
    joint, hub = ({str(s) for r in e.regressors for s in r.free_symbols} for e in hypothesis.effects)
    assert joint == {"theta", "omega", "torque"} and hub == {"omega", "torque"}
    simulations = (h.simulation(two.recording) for h in (hypothesis, Hypothesis.known(two)))
    found, expected = (simulation(simulation.values[None, None]).y for simulation in simulations)
    np.testing.assert_allclose(found, expected, atol=1e-12)
