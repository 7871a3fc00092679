"""The judge: evidence of laws beside a measurement chain, over long windows."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import effect, study
from tests.machines.folders import system_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.judge import further, judgement
from unmodelled.diagnosis.judge.base import Base, bases
from unmodelled.diagnosis.judge.chain import UNUSUAL, chain_of, unusual_parts
from unmodelled.diagnosis.judge.classes import BAR, LawClass, best_class
from unmodelled.diagnosis.judge.curves import free_curves
from unmodelled.diagnosis.judge.elimination import SIGMAS, newton_step
from unmodelled.diagnosis.judge.judgement import Judgement, judge
from unmodelled.diagnosis.judge.left_out import LeftOutRuns, probabilities
from unmodelled.diagnosis.judge.linear import Linearised, beyond_chance
from unmodelled.diagnosis.judge.looks import Look
from unmodelled.diagnosis.judge.refit import Parent, Refit, refit
from unmodelled.diagnosis.judge.residual import correlation_time
from unmodelled.diagnosis.judge.scan import row_of, scan, started
from unmodelled.effects.library import effects
from unmodelled.effects.scatter import is_lossy
from unmodelled.systems.units import parse_unit

LINES: list[str] = []
QUIET = LINES.append


def begun(found: Study) -> FittedHypothesis:
    return FittedHypothesis.of(Hypothesis.known(found), found.recording)


@cache
def judged(folder: Path, bench: Bench) -> Judgement:
    found = study(folder, bench)
    return judge(found, begun(found), 2, QUIET)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("judge")


@pytest.fixture(scope="module")
def rubbing(folder: Path) -> Base:
    """Of a pendulum with dry friction, at the default horizon."""
    return judged(folder / "friction", Bench()).looks[0].parent.base


def test_friction_is_named_and_nothing_where_nothing_is(folder: Path) -> None:
    found = judged(folder / "friction", Bench())
    assert found.verdict == "effect"
    (law,) = found.laws
    assert found.alike is None and found.final.explained > judgement.MAIN
    assert (law.speaker.row.atom.effect.family, law.kind) == ("coulomb_friction", "dry friction")
    size, error = law.speaker.numbers["F_c"]
    assert size == pytest.approx(0.06, rel=0.03) and abs(size - 0.06) < 4.0 * error
    assert law.probabilities.sum() == pytest.approx(1.0)
    none = judged(folder / "null", Bench(friction=0.0))
    assert none.verdict == "no_gap" and not none.laws


def test_beside_the_chain_a_right_law_leaves_the_noise_of_the_sensor(folder: Path) -> None:
    """Every part of the chain can be nothing: a lag of half a sample alone leaves seven times the noise."""
    found = judged(folder / "friction", Bench())
    for look in found.looks:
        best = max(look.refits, key=lambda one: one.nats)
        assert np.sqrt(best.residual.square).max() < 1.05 and best.residual.tau.max() < 1.5
    assert not found.final.around.varies


@pytest.mark.long
def test_friction_is_named_where_a_sensor_slips_in_some_windows(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Laws that leave more than they explain are not named; friction explains nearly all of most windows."""
    found = judged(folder / "slip", Bench(missed=0.05))
    assert found.verdict == "main_effect" and found.final.explained > 0.6
    assert found.laws[0].speaker.row.name == "coulomb_friction@joint"
    ours, _, usual = found.final.around.squares / found.final.square
    assert usual.max() < 0.5 * ours.max()
    monkeypatch.setattr(judgement, "MAIN", 1.1)
    found = judged.__wrapped__(folder / "slip", Bench(missed=0.05))
    assert found.verdict == "unknown" and not found.laws and found.final.explained == 0.0
    assert found.alike is not None and found.alike.speaker.row.name == "coulomb_friction@joint"


def test_laws_that_are_taken_back_are_what_is_most_alike(folder: Path) -> None:
    found = judged(folder / "friction", Bench())
    none = found.until(0)
    assert (none.verdict, none.laws, none.alike) == ("unknown", (), found.laws[0])
    assert none.final is found.look.parent and none.rounds == (found.look,)


def test_a_law_that_made_up_for_another_one_goes(folder: Path) -> None:
    """Dry friction named beside stops, which explain most of its gap alone, leaves nothing for them."""
    look = judged(folder / "friction", Bench()).look
    stops = next(one for one in look.refits if one.row.atom.effect.family == "end_stop")
    assert stops.nats > 0.9 * BAR and stops.removed > 0.8
    laws, rounds, parent = further._named([look], look, LawClass((stops,), np.ones(1)), 2, QUIET)
    assert [law.speaker.row.name for law in laws] == ["coulomb_friction@joint"] and rounds == [look]
    assert [e.family for e in parent.fitted.hypothesis.effects if not e.usual] == ["coulomb_friction"]


