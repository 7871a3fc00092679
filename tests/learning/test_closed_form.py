"""Known laws are planted in the motion of a slider-crank, and found again."""

from dataclasses import dataclass

import numpy as np
import pytest
import sympy as sp
from pytest import approx

from pipeline.rigs.slider_crank import SliderCrankRig
from pipeline.rigs.slider_crank_profiles import PROFILES
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.effects.formula_candidates import candidates, short_number
from unmodelled.learning.closed_form import LARGEST, ClosedForm, closed_form
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import symbol
from unmodelled.systems.numeric import NUMPY
from unmodelled.systems.scope import Scope, Value


@dataclass(frozen=True)
class Motion:
    theta: Array
    omega: Array
    d: Array
    v: Array
    spring: Array
    friction: Array
    experiment: Indices

    def form(self, force: Array, noise: float = 0.02) -> ClosedForm:
        """Of a `force` that follows d and v, with noise as a share of its range."""
        error = noise * np.ptp(force) * np.random.default_rng(3).standard_normal(len(force))
        return closed_form(self.d, self.v, force + error, self.experiment, ("d", "v"))


def motion(rig: SliderCrankRig) -> Motion:
    runs = [rig.simulate(profile, start=1.2) for profile in PROFILES]
    names = ("theta", "omega", "d", "v", "spring", "friction")
    columns = {name: np.concatenate([run[name] for run in runs]) for name in names}
    return Motion(**columns, experiment=np.repeat(np.arange(len(runs)), len(runs[0]["d"])))


@pytest.fixture(scope="module")
def m() -> Motion:
    """With the spring."""
    return motion(SliderCrankRig())


def evaluated(text: str, names: tuple[str, str], x: Array, v: Array) -> Array:
    """The values of `text` as a system file means it."""
    expression = parse(text, Scope({name: Value(symbol(name)) for name in names}), "law")
    function = sp.lambdify([symbol(name) for name in names], expression, modules=[NUMPY, "numpy"])
    return np.broadcast_to(function(x, v), x.shape)


def test_hardening_spring_with_dry_and_viscous_friction(m: Motion) -> None:
    law = 200 * m.d + 4e4 * m.d**3 + 6 * np.sign(m.v) + 4 * m.v
    form = m.form(law)
    smooth = [term for term in form.coefficients if "v/" not in term and "sign" not in term]
    assert smooth == ["d", "d**3", "v"]
    assert form.coefficients["d"] == approx(200, rel=0.03)
    assert form.coefficients["d**3"] == approx(4e4, rel=0.03)
    assert form.coefficients["v"] == approx(4, rel=0.03)
    zero, fast = np.zeros(1), np.full(1, 0.1)
    assert form(zero, fast) == approx(6 + 0.4, rel=0.03)
    assert form(zero, -fast) == -form(zero, fast)
    assert form.rmse < 0.03 * np.ptp(law)
    assert np.sqrt(np.mean((form(m.d, m.v) - law) ** 2)) < 0.002 * np.ptp(law)


def test_linear_spring(m: Motion) -> None:
    form = m.form(250 * m.d)
    assert form.coefficients == {"d": approx(250, rel=0.01)}
    assert form.text == f"{short_number(form.coefficients['d'])}*d"


def test_drag_and_a_constant_load(m: Motion) -> None:
    form = m.form(8 + 2 * m.v * np.abs(m.v))
    assert form.coefficients == {"1": approx(8, rel=0.02), "v*abs(v)": approx(2, rel=0.02)}


def test_stribeck_friction(m: Motion) -> None:
    dry, viscous, peak, fade, jump = 3.0, 1.5, 2.0, 0.1, 0.01
    law = (dry + peak * np.exp(-((m.v / fade) ** 2))) * np.tanh(m.v / jump) + viscous * m.v
    form = m.form(law)
    viscosity, friction, top = form.terms
    assert friction.jump == top.jump == approx(jump, rel=0.1)
    assert top.fade == approx(fade, rel=0.1)
    assert [*form.coefficients.values()] == approx([viscous, dry, peak], rel=0.05)
    assert [*form.coefficients] == [term.text("d", "v") for term in (viscosity, friction, top)]
    assert form.rmse < 0.03 * np.ptp(law)


def test_the_bench_with_its_spring(m: Motion) -> None:
    rig = SliderCrankRig()
    form = m.form(m.spring + m.friction)
    assert form.rmse < 0.03 * np.ptp(m.spring + m.friction)
    assert form.coefficients["v"] == approx(rig.viscous, rel=0.03)
    assert form.coefficients["d**4"] == approx(rig.stiffening * 1e4, rel=0.05)
    d = np.linspace(0.0, 0.1, 50)
    assert np.abs(form(d, np.zeros(1)) - rig.spring(d)).max() < 0.01 * np.ptp(m.spring)


@pytest.mark.long
def test_the_bench_without_its_spring_has_no_term_of_the_position() -> None:
    m = motion(SliderCrankRig().without_spring())
    form = m.form(m.friction)
    assert not any("d" in term for term in form.coefficients)
    assert form.rmse < 0.03 * np.ptp(m.friction)


def test_a_jump_that_the_network_smears_keeps_its_height(m: Motion) -> None:
    form = m.form(100 * m.d + 5 * np.tanh(m.v / 0.08))
    (friction,) = [term for term in form.terms if term.jump]
    assert friction.jump == approx(0.08, rel=0.05)
    assert form.coefficients[friction.text("d", "v")] == approx(5, rel=0.03)
    assert len(form.terms) == 2


