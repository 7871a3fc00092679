"""The register machine and NumPy functions compute what the symbolic equations say."""

import math

import numpy as np
import pytest
import sympy as sp
import torch
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.machines.known import NAMES, Array, built_in, values_of
from tests.measurements.systems import F, V, k, m, motor, omega, theta
from tests.physics.kernel.problems import problem, simulated
from tests.physics.kernel.random_systems import random_structure
from unmodelled.base.errors import BadInput
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.interpreter import exp, tanh
from unmodelled.engine.machine.opcodes import LANES, Op
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.systems import functions as f
from unmodelled.systems.functions import at_least, equal, greater
from unmodelled.systems.model import TIME, System, symbol
from unmodelled.systems.numeric import numpy_system_function

x, y, u, p, c = (symbol(name) for name in "xyupc")

HOW = Integration(0.1, "rk4", 1, 1.0)


def made(rate: sp.Expr, *observed: sp.Expr) -> Program:
    """x' = rate, with an input u, a parameter p and a constant c."""
    return assembled(Equations([x], [u], [p], [c], [rate], observed or [x], {}, ()))


def test_equations_without_states_at_many_samples_for_some_sets() -> None:
    """As one by one; 0 where they have no finite value."""
    program = assembled(Equations([], [u], [p], [c], [], [p * u + c + TIME, sp.sqrt(u) / p], {}, ()))
    draw, samples = np.random.default_rng(0).normal, 2 * LANES + 3
    t, inputs, sets, constants = (draw(size=size) for size in (samples, (samples, 1), (3, 1), (2, 1)))
    owner = np.arange(samples) % 2
    found = program.evaluate_sets(t, inputs, sets, constants, owner)
    alone = program.evaluate(t[:, None], np.empty(0), inputs[:, None], sets, constants[owner][:, None])
    expected = np.where(np.isfinite(alone), alone, 0.0)
    np.testing.assert_array_equal(found, expected)
    assert (found[..., 1] == 0.0).any() and (found != 0.0).all(axis=1).any()


def assert_same(system: System, seed: int, size: Array | float = 1.0, samples: int = 150) -> None:
    """Dynamics and outputs at random states of about `size`."""
    expressions = [*system.dynamics, *(output.expression for output in system.outputs)]
    closed = [*system.closed, *(output.expression for output in system.outputs)]
    draw = np.random.default_rng(seed).normal
    t, states = draw(size=samples), size * draw(size=(samples, len(system.x)))
    inputs, constants = (draw(size=(samples, len(group))) for group in (system.u, system.c))
    values = np.array(system.values) * (1.0 + 0.1 * draw(size=(samples, len(system.p))))
    cuts = [angle.args[0] for e in closed for angle in e.atoms(sp.atan2)]
    cuts += [a.args[0] - a.args[1] for e in closed for a in e.atoms(greater, at_least, equal)]
    function = numpy_system_function(system, [*closed, *cuts], efforts_zero=True)
    arguments = t, states, inputs, np.empty(0), values, constants
    expected, heights = np.split(function(*arguments), [len(closed)], axis=1)
    beside = function(*((1.0 + 1e-15) * a for a in arguments))
    found = Program.of(system, expressions).evaluate(t, states, inputs, values, constants)
    with np.errstate(all="ignore"):
        # what rounding of the arguments alone does
        rounding = np.nan_to_num(np.abs(beside[:, : len(closed)] - expected))
        near = np.abs(found - expected) <= 1e-12 * (1.0 + np.abs(expected)) + 1e3 * rounding
    same = near | (found == expected) | (np.isnan(found) & np.isnan(expected))
    # half a turn is plus or minus pi by the sign of a zero, which neither the machine nor a kernel keeps; of
    # two numbers that are equal but for rounding either may be larger
    assert same[(np.abs(heights) > 1e-12).all(-1)].all()


@pytest.mark.parametrize("name", NAMES)
def test_system_files(name: str) -> None:
    system = built_in(name)
    size = np.array([max(abs(float(state.initial)), 1.0) for state in system.states])
    assert_same(system, 0, size)


@pytest.mark.long
@settings(max_examples=40)
@given(seed=st.integers(0, 10**6))
def test_random_systems(seed: int) -> None:
    try:
        system = random_structure(seed).system
    except BadInput:
        assume(False)
    assert_same(system, seed)


@pytest.mark.parametrize("seed", [2, 4, 7])
@pytest.mark.parametrize("hold", [0.0, 1.0])
def test_free_runs_equal_the_reference(seed: int, hold: float) -> None:
    """21 windows of three experiments, another parameter for each of two sets."""
    system = random_structure(seed).system
    given = problem(Augmented(system), steps=4, period=0.02, seed=seed)
    data, starts, how = given.data, given.starts, Integration(0.02, "rk4", 2, hold)
    program = assembled(Equations.of(system, system.x))
    steps = np.full(len(starts), given.steps)
    windows = Windows(data.u, data.t, starts, steps, data.owner[starts], np.zeros(2, np.int64))
    values = given.model.physics().detach().numpy()
    sets = np.broadcast_to(values, (3, *values.shape))
    x0 = np.repeat(given.x0[:, None], 2, axis=1)
    found = free_run(program, windows, sets, data.c, x0, how)
    expected, _ = simulated(given, torch.tensor(given.x0), how)
    np.testing.assert_allclose(found, expected.detach().transpose(0, 1).numpy(), rtol=1e-11, atol=1e-11)


