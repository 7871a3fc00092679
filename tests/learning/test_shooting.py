"""Multiple shooting: exact gradients, a plant recovered through noise, the same result when killed."""

from dataclasses import replace
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.machines.known import built_in, runge_kutta
from tests.physics.kernel.problems import one_run
from unmodelled import BadInput, System, one_per_port
from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.on_device import train_on
from unmodelled.learning.resume import identity, load_progress, save_progress
from unmodelled.learning.rollout import Measured, simulate
from unmodelled.learning.shooting import Objective, Segments, Shooting
from unmodelled.learning.windows import Problem, Progress, Training, Windows, finished

PERIOD, SAMPLES, RUNS = 0.01, 251, 4
TRUTH = {"J": 0.02, "b": 0.01, "mgl": 1.2}
NOISE = np.array([0.01, 0.3])
SHOOTING = Shooting(25, 30, Windows(1, 3, rate=0.01, physics_rate=0.01), stages=3)


def motion(x: np.ndarray, torque: np.ndarray) -> np.ndarray:
    effort = torque - TRUTH["b"] * x[1] - TRUTH["mgl"] * np.sin(x[0]) - 0.06 * np.tanh(x[1] / 0.3)
    return np.array([x[1], effort / TRUTH["J"]])


def swing(k: int) -> tuple[np.ndarray, np.ndarray]:
    """States and torques of one run without noise."""
    t = np.arange(SAMPLES) * PERIOD
    u = 0.6 * np.sin((2.0 + k) * t + k) + 0.4 * np.sin((7.0 - k) * t)

    def rates(now: float, x: np.ndarray) -> np.ndarray:
        return motion(x, np.interp(now, t, u))

    return runge_kutta(rates, np.array([-0.6 + 0.4 * k, 0.0]), t), u


@cache
def system() -> System:
    """The pendulum, its inertia and damping wrong."""
    return built_in("pendulum").with_values({"J": 0.026, "b": 0.02})


@cache
def data() -> Measured:
    rng = np.random.default_rng(0)
    runs = [swing(k) for k in range(RUNS)]
    x = np.concatenate([x for x, _ in runs])
    return Measured(
        x=x + NOISE * rng.standard_normal(x.shape),
        u=np.concatenate([u for _, u in runs])[:, None],
        t=np.tile(np.arange(SAMPLES) * PERIOD, RUNS),
        c=np.empty((RUNS, 0)),
        owner=np.repeat(np.arange(RUNS), SAMPLES),
        offsets=np.arange(RUNS + 1) * SAMPLES,
    )


def problem_of(training: Training, members: int = 1) -> Problem:
    networks = one_per_port(hidden=8, inputs=["omega"])
    recipe = AugmentedRecipe(networks, training, identify=("J",), method="rk4", hold=1.0)
    runs = [np.delete(np.arange(RUNS), m) if members > 1 else np.arange(RUNS) for m in range(members)]
    return recipe.problem(system(), data(), PERIOD, runs, 0)


def start(problem: Problem) -> list[Progress]:
    return [Progress.start(problem.model, m) for m in range(problem.model.batch)]


def trained(training: Training, problem: Problem) -> list[Progress]:
    stack = start(problem)
    done = list(training.train(problem, stack))
    assert done == sorted(done)
    assert done[-1] == training.epochs * len(stack)
    return stack


def assert_equal(stack: list[Progress], other: list[Progress]) -> None:
    for a, b in zip(stack, other, strict=True):
        for name in ("p", "xi", "weights", "nodes", "losses", "history"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name), name)


@pytest.mark.parametrize("steps", [1, 7, 25, 100, 249, 250])
def test_segments_cover_every_experiment_and_stay_within(steps: int) -> None:
    cut = Segments.of(data(), np.array([1, 3]), steps)
    reached = cut.starts[:, None] + np.arange(steps + 1)
    assert set(reached.ravel()) == {i for i, owner in enumerate(data().owner) if owner in (1, 3)}
    assert np.all(data().owner[reached[:, 0]] == data().owner[reached[:, -1]])
    assert np.all(cut.starts[cut.joined] + cut.after == cut.starts[cut.joined + 1])
    assert len(cut.joined) == len(cut.starts) - 2
    assert np.all((cut.after > 0) & (cut.after <= steps))


def test_gradients_equal_finite_differences() -> None:
    """By weights, parameters and first states; 30 does not divide 250, so that segments overlap."""
    problem = problem_of(SHOOTING)
    problem = replace(problem, penalties=np.array([0.5]))
    cut = Segments.of(data(), problem.runs[0], 30)
    objective = Objective(problem, 0, cut, price=3.0)
    state = start(problem)[0]
    state.nodes = data().x[cut.starts]
    rng = np.random.default_rng(1)
    z = objective.pack(state) + 0.01 * rng.standard_normal(len(objective.pack(state)))
    gradient = objective(z)[1]
    for part in np.split(np.arange(len(z)), [len(state.weights), len(state.weights) + len(state.xi)]):
        along = np.zeros_like(z)
        along[part] = rng.standard_normal(len(part))
        h = 1e-6
        slope = (objective(z + h * along)[0] - objective(z - h * along)[0]) / (2 * h)
        np.testing.assert_allclose(gradient @ along, slope, rtol=1e-4, atol=1e-10)


