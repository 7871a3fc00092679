"""A search that fits what linear systems rank finds what was planted; a network, what physics leaves out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.planted import plant
from tests.diagnosis.studies import JOINT, TORQUE, effect, shared_study, study
from tests.machines.folders import read_case
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.core import columns
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import Thresholds
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.network import AT_REST, HIDDEN, with_networks
from unmodelled.diagnosis.search.network import fit_network as fitted_network
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.systems.model import symbol
from unmodelled.systems.numeric import numpy_system_function

#: A column of experiments.csv with a level that holds for both kinds of runs.
GROUPS = ("new", "old", "new", "old", "new", "old")
IN_GROUP = Bench(runs=6, samples=300, groups=GROUPS, friction=tuple(0.06 * (g == "old") for g in GROUPS))
SUPPLY = Bench(runs=6, samples=300, friction=0.0, supply=(0.85, 1.1, 0.95, 1.2, 0.8, 1.05))


@pytest.mark.long
@pytest.mark.parametrize(
    ("bench", "family", "place"),
    [
        (IN_GROUP, "coulomb_friction", replace(JOINT, factor="group", level="old")),
        (SUPPLY, "scatter", TORQUE),
    ],
    ids=["friction in one group", "a supply that differs between runs"],
)
def test_what_was_planted_is_named(bench: Bench, family: str, place: Place, tmp_path: Path) -> None:
    candidates = EffectSearch(study(tmp_path, bench)).run()
    (found,) = candidates.fits[candidates.named()].hypothesis.effects
    assert (found.family, found.place) == (family, place)


#: Families of friction, which are the only ones that the next test compares.
FRICTION = ("viscous_friction", "coulomb_friction", "stribeck_friction", "hysteresis")


@pytest.mark.long
@pytest.mark.parametrize(("back", "exponent"), [(0.9, 3.0), (0.2, 1.5)])
def test_a_loop_of_another_shape_is_hysteresis(
    back: float, exponent: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(tmp_path, effect("hysteresis", "bouc_wen"), numbers={"b_h": back, "n_h": exponent, "x_h": 0.1})
    monkeypatch.setattr(columns, "effects", lambda: tuple(e for e in effects() if e.family in FRICTION))
    # a loop of the fixed shape predicts nearly as well, and is named where complexity has its price
    cheap = Thresholds(material_share=0.005)
    found = diagnose_gap(*read_case(tmp_path), 0.2, 0, 1, thresholds=cheap)
    (named,) = found.effects
    assert (named.added.family, named.added.variant) == ("hysteresis", "bouc_wen")
    assert named.estimates["F_h"].value == pytest.approx(0.15, rel=0.05)
    assert named.estimates["x_h"].value == pytest.approx(0.1, rel=0.1)
    assert named.estimates["b_h"].value == pytest.approx(back, abs=0.1)
    assert named.estimates["n_h"].value == pytest.approx(exponent, rel=0.15)


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