def free_runs(program: Program, windows: Windows, x0: Array, p: Array) -> Array:
    return free_run(program, windows, p, np.array([[0.5], [0.7]]), x0, HOW)


def some_windows(count: int, sets: int) -> Windows:
    rng = np.random.default_rng(1)
    start, steps = rng.integers(0, 30, count), rng.integers(0, 9, count)
    drive, owner, shift = rng.normal(size=(80, 1)), rng.integers(0, 2, count), np.arange(sets) % 2 * 40
    return Windows(drive, np.arange(40) * 0.1, start, steps, owner, shift)


def test_lanes_do_not_touch_each_other() -> None:
    """Windows of different lengths, one by one and together, in any order of the sets."""
    program = made(-p * x + u * sp.cos(TIME) + c, x**2, u)
    windows, rng = some_windows(57, 5), np.random.default_rng(2)
    assert (57 * 5) % LANES
    x0, values = rng.normal(size=(57, 5, 1)), rng.uniform(0.5, 2.0, (2, 5, 1))
    found = free_runs(program, windows, x0, values)
    order = np.array([3, 0, 4, 1, 2])
    turned = free_runs(program, windows._replace(shift=windows.shift[order]), x0[:, order], values[:, order])
    np.testing.assert_array_equal(found[:, order], turned)
    for w in range(0, 57, 8):
        one = slice(w, w + 1)
        own = windows._replace(start=windows.start[one], steps=windows.steps[one], owner=windows.owner[one])
        alone = free_runs(program, own, x0[one], values)
        np.testing.assert_array_equal(found[one, :, : alone.shape[2]], alone)
        assert np.isnan(found[one, :, alone.shape[2] :]).all() and np.isfinite(alone).all()


def test_a_set_reads_its_own_table_of_inputs() -> None:
    windows = some_windows(9, 2)
    program, x0, values = made(u - x), np.zeros((9, 2, 1)), np.ones((2, 2, 1))
    both = free_runs(program, windows, x0, values)
    second = windows._replace(u=windows.u[40:], shift=np.zeros(1, np.int64))
    np.testing.assert_array_equal(both[:, 1:], free_runs(program, second, x0[:, :1], values[:, :1]))


def test_a_diverging_lane_leaves_the_others_alone() -> None:
    program = made(p * x**3)
    drive, t = np.zeros((40, 1)), np.arange(40) * 0.1
    windows = Windows(drive, t, *np.array([[0], [39], [0]]), np.zeros(2, np.int64))
    values = np.array([[[50.0], [-1.0]]])
    found = free_run(program, windows, values, np.zeros((1, 1)), np.ones((1, 2, 1)), HOW)
    assert not np.isfinite(found[0, 0, -1]).any()
    assert found[0, 1, -1, 0] == pytest.approx(1.0 / math.sqrt(1.0 + 2.0 * 3.9), rel=1e-3)


def parts(program: Program) -> dict[str, list[str]]:
    """Names of the instructions by how often they are computed."""
    at = program.at
    ends = {"prologue": (at.prologue, at.driven), "driven": (at.driven, at.observed)}
    ends["rates"] = (at.rates, at.end)
    return {name: [Op(row[0]).name for row in program.code[a:b]] for name, (a, b) in ends.items()}


def test_what_changes_seldom_is_computed_seldom() -> None:
    rate = sp.exp(p) * sp.atan(c) * x * 3 + p * sp.cos(TIME) * sp.sinh(u) + sp.sin(x * sp.log(p))
    found = {name: {*codes} for name, codes in parts(made(rate)).items()}
    assert found["prologue"] == {"EXP", "ATAN", "MUL", "LOG"}
    assert found["driven"] == {"COS", "SINH", "MUL"}
    assert found["rates"] == {"MULADD", "ADD", "SIN", "MUL"}


def test_equal_parts_are_computed_once() -> None:
    program = made(sp.sin(x) * sp.exp(-sp.sin(x)) + sp.sqrt(sp.sin(x) + 2), sp.sin(x))
    assert parts(program)["rates"].count("SIN") == 1


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6))
def test_no_instruction_writes_what_it_reads(seed: int) -> None:
    try:
        system = random_structure(seed).system
    except BadInput:
        assume(False)
    program = assembled(Equations.of(system, system.dynamics))
    sources = program.code[:, 2:5]
    # a register that an instruction does not use is number 0, that of the first state
    assert not np.any((sources == program.code[:, 1:2]) & (sources > 0))
    assert (program.code[:, 1] >= len(system.x)).all()
    assert program.code[:, 1:5].max(initial=0) < program.at.rows


