"""The linear system around a path ranks laws, and a search that fits them finds what was planted."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.planted import plant
from tests.diagnosis.studies import JOINT, ONE_FAULT, TORQUE, effect, fitted, shared_study, study
from tests.machines.folders import read_case
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.core.choose import Chooser
from unmodelled.diagnosis.core.columns import Atom, Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.path import Path as FreeRun
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

#: Share of a plausible size at which a law is simulated, to compare with its column.
SMALL = 1e-3


def columns_of(folder: Path, bench: Bench) -> Columns:
    base = fitted(Hypothesis.known(study(folder, bench)))
    return Columns(FreeRun.of(base, base.recording))


@cache
def chooser_of(folder: Path, bench: Bench) -> Chooser:
    columns = columns_of(folder, bench)
    return Chooser(Equations.of(columns), columns.path.gap)


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


def test_left_out_errors_are_those_of_fits_without_the_experiment() -> None:
    rng, runs, n = np.random.default_rng(1), 5, 3
    X, y = rng.normal(size=(runs, 40, n)), rng.normal(size=(runs, 40))
    Z = np.concatenate([X, y[..., None]], axis=2)
    gram = Z.transpose(0, 2, 1) @ Z
    atom, one = Atom(None, JOINT, {}, np.ones(1), np.zeros(1, bool), 1), np.ones(n, np.int64)  # type: ignore[arg-type]
    equations = Equations(
        *(gram, 0, (), np.empty(0), (atom,) * n, np.arange(n), one, np.zeros(n, bool)),
        *(np.full(runs, 40.0), None, frozenset()),  # type: ignore[arg-type]
    )
    found = equations.folds().errors(np.array([[0, 2]]))[0]
    for left in range(runs):
        others = [k for k in range(runs) if k != left]
        A, b = X[others][..., [0, 2]].reshape(-1, 2), y[others].ravel()
        best = np.linalg.solve(A.T @ A + np.eye(2) / 9.0, A.T @ b)
        rest = y[left] - X[left][:, [0, 2]] @ best
        assert found[left] == pytest.approx(rest @ rest)


@pytest.mark.parametrize(("bench", "family", "place"), ONE_FAULT.values(), ids=ONE_FAULT)
def test_a_planted_law_is_among_the_first(tmp_path: Path, bench: Bench, family: str, place: Place) -> None:
    chooser = chooser_of(tmp_path, bench)
    singles = [next(iter(s.names))[:2] for s in chooser.singles]
    assert (family, place.channel) in singles[:3]
    for one in chooser.singles[:10]:
        every = chooser.variants(one)
        hard = [sum(chooser.equations.atoms[a].effect.complexity for a in each.atoms) for each in every]
        assert hard == sorted(hard) and {each.names for each in every} == {one.names}
        assert one.cost == pytest.approx(min(each.cost for each in every))
    heads = [group[0] for group in chooser.classes()]
    assert heads == sorted(heads, key=lambda head: head.cost)


def test_dry_friction_scatters_beside_a_friction_that_all_experiments_share(tmp_path: Path) -> None:
    known = fitted(Hypothesis.known(study(tmp_path, Bench(samples=300, runs=4))))
    rubbing = fitted(known.hypothesis.plus(effect("coulomb_friction"), JOINT))
    every = [Columns(FreeRun.of(base, base.recording)).between.atoms for base in (known, rubbing)]
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
    assert 0.0 < np.abs(anywhere.shown[:, :, 0, 0]).max() * path.recording.noise[0] < 1e-9
    assert (anywhere.start_gain[0] == 1.0).all()


@pytest.mark.long
def test_where_nothing_is_missing_the_best_law_is_chance(tmp_path: Path) -> None:
    """Of ten machines without effects, the probability is spread from zero to one."""
    rubbing = Bench(samples=200, runs=8)
    benches = [*(replace(rubbing, friction=0.0, seed=seed) for seed in range(10)), rubbing]
    *found, missing = (chooser_of(tmp_path / str(k), bench).chance for k, bench in enumerate(benches))
    assert sum(chance < 0.1 for chance in found) <= 3 and max(found) > 0.3
    assert 0.5**6 <= missing <= 2.0 * 0.5**6  # the signs of six experiments that are fitted


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
    laws = tuple(e for e in effects() if e.family in FRICTION)
    monkeypatch.setattr("unmodelled.diagnosis.core.columns.effects", lambda: laws)
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