def test_a_gap_has_its_price() -> None:
    """A first state that is moved away from its trajectory costs at least the gap that it opens."""
    x, u = swing(0)
    data = replace(one_run(u[:, None], PERIOD), x=x)
    runs = [np.array([0])]
    recipe = AugmentedRecipe(one_per_port(hidden=8), SHOOTING, method="rk4", hold=1.0)
    exact = recipe.problem(system().with_values(TRUTH), data, PERIOD, runs, 0)
    cut = Segments.of(data, runs[0], 25)
    nodes = torch.from_numpy(data.x[cut.starts])
    # the network leaves no friction: what is left is the friction alone, and small over one segment
    with torch.no_grad():
        exact.model.weights.zero_()
        moved = nodes.clone()
        moved[3, 0] += 0.5
        losses = {
            (price, name): float(Objective(exact, 0, cut, price).loss(at))
            for price in (0.0, 2.0)
            for name, at in {"still": nodes, "moved": moved}.items()
        }
    C = float(Objective(exact, 0, cut, 1.0).C[0])
    added = (losses[2.0, "moved"] - losses[0.0, "moved"]) - (losses[2.0, "still"] - losses[0.0, "still"])
    assert losses[2.0, "still"] < 0.2
    assert added > 2.0 * C * 0.5**2 / len(cut.joined)


def test_the_inertia_is_recovered_through_noise_that_misleads_one_step_training() -> None:
    one_step = Windows(1, 60, rate=0.01, physics_rate=0.01)
    shooting = replace(SHOOTING, iterations=150, stages=5)
    error = {}
    for training in (one_step, shooting):
        state = trained(training, problem_of(training))[0]
        error[type(training)] = abs(state.p[0] / TRUTH["J"] - 1.0)
    assert error[Shooting] < 0.02
    assert error[Windows] > 3.0 * error[Shooting]


def test_gaps_close_and_first_speeds_come_nearer_to_the_truth() -> None:
    shooting = replace(SHOOTING, iterations=150, stages=5)
    problem = problem_of(shooting)
    state = trained(shooting, problem)[0]
    cut = Segments.of(data(), problem.runs[0], 25)
    truth = np.concatenate([swing(k)[0] for k in range(RUNS)])[cut.starts]
    measured = data().x[cut.starts]
    # the angle's noise is small beside its change, so that eq. 4.9 hardly cares for it
    speeds = [np.sqrt(np.mean((x - truth)[:, 1] ** 2)) for x in (measured, state.nodes)]
    assert speeds[1] < 0.5 * speeds[0]
    model = finished(problem.model, [state])
    gaps = []
    for x0 in (measured, state.nodes):
        X, _ = simulate(model, 0, data(), x0, cut.starts, cut.steps, problem.how)
        gaps.append(np.sqrt(np.mean((X[cut.joined, cut.after] - x0[cut.joined + 1]) ** 2, axis=0)))
    assert np.all(gaps[1] < 0.1 * gaps[0])


@pytest.mark.parametrize("workers", [1, 2])
def test_the_same_seed_gives_the_same_result(workers: int) -> None:
    problem = problem_of(SHOOTING, members=3)
    stacks = [trained(replace(SHOOTING, workers=w), problem) for w in (2, workers)]
    assert_equal(*stacks)
    assert all(len(s.losses) == len(s.history) == len(s.seconds) == SHOOTING.epochs for s in stacks[0])


@pytest.mark.parametrize("kill", [1, 3, 5])
def test_a_killed_training_goes_on_to_the_same_result(kill: int, tmp_path: Path) -> None:
    problem = problem_of(SHOOTING, members=2)
    whole = trained(replace(SHOOTING, workers=1), problem)
    stack, path = start(problem), tmp_path / "checkpoint"
    name = identity(problem, replace(SHOOTING, workers=1))
    for _ in islice(replace(SHOOTING, workers=1).train(problem, stack), kill):
        save_progress(path, stack, name)
    assert name == identity(problem, SHOOTING)
    again = load_progress(path, name)
    assert again is not None
    for _ in SHOOTING.train(problem, again):
        pass
    assert_equal(again, whole)


@pytest.mark.parametrize(
    "change", [{"horizon": 20}, {"stages": 4}, {"last_price": 5.0}, {"warm_up": Windows(1, 4)}]
)
def test_other_settings_are_other_trainings(change: dict[str, object]) -> None:
    problem = problem_of(SHOOTING)
    assert identity(problem, replace(SHOOTING, **change)) != identity(problem, SHOOTING)  # type: ignore[arg-type]


@pytest.mark.parametrize("warm_up", [0, 3])
def test_a_diverging_member_leaves_the_others_alone(warm_up: int) -> None:
    shooting = replace(SHOOTING, warm_up=replace(SHOOTING.warm_up, epochs=warm_up))
    problem = problem_of(shooting, members=3)
    whole = trained(shooting, problem)
    stack = start(problem)
    stack[1].weights[:] = 1e300
    before = stack[1].weights.copy()
    done = list(shooting.train(problem, stack))
    assert done[-1] == 3 * shooting.epochs
    assert [s.diverged for s in stack] == [False, True, False]
    np.testing.assert_array_equal(stack[1].weights, before)
    assert_equal(stack[::2], whole[::2])


def test_parameters_keep_their_bounds() -> None:
    problem = problem_of(SHOOTING)
    problem = replace(problem, bounds=np.array([[0.024, 0.03]]))
    assert trained(SHOOTING, problem)[0].p[0] == pytest.approx(0.024)


def test_bad_requests_are_refused() -> None:
    problem = problem_of(SHOOTING)
    with pytest.raises(BadInput, match="no training experiment has more than 300 samples"):
        list(replace(SHOOTING, horizon=300).train(problem, start(problem)))
    with pytest.raises(BadInput, match="device cuda: this training runs on the cpu only"):
        train_on("cuda", problem, SHOOTING, start(problem))