@pytest.mark.parametrize(("ours", "theirs"), [(exp, np.exp), (tanh, np.tanh)])
def test_exponential_functions(ours, theirs) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(0)
    small = 10.0 ** rng.uniform(-300.0, 0.0, 500) * rng.choice([-1.0, 1.0], 500)
    values = np.concatenate([rng.uniform(-30.0, 30.0, 4000), rng.uniform(-745.0, 709.7, 2000), small, [0.0]])
    with np.errstate(all="ignore"):
        expected = theirs(values)
        found = np.array([ours(v) for v in values])
        normal = np.abs(expected) > 1e-300
        error = np.abs(found - expected)[normal] / np.abs(expected)[normal]
        assert error.max() < 1e-15 and np.abs(found - expected)[~normal].max(initial=0.0) < 1e-300
        for v in (math.inf, -math.inf, 710.0, -750.0, math.nan):
            np.testing.assert_equal(ours(v), float(theirs(v)))


def test_what_the_machine_does_not_know() -> None:
    with pytest.raises(ValueError, match="no instruction for besselj"):
        made(sp.besselj(0, x))
    with pytest.raises(ValueError, match="no instruction for y"):
        made(x + y)


@pytest.mark.parametrize("change", [{"start": [-1]}, {"steps": [40]}, {"steps": [-1]}, {"shift": [41]}])
def test_windows_beyond_the_samples_are_refused(change: dict[str, list[int]]) -> None:
    windows = Windows(np.zeros((80, 1)), np.arange(40.0), *np.zeros((4, 1), np.int64))
    wrong = windows._replace(**{name: np.array(value) for name, value in change.items()})
    one = np.ones((1, 1, 1))
    assert free_run(made(u - x), windows, one, one[0], one, HOW).shape == (1, 1, 1, 1)
    with pytest.raises(ValueError, match="must lie within 40 samples"):
        free_run(made(u - x), wrong, one, one[0], one, HOW)


def test_sizes_are_checked() -> None:
    windows = Windows(np.zeros((40, 1)), np.arange(40.0), *np.zeros((4, 1), np.int64))
    one = np.ones((1, 1, 1))
    for name, arrays in {"x0": (one, one[0], one[:, :, :0]), "p": (one[:, :0], one[0], one)}.items():
        with pytest.raises(ValueError, match=f"{name} must have the shape"):
            free_run(made(u - x), windows, *arrays, HOW)


SYSTEM = motor()


def value(expression: sp.Expr, at: float, other: float = 0.0) -> float:
    """`expression` of theta and omega."""
    return float(values_of(SYSTEM, [expression], [at, other, 0.0], [0.0], [1.0], e=[0.0])[0])


@pytest.mark.parametrize(
    ("expression", "at", "expected"),
    [
        (f.sgn(theta), -2.0, -1.0),
        (f.step(theta), 0.0, 0.5),
        (f.whole(theta), -1.5, -2.0),
        (f.greater(theta, 1), 1.0, 0.0),
        (f.at_least(theta, 1), 1.0, 1.0),
        (f.equal(theta, 1), 1.0, 1.0),
        (f.absolute(theta), -3.0, 3.0),
        (f.minimum(theta, 1), 3.0, 1.0),
        (f.maximum(theta, 1), 3.0, 3.0),
        (f.select(f.greater(theta, 0), 5, 1 / theta), -2.0, -0.5),
        (f.select(f.greater(theta, 0), sp.log(theta), 7), 0.0, 7.0),
        (f.lookup(0, theta, 0), 1.5, 2.25),
        (f.lookup(0, theta, 0), 9.0, 9.0),
        (f.lookup(0, theta, 1), 1.5, 3.0),
        (f.lookup(0, theta, 1), 9.0, 0.0),
        (sp.atan2(theta, 1), 1.0, np.pi / 4),
    ],
)
def test_functions(expression: sp.Expr, at: float, expected: float) -> None:
    assert value(expression, at) == pytest.approx(expected)


def test_leading_axes_broadcast() -> None:
    generator = np.random.default_rng(0)
    t, x, u = generator.random(5), generator.random((4, 5, 3)), generator.random((5, 1))
    e, c = generator.random((4, 1, 1)), generator.random((4, 1, 1))
    found = values_of(SYSTEM, [theta * m + TIME, k * V - F, sp.Integer(2)], x, u, c, e=e, t=t)
    assert found.shape == (4, 5, 3)
    np.testing.assert_allclose(found[..., 0], x[..., 0] * c[..., 0] + t)
    np.testing.assert_allclose(found[..., 1], 0.3 * u[..., 0] - e[..., 0])
    np.testing.assert_array_equal(found[..., 2], 2.0)


def test_efforts_can_be_left_out() -> None:
    rates = values_of(SYSTEM, SYSTEM.closed, [0.1, 2.0, 3.0], [6.0], [0.5])
    np.testing.assert_allclose(rates, [2.0, 0.9 / 0.52, (6.0 - 6.0 - 0.6) / 0.05])


def test_no_value_is_not_an_error() -> None:
    assert np.isinf(value(1 / theta, 0.0))
    assert np.isnan(value(sp.log(omega), 1.0, -1.0))
