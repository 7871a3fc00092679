"""A network in every port explains what physics leaves out."""

from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import shared_study, study
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.network import AT_REST, HIDDEN, with_networks
from unmodelled.diagnosis.search.network import fit_network as fitted_network
from unmodelled.systems.model import symbol
from unmodelled.systems.numeric import numpy_system_function

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
    return fitted_network(base, base.recording, 3)


def test_it_explains_what_was_left_out(base: FittedHypothesis, network: FittedHypothesis) -> None:
    compared = Candidates((LeftOut.of(base), LeftOut.of(network)))
    assert compared.beats(1, 0, priced=False) and not compared.beats(0, 1, priced=False)
    assert compared.remaining[1] < 0.5
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
    again = fitted_network(base, base.recording, 3)
    assert again.fit.values == network.fit.values and again.fit.loss == network.fit.loss
    assert again.hypothesis.effects[0].regressors == network.hypothesis.effects[0].regressors
    other = with_networks(base.hypothesis, 4)
    assert other.effects[0].regressors != network.hypothesis.effects[0].regressors


def test_nothing_is_made_up_where_nothing_was_left_out(tmp_path: Path) -> None:
    """Weights that data do not know stay small, whatever noise they could explain."""
    known = study(tmp_path, Bench(friction=0.0, samples=400))
    recording = known.recording.thinned(16)
    base = FittedHypothesis.of(Hypothesis.known(known), recording)
    with_it = judged_model("neural", fitted_network(base, recording, 0))
    assert with_it.gap.value < 1.05 * judged_model("re-identified", base).gap.value


def test_nothing_at_level_zero_in_every_port(tmp_path: Path) -> None:
    two = study(tmp_path, Bench(samples=200), *HUB)
    hypothesis = with_networks(Hypothesis.known(two), 0)
    assert [e.place.name for e in hypothesis.effects] == ["joint", "hub"]
    weights = [u for u in hypothesis.unknowns if u.name.startswith("network")]
    assert len(weights) == 2 * (HIDDEN + len(AT_REST))
    joint, hub = ({str(s) for r in e.regressors for s in r.free_symbols} for e in hypothesis.effects)
    assert joint == {"theta", "omega", "torque"} and hub == {"omega", "torque"}
    simulations = (h.simulation(two.recording) for h in (hypothesis, Hypothesis.known(two)))
    found, expected = (simulation(simulation.values[None, None]).y for simulation in simulations)
    np.testing.assert_allclose(found, expected, atol=1e-12)
