"""Identification of the motor drivetrain by free-run simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.conditions import Bench, CamTable
from pipeline.cam_follower.dataset import Dataset, Indices
from pipeline.cam_follower.kernels import numpy_function
from pipeline.cam_follower.motor import Motor
from pipeline.cam_follower.rollout import residual_kernel
from unmodelled.base.progress import track
from unmodelled.base.workers import threads_of

Array = NDArray[np.float64]

#: J (kg m^2), k_V (N m/V), k_omega (N m s/rad), T_c, T_s (N m), omega_s (rad/s): a decade around a motor of
#: some tens of watts behind a gear, found without looking at any log.
LOWER = np.array([5e-4, 0.03, 0.01, 0.0, -0.5, 2.0])
UPPER = np.array([5e-2, 3.0, 1.0, 3.0, 1.0, 10.0])


@dataclass(frozen=True)
class Problem:
    """Residuals of free-run simulations of some training runs.

    Attributes:
        arguments: what the kernel takes after the parameters.
        weight: (runs, samples) square root of each sample's share of its run's angle.
        shape: of the residual.
        tolerance: rad/s; a run whose error is larger, a false stall say, loses its pull.
    """

    arguments: tuple[object, ...]
    weight: Array
    shape: tuple[int, int]
    tolerance: float

    def residual(self, x: Array) -> Array:
        """Robust residual for parameters scaled to [0, 1] in their logarithm or range."""
        out = np.zeros(self.shape)
        residual_kernel()(physical(x), *self.arguments, out)
        out *= self.weight
        square = (out**2).sum(1, keepdims=True) / self.tolerance**2
        # a run's squared error s counts as log(1 + s); below 1e-8 the two are the same number
        small = square < 1e-8
        out *= np.sqrt(np.where(small, 1.0, np.log1p(square) / np.where(small, 1.0, square)))
        return out.ravel()


def physical(x: Array) -> Array:
    """Parameters from the unit cube: logarithmic where both bounds are positive, linear elsewhere."""
    positive = LOWER > 0
    log = np.exp(
        np.log(np.where(positive, LOWER, 1.0)) * (1 - x) + np.log(np.where(positive, UPPER, 1.0)) * x
    )
    return np.where(positive, log, LOWER + (UPPER - LOWER) * x)


def problem(dataset: Dataset, runs: Indices, seconds: float, substeps: int, tolerance: float) -> Problem:
    """The identification problem of the experiments `runs`, each cut after `seconds`."""
    longest = int(seconds / dataset.period)
    lengths = np.minimum(dataset.lengths.numpy()[runs], longest)
    shape = (len(runs), int(lengths.max()))
    theta, omega = np.zeros(shape), np.zeros(shape)
    for i, (run, n) in enumerate(zip(runs, lengths, strict=True)):
        a = int(dataset.offsets[run])
        # sensors jitter at standstill: the projection needs an angle that never falls
        theta[i, :n] = np.maximum.accumulate(dataset.theta[a : a + n].double().numpy())
        omega[i, :n] = dataset.omega[a : a + n].numpy()
    travel = np.where(np.arange(shape[1]) < lengths[:, None], np.maximum(omega, 0.0), 0.0)
    weight = np.sqrt(travel / np.maximum(travel.sum(1, keepdims=True), 1e-9))
    q = dataset.conditions[torch.as_tensor(runs)]
    own = torch.stack([q.J_c, q.S_x, q.S_y], 1).double().numpy()
    point = (q.V.double().numpy(), q.m.double().numpy(), q.cam.numpy(), own)
    bench = dataset.bench
    constants = np.array(bench.mechanism.constants)
    curves = bench.curves("pitch")
    arguments = (constants, curves, theta, omega, lengths, *point, dataset.period, substeps, 1.6)
    return Problem(arguments, weight, shape, tolerance)


def identify(problem: Problem, first: Array, generator: np.random.Generator, starts: int) -> Array:
    """Best parameters by least squares from the best of many starts.

    A start that stalls every run has no gradient; the screen passes over it. Random starts alone may end in
    a local minimum; the start from `regress` is what makes the identification reliable.

    Args:
        problem: what to fit.
        first: (6,) parameters that take part in the screen, see `regress`.
        generator: of the other starts. starts: their number.

    Returns:
        (6,) parameters in the order of `LOWER`.
    """
    cube = np.vstack([np.clip(unit(first), 0.02, 0.98), generator.random((starts, len(LOWER)))])
    start = min(cube, key=lambda x: float((problem.residual(x) ** 2).sum()))
    solution = least_squares(
        problem.residual, start, bounds=(0.0, 1.0), diff_step=1e-4, x_scale="jac", ftol=1e-5, max_nfev=40
    )
    return physical(solution.x)


def regress(dataset: Dataset, runs: Indices) -> Array:
    """First parameters by inverse dynamics, linear in all but omega_s, which is tried on a grid.

    The equation is solved for the voltage, the one quantity that carries no noise.

    Returns:
        (6,) parameters in the order of `LOWER`.
    """
    now = dataset.samples_of(runs)
    now = now[now + 1 < dataset.offsets[dataset.owner()[now] + 1]]
    q = dataset.conditions[dataset.owner()[now]]
    middle = 0.5 * (dataset.theta[now] + dataset.theta[now + 1])
    dh, d2h = CamTable(torch.tensor(dataset.bench.curves("pitch"), dtype=torch.float32))(q.cam, middle)
    omega = 0.5 * (dataset.omega[now] + dataset.omega[now + 1])
    alpha = (dataset.omega[now + 1] - dataset.omega[now]) / dataset.period
    data = [x.double().numpy() for x in (middle, omega, alpha, dh, d2h, q.m, q.J_c, q.S_x, q.S_y)]
    known = known_effort()(*data, *dataset.bench.mechanism.constants)
    speed, rest = data[1], data[2]
    sign, V = np.tanh(speed / physics.SHAFT_CREEP), q.V.double().numpy()
    fits = []
    for omega_s in np.linspace(3.0, 9.0, 4):
        columns = [rest, speed, sign, -sign * np.exp(-np.abs(speed) / omega_s), known]
        x, error, *_ = np.linalg.lstsq(np.column_stack(columns), V)
        fits.append((float(error.sum()), np.array([x[0], 1.0, *x[1:4], omega_s * x[4]]) / x[4]))
    best: Array = min(fits, key=lambda f: f[0])[1]
    return best


@cache
def known_effort() -> Callable[..., Array]:
    """Torque that the known part of the drivetrain takes at a given acceleration, N m."""
    free = {physics.J: 0, physics.T_d: 0, physics.k_V: 0, physics.k_omega: 0, physics.T_c: 0, physics.T_s: 0}
    numerator, inertia = physics.MOTOR_ACCELERATION.subs(free).as_numer_denom()
    arguments = (physics.theta, physics.omega, physics.alpha, physics.dh, physics.d2h, physics.m)
    return numpy_function(
        inertia * physics.alpha - numerator, (*arguments, *physics.CAM_CONSTANTS, *physics.CONSTANTS)
    )


def unit(parameters: Array) -> Array:
    """The inverse of `physical`."""
    positive = LOWER > 0
    low, high = np.where(positive, LOWER, 1.0), np.where(positive, UPPER, np.e)
    log = np.log(np.maximum(parameters, 1e-9) / low) / np.log(high / low)
    return np.where(positive, log, (parameters - LOWER) / (UPPER - LOWER))


def fit(
    build: Callable[[Bench, int], Motor],
    dataset: Dataset,
    folds: list[Indices],
    seed: int,
    starts: int = 32,
    most_runs: int = 80,
    seconds: float = 3.0,
    substeps: int = 2,
    tolerance: float = 0.15,
    workers: int = 2,
) -> Motor:
    """Identify the motor of every fold; each model of the stack has its own random starts.

    Args:
        build: constructor of the models.
        dataset: trajectories.
        folds: training experiments of each model of the stack.
        seed: of starts and of the choice of runs.
        starts: random points of the screen.
        most_runs: a model sees a random choice of at most so many of its training runs.
        seconds: every run is cut there. substeps: RK4 steps per sample.
        tolerance: rad/s, see `Problem`.
        workers: models identified side by side, on a core each; the result does not depend on it.
    """
    model = build(dataset.bench, len(folds))

    def identified(b: int) -> Array:
        generator = np.random.default_rng([seed, b])
        runs = np.sort(generator.permutation(folds[b])[:most_runs])
        task = problem(dataset, runs, seconds, substeps, tolerance)
        return identify(task, regress(dataset, runs), generator, starts)

    residual_kernel(), known_effort()  # made once, before threads ask for them
    with threads_of(workers) as pool:
        found = track(pool.map(identified, range(len(folds))), len(folds), "identifying motors")
        model.parameters_.data[:] = torch.as_tensor(np.stack(list(found)))
    return model