def test_what_repeats_every_turn(m: Motion) -> None:
    law = 3 * np.sin(m.theta) + 0.4 * np.cos(2 * m.theta) + 0.02 * m.omega
    noisy = law + 0.02 * np.ptp(law) * np.random.default_rng(1).standard_normal(len(law))
    form = closed_form(m.theta, m.omega, noisy, m.experiment, ("theta", "omega"), angle=True)
    expected = {"sin(theta)": 3.0, "cos(2*theta)": 0.4, "omega": 0.02}
    assert form.coefficients == {term: approx(value, rel=0.05) for term, value in expected.items()}


def test_an_angle_that_stays_within_a_turn_may_have_a_spring(m: Motion) -> None:
    form = closed_form(m.d * 20, m.v * 20, 5 * m.d * 20, m.experiment, ("angle", "rate"), angle=True)
    assert form.text == "5*angle"


def test_nothing_but_noise_has_no_terms(m: Motion) -> None:
    noise = np.random.default_rng(0).standard_normal(len(m.d))
    form = closed_form(m.d, m.v, noise, m.experiment, ("d", "v"))
    assert (form.text, form.coefficients) == ("0", {})
    assert not form(m.d, m.v).any()


def test_a_constant_force_and_a_machine_that_stands_still(m: Motion) -> None:
    form = closed_form(m.d, m.v, np.full_like(m.d, -9.81), m.experiment, ("d", "v"))
    assert form.text == "-9.81" and form.rmse == 0.0
    x = np.linspace(0.0, 1.0, 60)
    form = closed_form(x, np.zeros(60), 3 * x, np.zeros(60, int), ("x", "v"))
    assert form.text == "3*x"


def test_text_says_in_the_grammar_of_a_system_file_what_the_form_does(m: Motion) -> None:
    form = m.form(m.spring - 20 * m.d**2 - m.friction)
    assert len(form.terms) > 3 and " - " in form.text and "+ -" not in form.text
    assert evaluated(form.text, ("d", "v"), m.d, m.v) == approx(form(m.d, m.v), rel=1e-9, abs=1e-9)
    error = np.sqrt(np.mean((form(m.d, m.v) - m.spring + 20 * m.d**2 + m.friction) ** 2))
    assert error < form.rmse


@pytest.mark.parametrize("jump", [0.0, 0.01])
def test_every_candidate_reads_as_it_computes(jump: float) -> None:
    x, v = np.random.default_rng(0).uniform(-1, 1, (2, 40))
    terms = candidates(jump, [0.05, 0.3], angle=True)
    texts = [term.text("x", "v") for term in terms]
    assert len(set(texts)) == len(terms)
    for text, term in zip(texts, terms, strict=True):
        assert evaluated(text, ("x", "v"), x, v) == approx(term(x, v), rel=1e-9, abs=1e-12), text


def test_errors_are_those_of_the_formula_and_of_the_noise(m: Motion) -> None:
    law = 250 * m.d + 4 * m.v
    form = m.form(law, noise=0.05)
    assert form.rmse == approx(0.05 * np.ptp(law), rel=0.05)


def test_few_terms_whatever_the_force(m: Motion) -> None:
    force = np.sin(90 * m.d) * np.cos(2 * m.v)
    form = closed_form(m.d, m.v, force, m.experiment, ("d", "v"))
    assert 0 < len(form.terms) <= LARGEST
    assert form.rmse == approx(np.sqrt(np.mean((form(m.d, m.v) - force) ** 2)))
    assert form.rmse > 0.05 * np.ptp(force)


@pytest.mark.long
def test_the_order_of_the_data_and_of_the_runs_does_not_matter(m: Motion) -> None:
    form = m.form(m.spring + m.friction)
    assert m.form(m.spring + m.friction) == form
    force = m.spring + m.friction
    force = force + 0.02 * np.ptp(force) * np.random.default_rng(3).standard_normal(len(force))
    order = np.random.default_rng(0).permutation(len(force))
    shuffled = closed_form(m.d[order], m.v[order], force[order], m.experiment[order] + 7, ("d", "v"))
    assert shuffled.text == form.text


def test_one_experiment_is_enough(m: Motion) -> None:
    first = m.experiment == 9
    form = closed_form(m.d[first], m.v[first], 80 * m.d[first] + m.v[first], m.experiment[first], ("d", "v"))
    assert form.coefficients == {"d": approx(80), "v": approx(1)}


@pytest.mark.parametrize(("which", "name"), [(0, "d"), (1, "v"), (2, "force")])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(which: int, name: str, value: float) -> None:
    arrays = [np.linspace(0.0, 1.0, 60) for _ in range(3)]
    arrays[which][17] = value
    with pytest.raises(BadInput, match=f"sample 18 of {name} is not finite"):
        closed_form(*arrays, np.zeros(60, int), ("d", "v"))


def test_too_few_samples_and_arrays_of_other_lengths_are_refused() -> None:
    few, x = np.linspace(0.0, 1.0, 49), np.linspace(0.0, 1.0, 60)
    with pytest.raises(BadInput, match="at least 50 samples, got 49"):
        closed_form(few, few, few, np.zeros(49, int), ("d", "v"))
    with pytest.raises(ValueError, match=r"one length, got d \(60,\), v \(60,\), force \(59,\)"):
        closed_form(x, x, x[1:], np.zeros(60, int), ("d", "v"))