def test_a_law_is_ranked_over_windows_of_every_length(folder: Path) -> None:
    looks = judged(folder / "friction", Bench()).looks
    nats = [{one.row.key: max(one.nats, -one.price) for one in look.refits} for look in looks]
    shared = set(nats[0]) & set(nats[1])
    assert len(shared) > 3
    for look in looks:
        for one in look.refits:
            if one.row.key in shared:
                assert one.overall == pytest.approx(np.mean([each[one.row.key] for each in nats]))
            else:
                assert one.overall == -np.inf


def test_a_drift_is_named_though_experiments_may_deviate(tmp_path: Path) -> None:
    """Dampings that grow from run to run: each may have its own, but a new run is predicted by the drift."""
    many = 8
    growing = Bench(runs=many, friction=0.0, b=tuple(0.015 + 0.004 * k for k in range(many)))
    found = judged(tmp_path, growing)
    assert found.laws and found.laws[0].speaker.row.atom.effect.family == "drift"
    with_own, new, _ = found.look.parent.around.squares
    assert new.max() > 3.0 * with_own.max()


def test_a_law_that_diverges_where_its_parent_does_not_is_none(
    rubbing: Base, rubs: dict[str, Refit], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Samples without a value leave no error, so that such a law would leave nothing."""
    fit = Base.fit

    def lost(self: Base, hypothesis: Hypothesis, start: Start) -> FittedHypothesis:
        found = fit(self, hypothesis, start)
        found.errors[0][:1] = np.nan
        return found

    parent, row = Parent.of(rubbing), rubs["coulomb_friction@joint"].row
    monkeypatch.setattr(Base, "fit", lost)
    gone = refit(parent, row)
    assert gone is not None and gone.residual.diverged > 0 and gone.nats == -np.inf
    assert parent.residual.diverged == 0 and rubs["coulomb_friction@joint"].nats > BAR


def test_a_free_curve_beside_a_law_of_some_experiments_acts_in_all(folder: Path) -> None:
    groups = ("new", "old", "new", "old")
    rubs = Bench(runs=4, samples=300, groups=groups, friction=tuple(0.06 * (g == "old") for g in groups))
    found = study(folder / "some", rubs)
    parent = Parent.of(next(bases(found, begun(found))))
    local = next(
        row
        for row in scan(parent.around)
        if row.name == "coulomb_friction@joint where group is old" and not row.atom.effect.variant
    )
    law = refit(parent, local)
    assert law is not None and law.nats > BAR
    curves = list(free_curves(parent.beside(law)))
    assert curves and all(curve.row.atom.place.factor is None for curve in curves)


@pytest.mark.long
def test_a_late_sensor_is_part_of_the_chain_until_it_is_unusually_late(folder: Path) -> None:
    late = judged(folder / "late", Bench(delay=3))
    assert [law.kind for law in late.laws] == ["dry friction"]
    # with one output, only the sum of what is late in the drive and in the sensor shows
    shift = sum(v for n, v in chain_of_numbers(late).items() if n.startswith("T_"))
    assert shift == pytest.approx(0.006, abs=0.002)
    later = judged(folder / "later", Bench(friction=0.0, delay=20))
    assert [law.kind for law in later.laws] == ["timing"]


def chain_of_numbers(found: Judgement) -> dict[str, float]:
    fitted = found.final.fitted
    names = [n for e in chain_of(fitted.hypothesis) for n in (*e.delays, *e.amplitudes, *e.shapes)]
    return {n: fitted.fit.values[n] for n in names if n in fitted.fit.values}


def test_every_part_of_the_chain_has_a_prior_and_is_no_law_of_the_scan(rubbing: Base) -> None:
    hypothesis = rubbing.fitted.hypothesis
    parts = {added.family for added in chain_of(hypothesis)}
    wanted = {"scatter", "sensor_gain", "sensor_offset", "sensor_delay", "input_delay", "actuator_lag"}
    assert parts <= wanted and wanted - parts <= {"actuator_lag"}
    laws = {row.atom.effect.family for row in scan(Linearised.of(rubbing.fitted, rubbing.tau))}
    assert not laws & parts - {"scatter"}
    assert "coulomb_friction" in laws


def test_unusual_numbers_leave_the_chain(rubbing: Base) -> None:
    fitted, tau = rubbing.fitted, rubbing.tau
    assert unusual_parts(fitted, tau) == []
    (gain,) = [e for e in chain_of(fitted.hypothesis) if e.family == "sensor_gain"]
    (name,) = gain.amplitudes
    size = UNUSUAL * np.sqrt(tau) * gain.priors[name]
    far = replace(fitted, fit=replace(fitted.fit, values={**fitted.fit.values, name: 1.1 * size}))
    assert unusual_parts(far, tau) == [gain.key]


@pytest.mark.parametrize(
    ("deviations", "common"),
    [
        ([0.2, 0.2, 0.2, 0.2], 0.2),
        ([0.1, -0.1, 0.08, -0.06], 0.0),
        ([-0.3, -0.3, -0.28, -0.32], -0.283),
        ([0.4], 0.4),
    ],
)
def test_the_mean_of_deviations_counts_beyond_chance(deviations: list[float], common: float) -> None:
    assert beyond_chance(np.array(deviations)[:, None]) == pytest.approx([common], abs=1e-3)


def test_a_number_at_its_bound_stays_there(rubbing: Base) -> None:
    around = Linearised.of(rubbing.fitted, rubbing.tau)
    names = [u.name for u in around.columns.unknowns(own=False)]
    ends = [rubbing.fitted.at_bound(name) for name in names]
    assert any(ends) and not all(ends)
    assert np.abs(newton_step(around.normal)[ends]).max() < 1e-6


def test_a_useless_number_costs_half_the_logarithm_of_the_samples(rubbing: Base) -> None:
    around = Linearised.of(rubbing.fitted, rubbing.tau)
    (atom,) = [row.atom for row in scan(around) if row.name == "quadratic_drag@joint"]
    columns = np.random.default_rng(0).standard_normal((*around.columns.path.error.shape, 1))
    row = row_of(around, replace(atom, positive=np.zeros(1, np.bool_)), columns)
    assert row.nats == pytest.approx(-around.weights.price(1), abs=3.0)
    assert around.weights.price(1) == pytest.approx(0.5 * np.log(around.weights.samples))


def test_units_change_no_evidence(rubbing: Base) -> None:
    around = Linearised.of(rubbing.fitted, rubbing.tau)
    for atoms, columns in around.columns.atoms():
        if (atoms[0].effect.family, atoms[0].effect.variant) == ("coulomb_friction", ""):
            rows = [row_of(around, atoms[0], factor * columns) for factor in (1.0, 57.3)]
            assert rows[0].nats == pytest.approx(rows[1].nats, rel=1e-6)
            assert rows[0].amount == pytest.approx(57.3 * rows[1].amount, rel=1e-6)
            return
    raise AssertionError("dry friction is not among the laws")


def test_no_change_of_the_outputs_changes_no_evidence(rubbing: Base) -> None:
    around = Linearised.of(rubbing.fitted, rubbing.tau)
    step, nothing = newton_step(around.normal), np.zeros(around.columns.path.error.shape)
    assert around.evidence_with(nothing, step, around.sigma) == pytest.approx(around.evidence)
    # the residual itself as a change leaves nothing, where deviations of experiments may stay as they are
    left = around.columns.path.error
    assert around.evidence_with(left, 0.0 * step, SIGMAS[-1]) > around.evidence + around.weights.samples


@pytest.fixture(scope="module")
def rubs(rubbing: Base) -> dict[str, Refit]:
    """Laws at the joint, none of which was fitted but the first."""
    parent, found = Parent.of(rubbing), dict[str, Refit]()
    for row in scan(parent.around):
        if row.name in ("coulomb_friction@joint", "stribeck_friction@joint", "viscous_friction@joint"):
            if not found:
                first = refit(parent, row)
                assert first is not None
                found[row.name] = first
            found[row.name] = replace(next(iter(found.values())), row=row)
    return found


@pytest.mark.parametrize(
    ("plain", "other", "named"),
    [
        # nats and shares that are removed beside 100 nats and 0.9 of a Stribeck curve
        *(((60.0, 0.75), (70.0, 0.75), "stribeck_friction"), ((60.0, 0.7), (91.0, 0.7), "viscous_friction")),
        *(((91.0, 0.2), (60.0, 0.7), "coulomb_friction"), ((5.0, 0.75), (4.0, 0.9), "viscous_friction")),
        *(((-1.0, 0.75), (60.0, 0.7), "stribeck_friction"), ((60.0, 0.7), (60.0, 0.86), "viscous_friction")),
    ],
)
def test_the_plainest_law_speaks_that_explains_as_much(
    rubs: dict[str, Refit], plain: tuple[float, float], other: tuple[float, float], named: str
) -> None:
    sizes = (100.0, 0.9), plain, other
    names = "stribeck_friction@joint", "coulomb_friction@joint", "viscous_friction@joint"
    correlated = replace(rubs[names[0]].residual, tau=np.array([50.0]))
    laws = [
        replace(
            rubs[n],
            nats=nats,
            overall=nats,
            removed=share,
            square=np.full((3, 1), 1.0 - share),
            residual=correlated,
        )
        for n, (nats, share) in zip(names, sizes, strict=True)
    ]
    found = best_class(laws)
    assert found is not None and found.speaker.row.name == f"{named}@joint"
    nats = [one.nats for one in found.members[1:]]
    assert nats == sorted(nats, reverse=True) and found.probabilities.sum() == pytest.approx(1.0)
    assert best_class([replace(one, nats=10.0) for one in laws]) is None


def test_where_the_best_law_leaves_noise_no_form_that_leaves_more_is_like_it(rubs: dict[str, Refit]) -> None:
    best, plain = rubs["stribeck_friction@joint"], rubs["coulomb_friction@joint"]
    assert best.residual.white
    nats = best.nats - 50.0
    less = replace(plain, nats=nats, overall=nats, removed=0.9 * best.removed, square=20.0 * best.square)
    found = best_class([best, less])
    assert found is not None and found.members == (best,)
    likelier = replace(less, score=replace(less.score, price=less.score.price - 1.0))
    found = best_class([best, likelier])  # evidence and predictions disagree: the logs do not tell
    assert found is not None and found.members == (best, likelier)


def test_the_plainest_form_of_a_class_is_of_its_kind_and_place(rubs: dict[str, Refit]) -> None:
    flexible, plain, other = (
        rubs[f"{name}@joint"] for name in ("stribeck_friction", "coulomb_friction", "viscous_friction")
    )
    found = LawClass((flexible, other, plain), np.array([0.5, 0.3, 0.2]))
    assert found.plainest.members == (plain, flexible, other)
    assert found.plainest.probabilities.tolist() == [0.2, 0.5, 0.3]
    again = found.plainest
    assert again.plainest is again
    assert LawClass((flexible, other), np.ones(2)).plainest.speaker is flexible


def test_a_fit_beside_a_law_is_integrated_as_finely_as_it_needs(rubbing: Base) -> None:
    """Beside a law that leaves noise, steps that were short enough for the error of the base are too long."""
    parent = Parent.of(rubbing)
    row = max(scan(parent.around), key=lambda row: row.nats)
    law = refit(parent, row)
    assert law is not None
    coarse = replace(parent, base=replace(rubbing, substeps=1)).beside(law)
    assert coarse.fitted.fit.substeps == coarse.base.substeps
    assert coarse.base.needed(coarse.fitted) == 1 or coarse.base.substeps > 1
    assert coarse.square == pytest.approx(parent.beside(law).square, rel=0.05)


def test_a_flexible_law_gives_way_to_its_plainest_form_beside_a_further_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Evidence of all laws decides, and what the further law removes must be an effect."""
    look = judged(folder / "friction", Bench()).look
    first = best_class(look.refits)
    assert first is not None
    flexible = max(first.members, key=lambda one: one.row.atom.numbers)
    assert flexible.row.atom.numbers > first.speaker.row.atom.numbers
    swapped = LawClass(
        (flexible, *(one for one in first.members if one is not flexible)), first.probabilities
    )
    final = look.parent.beside(flexible)
    coloured = replace(final, residual=replace(final.residual, tau=np.array([50.0])))
    for removed, nats, plainest in ((0.2, 1.0, True), (0.01, 1.0, False), (0.2, -1.0, False)):
        nothing = look.parent.around.squares  # is gone of what the first law leaves
        law = LawClass((replace(flexible, removed=removed, square=nothing),), np.ones(1))

        def named(
            looks: object, look: Look, one: LawClass, *more: object, law: LawClass = law
        ) -> further.Named:
            return ([one, law], [look, look], coloured) if one is not swapped else ([one], [look], coloured)

        def evidence(look: object, found: further.Named, nats: float = nats) -> float:
            return nats if len(found[0]) > 1 else 0.0

        monkeypatch.setattr(further, "_named", named)
        monkeypatch.setattr(further, "_evidence", evidence)
        monkeypatch.setattr(further, "_beside_others", lambda _, laws: laws[0])
        (laws, rounds, _), instead = further.exchanged([look], look, swapped, 1, QUIET)
        assert (laws[0] is not swapped) == plainest == (instead is not None)
        if plainest:  # without the further law it is less
            both = Judgement("effect", tuple(laws), (look,), tuple(rounds), coloured, instead=instead)
            assert both.until(1).laws == (swapped,) and both.until(1).final is coloured


def test_the_linear_step_finds_dry_friction(rubbing: Base) -> None:
    best = max(scan(Linearised.of(rubbing.fitted, rubbing.tau)), key=lambda row: row.nats)
    assert best.atom.effect.kind == "dry friction" and best.nats > 30.0


def test_a_run_left_out_is_predicted_by_the_others(rubbing: Base) -> None:
    around = Linearised.of(rubbing.fitted, rubbing.tau)
    found = LeftOutRuns.of(around)
    assert np.all(found.worse >= 1.0) and found.square.sum() > found.fitted.sum()
    assert found.samples.sum() == pytest.approx(around.weights.samples)
    # by brute force, with the products of the others alone
    each, price = around.bare[around.sigma].each, around.bare[around.sigma].price
    others = each[1:].sum(axis=0) + around.prior
    moved = np.append(-np.linalg.solve(others[:-1, :-1], others[:-1, -1]), 1.0)
    priors = 2.0 * (found.price[0] - price[0])  # of starts and deviations, which are in the products
    weighted = (found.square * around.counts)[found.owner == 0]
    assert weighted.sum() + priors == pytest.approx(float(moved @ each[0] @ moved))


@pytest.mark.parametrize("count", [2, 5, 40])
def test_probabilities_of_equal_laws_are_equal_and_sum_to_one(count: int) -> None:
    scores = np.random.default_rng(count).standard_normal((1, count))
    equal = probabilities(np.concatenate([scores, scores]))
    assert equal == pytest.approx([0.5, 0.5])
    better = probabilities(np.concatenate([scores, scores - 5.0]))
    assert better.sum() == pytest.approx(1.0) and better[0] > 0.99


def test_what_one_of_many_runs_says_alone_counts_little() -> None:
    alone, every = np.zeros((2, 10)), np.zeros((2, 10))
    alone[1, 0], every[1] = -20.0, -2.0
    shares = [probabilities(scores)[0] for scores in (alone, every)]
    assert shares[0] < shares[1] and shares[1] > 0.999


@pytest.mark.parametrize("memory", [0.0, 0.9, 0.98])
def test_the_correlation_time_is_that_of_the_process(memory: float) -> None:
    rng, x = np.random.default_rng(1), np.zeros((40, 2000))
    for k in range(1, x.shape[1]):
        x[:, k] = memory * x[:, k - 1] + rng.standard_normal(40)
    found = correlation_time(x, np.ones(x.shape, np.bool_))
    # the sum ends at the first small lag, and windows without their mean lose a little
    assert found == pytest.approx((1.0 + memory) / (1.0 - memory), rel=0.2)


@pytest.mark.parametrize(
    ("unit", "lossy"),
    [
        *(("N s/m", True), ("kg/s", True), ("N m s/rad", True), ("ohm", True), ("W/K", True)),
        *(("kg", False), ("N/m", False), ("H", False), ("F", False), ("J/K", False), ("N m/A", False)),
        *(("s", False), ("1/s", False), ("1", False)),
    ],
)
def test_losses_are_told_by_their_dimension(unit: str, lossy: bool) -> None:
    assert is_lossy(parse_unit(unit).dimension) is lossy


def test_every_law_has_a_kind() -> None:
    assert all(effect.kind for effect in effects())
    assert effect("coulomb_friction").kind == "dry friction" and effect("sensor_delay").kind == "timing"


@pytest.mark.parametrize(
    ("equation", "starts"), [("torque - tau", ["start"]), ("torque - tau - start", [])], ids=["start", "acts"]
)
def test_where_states_start_is_no_factor_of_laws(equation: str, starts: list[str], tmp_path: Path) -> None:
    system = system_of(
        "schema: system/1\nname: turn\n"
        "states: {theta: {unit: rad}, omega: {unit: rad/s}, hidden: {unit: N m, initial: start}}\n"
        "inputs: {torque: {unit: N m}}\noutputs: {theta: {unit: rad}}\n"
        "operating_point: {start: {unit: N m}}\n"
        "parameters: {J: {value: 1.0, unit: kg m^2}, T: {value: 1.0, unit: s}}\n"
        "ports: {joint: {effort: tau, unit: N m, position: theta, velocity: omega}}\n"
        f"dynamics: {{theta: omega, omega: ({equation} - hidden)/J, hidden: -hidden/T}}\n",
        tmp_path,
    )
    assert started(system) == starts
