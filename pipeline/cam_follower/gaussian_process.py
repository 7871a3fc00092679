"""Gaussian process for the acceleration (section 2.5.3): fitted by scikit-learn, simulated as a stack."""

import warnings
from collections.abc import Callable

import numpy as np
import torch
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Kernel, WhiteKernel
from threadpoolctl import threadpool_limits
from torch import Generator, Tensor, nn

from pipeline.cam_follower.conditions import Bench, Conditions
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.dynamics import Dynamics, raw_inputs
from pipeline.cam_follower.sampler import Sampler, input_scale
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.progress import track

#: Inputs of f_BB.
INPUTS = 7
#: Bounds of length scales (standard deviations of an input), and of the variance of noise (of the targets).
LENGTHS, NOISE = (1e-2, 1e3), (1e-4, 1.0)
KERNEL = ConstantKernel(1.0) * RBF(np.ones(INPUTS), LENGTHS) + WhiteKernel(1e-2, NOISE)


class GaussianProcess(Dynamics):
    """A stack of Gaussian processes over the inputs of f_BB, with a squared exponential kernel.

    Only the mean of the prediction is simulated.

    Args:
        bench: mechanism and cams.
        batch: number of models.
        points: number of training samples that a model keeps.

    Attributes:
        scale: length scale of every input, shape (batch, 1, 7).
        at: kept samples over their length scales, shape (batch, points, 7).
        weights: weight of every kept sample, rad/s^2, shape (batch, points, 1).
        mean: mean acceleration, rad/s^2, shape (batch, 1).
    """

    def __init__(self, bench: Bench, batch: int, points: int) -> None:
        super().__init__(bench, batch, "theoretical")
        self.points = points
        self.scale, self.at = _numbers(batch, 1, INPUTS), _numbers(batch, points, INPUTS)
        self.weights, self.mean = _numbers(batch, points, 1), _numbers(batch, 1)

    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        # large weights of both signs cancel: single precision would lose the sum
        near = torch.cdist(raw_inputs(theta, omega, q).double() / self.scale, self.at)
        kernel = near.square_().mul_(-0.5).exp_()
        return ((kernel @ self.weights)[..., 0] + self.mean).to(theta.dtype)


def _numbers(*shape: int) -> nn.Parameter:
    return nn.Parameter(torch.ones(shape, dtype=torch.float64), requires_grad=False)


def fit(
    build: Callable[[Bench, int], GaussianProcess],
    dataset: Dataset,
    folds: list[Indices],
    seed: int,
    tuned_points: int,
) -> GaussianProcess:
    """Fit a Gaussian process to the accelerations of eq. 6.16 at random samples.

    Length scales and noise maximise the marginal likelihood of `tuned_points` samples, once per training set;
    models with the same training set differ in the samples that they keep.

    Args:
        build: constructor of the stack of models.
        dataset: measured trajectories.
        folds: training experiments of each model of the stack, each of shape (experiments,).
        seed: seed of the samples.
        tuned_points: number of samples from which the numbers of the kernel are found.

    Returns:
        The fitted stack.
    """
    model = build(dataset.bench, len(folds))
    generator = Generator().manual_seed(seed)
    spread = input_scale(
        raw_inputs(dataset.theta, dataset.omega, dataset.conditions[dataset.owner()]), dataset, folds
    )
    kernels: dict[bytes, Kernel] = {}
    for k, fold in enumerate(track(folds, len(folds), f"fitting {len(folds)} Gaussian processes")):
        sampler, known = Sampler(dataset, [fold], generator), fold.tobytes()
        if known not in kernels:
            inputs, targets = _samples(dataset, sampler, spread[k], tuned_points)
            kernels[known] = _process(inputs, _standard(targets)[0], KERNEL, "fmin_l_bfgs_b").kernel_
        inputs, targets = _samples(dataset, sampler, spread[k], model.points)
        values, mean, size = _standard(targets)
        found = _process(inputs, values, kernels[known], None)
        lengths, weights = (
            found.kernel_.k1.k2.length_scale,
            size * found.kernel_.k1.k1.constant_value * found.alpha_,
        )
        model.scale.data[k] = spread[k] * torch.tensor(lengths)
        model.at.data[k] = torch.tensor(inputs / lengths)
        model.weights.data[k, :, 0] = torch.tensor(weights)
        model.mean.data[k] = mean
    return model


def _samples(dataset: Dataset, sampler: Sampler, spread: Tensor, points: int) -> tuple[Array, Array]:
    """Inputs over their standard deviations, and accelerations, rad/s^2, at random samples."""
    runs, now = (drawn[0] for drawn in sampler.draw(points))
    inputs = raw_inputs(dataset.theta[now], dataset.omega[now], dataset.conditions[runs]) / spread
    targets = (dataset.omega[now + 1] - dataset.omega[now]) / dataset.period
    return inputs.double().numpy(), targets.double().numpy()


def _standard(targets: Array) -> tuple[Array, float, float]:
    mean, size = float(targets.mean()), float(targets.std())
    return (targets - mean) / size, mean, size


def _process(inputs: Array, values: Array, kernel: Kernel, optimizer: str | None) -> GaussianProcessRegressor:
    with threadpool_limits(1), warnings.catch_warnings():
        # a setting that never changes in training has any length
        warnings.simplefilter("ignore", ConvergenceWarning)
        return GaussianProcessRegressor(kernel, optimizer=optimizer).fit(inputs, values)
