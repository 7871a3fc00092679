"""Residuals of a fit from its fitted starts: their size, and how many samples of them are independent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.effects.effect import USUAL_PERIODS

#: Autocorrelation from which samples count as independent, the usual end of such sums (Geyer 1992).
INDEPENDENT = 0.05
#: Samples per independent one up to which what no law explains is noise: white noise behind a lag that is
#: usual in a logger.
WHITE = 1.0 / np.tanh(0.5 / USUAL_PERIODS)
#: Squared residual of a simulation that diverged, in squares of the sensor noise, which can be tiny.
DIVERGED = 1e18


@dataclass(frozen=True)
class Residual:
    """Residual of a fit, by output."""

    square: Array  # mean squared residual, in squares of the sensor noise, (outputs,)
    tau: Array  # samples per independent one, (outputs,)
    diverged: int  # samples that are lost: without a value, or further off than any error that counts

    @property
    def white(self) -> bool:
        """Return whether it is noise."""
        return bool(np.all(self.tau < WHITE))

    @classmethod
    def of(cls, fitted: FittedHypothesis) -> Residual:
        """Return the residual of a fit; a simulation that diverged leaves more than any other."""
        e, recording = fitted.errors[0], fitted.recording
        square = np.nan_to_num(np.minimum(e**2, DIVERGED), nan=DIVERGED)
        counted = np.broadcast_to(recording.counted[..., None], e.shape)
        beyond = recording.left_out(np.zeros((1, e.shape[2]), np.int64))
        counted = counted if beyond is None else counted & ~beyond[:, 0]
        every = range(e.shape[2])
        mean = np.array([square[..., j][counted[..., j]].mean() for j in every])
        use = counted & np.isfinite(e)
        tau = [correlation_time(np.nan_to_num(e[..., j]), use[..., j]) for j in every]
        lost = counted & ~(np.abs(e) < LARGEST_ERROR * recording.scale / recording.noise)
        return cls(mean, np.array(tau), int(lost.sum()))


def correlation_time(r: Array, use: Mask) -> float:
    """Return the samples per independent one of residuals (windows, samples), at least 1 (Bartlett 1946).

    The autocorrelation over all windows is summed up to the first lag at which it is small.
    """
    count = np.maximum(use.sum(axis=1, keepdims=True), 1)
    x = np.where(use, r - np.where(use, r, 0.0).sum(axis=1, keepdims=True) / count, 0.0)
    n = x.shape[1]
    power = (np.abs(np.fft.rfft(x, 2 * n, axis=1)) ** 2).sum(axis=0)
    pairs = (np.abs(np.fft.rfft(use.astype(float), 2 * n, axis=1)) ** 2).sum(axis=0)
    rho = np.fft.irfft(power)[:n] / np.maximum(np.fft.irfft(pairs)[:n], 1.0)
    rho = rho / max(float(rho[0]), 1e-300)
    small = np.flatnonzero(rho < INDEPENDENT)
    end = int(small[0]) if len(small) else n
    return float(max(1.0, 1.0 + 2.0 * rho[1:end].sum()))
