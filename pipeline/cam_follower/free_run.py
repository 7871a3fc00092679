"""Identify the motor drivetrain by free runs."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import torch
from scipy.optimize import least_squares

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.conditions import Bench, CamTable
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.kernels import numpy_function
from pipeline.cam_follower.motor import Motor
from pipeline.cam_follower.rollout import residual
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.progress import track
from unmodelled.base.workers import threads_of

#: J (kg m^2), k_V (N m/V), k_omega (N m s/rad), T_c, T_s (N m), omega_s (rad/s): a decade around a motor of
#: some tens of watts behind a gear, found without looking at any log.
LOWER = np.array([5e-4, 0.03, 0.01, 0.0, -0.5, 2.0])
UPPER = np.array([5e-2, 3.0, 1.0, 3.0, 1.0, 10.0])


@dataclass(frozen=True)
class Problem:
    """Residuals of free runs over training experiments."""

    arguments: tuple[Any, ...]  # of the kernel, after the parameters
    weight: Array  # (runs, samples), square root of the share of every sample in the angle of its run
    shape: tuple[int, int]  # of the residual, (runs, samples)
    #: Root mean square error of a run, rad/s, above which its weight falls, as after a false stall
    tolerance: float

    def residual(self, x: Array) -> Array:
        """Return the residual (runs * samples,), rad/s, robust against runs with large errors, at x (6,)."""
        out = np.zeros(self.shape)
        residual(physical(x), *(*self.arguments, out))
        out *= self.weight
        square = (out**2).sum(1, keepdims=True) / self.tolerance**2
        # a run's squared error s counts as log(1 + s); below 1e-8 the two are the same number
        small = square < 1e-8
        out *= np.sqrt(np.where(small, 1.0, np.log1p(square) / np.where(small, 1.0, square)))
        return out.ravel()


def physical(x: Array) -> Array:
    """Scale x (6,) from the unit cube: logarithmic if both bounds are positive, otherwise linear."""
    positive = LOWER > 0
    log = np.exp(
        np.log(np.where(positive, LOWER, 1.0)) * (1 - x) + np.log(np.where(positive, UPPER, 1.0)) * x
    )
    return np.where(positive, log, LOWER + (UPPER - LOWER) * x)


def problem(dataset: Dataset, runs: Indices, seconds: float, substeps: int, tolerance: float) -> Problem:
    """Prepare the identification of a motor from measured experiments. Takes runs (runs,), seconds in s."""
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
    """Identify the parameters (6,) by least squares from the best of many starts.

    A start that stalls every run has no gradient, and the screening of the starts excludes it. Random starts
    alone may end in a local minimum; the start from `regress` makes the identification reliable.
    """
    cube = np.vstack([np.clip(unit(first), 0.02, 0.98), generator.random((starts, len(LOWER)))])
    start = min(cube, key=lambda x: float((problem.residual(x) ** 2).sum()))
    solution = least_squares(
        problem.residual, start, bounds=(0.0, 1.0), diff_step=1e-4, x_scale="jac", ftol=1e-5, max_nfev=40
    )
    return physical(solution.x)


def regress(dataset: Dataset, runs: Indices) -> Array:
    """Estimate first parameters (6,) by inverse dynamics: linear regression, with omega_s on a grid.

    The equation is solved for the voltage, which is free of noise.
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
    """Generate the torque (samples,) that the known part of the drivetrain takes at an acceleration."""
    free = {physics.J: 0, physics.T_d: 0, physics.k_V: 0, physics.k_omega: 0, physics.T_c: 0, physics.T_s: 0}
    numerator, inertia = physics.MOTOR_ACCELERATION.subs(free).as_numer_denom()
    arguments = (physics.theta, physics.omega, physics.alpha, physics.dh, physics.d2h, physics.m)
    return numpy_function(
        inertia * physics.alpha - numerator, (*arguments, *physics.CAM_CONSTANTS, *physics.CONSTANTS)
    )


def unit(parameters: Array) -> Array:
    """Convert parameters to the unit cube: the inverse of `physical`. Takes parameters (6,); gives (6,)."""
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
        build: constructor of the stack of models.
        dataset: measured trajectories.
        folds: training experiments of each model of the stack, each of shape (experiments,).
        seed: seed of the starts and of the choice of experiments.
        starts: number of random starts; default 32.
        most_runs: largest number of training experiments of one model, chosen at random; default 80.
        seconds: duration after which every experiment is cut off, s; default 3.
        substeps: number of RK4 steps per sampling period; default 2.
        tolerance: root mean square error of a run, rad/s, above which its weight falls; default 0.15.
        workers: number of models that are identified side by side, on one core each; the result does not
            depend on this number; default 2.

    Returns:
        The identified stack.
    """
    model = build(dataset.bench, len(folds))

    def identified(b: int) -> Array:
        generator = np.random.default_rng([seed, b])
        runs = np.sort(generator.permutation(folds[b])[:most_runs])
        task = problem(dataset, runs, seconds, substeps, tolerance)
        return identify(task, regress(dataset, runs), generator, starts)

    known_effort()  # made once, before threads ask for it
    with threads_of(workers) as pool:
        found = track(pool.map(identified, range(len(folds))), len(folds), "identifying motors")
        model.parameters_.data[:] = torch.as_tensor(np.stack(list(found)))
    return model
