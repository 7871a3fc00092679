"""Resampling of logged signals to a slower uniform clock."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array


def resample(t: Array, signals: Array, period: float, cutoff_share: float = 0.8) -> tuple[Array, Array]:
    """Resample signals (signals, samples) to a uniform clock after a zero-phase anti-alias filter.

    The logger's clock jitters, so the samples are first put on their own median period. The filter is a
    fourth-order Butterworth run forwards and backwards; its cut-off is `cutoff_share` times the new
    Nyquist frequency.
    """
    from scipy.signal import butter, sosfiltfilt  # half a second to load, for whatever reads logs

    old = float(np.median(np.diff(t)))
    if period <= old:
        raise ValueError(f"period must be longer than the logged {old:.6g} s, got {period:.6g} s")
    clock = np.arange(t[0], t[-1] + 0.5 * old, old)
    uniform = np.stack([np.interp(clock, t, x) for x in signals])
    sos = butter(4, cutoff_share * 0.5 / period, fs=1.0 / old, output="sos")
    # ten time constants of the filter, so that the ends see no transient
    padding = min(len(clock) - 1, round(period / old) * 5)
    smooth = sosfiltfilt(sos, uniform, axis=1, padlen=padding)
    new = np.arange(t[0], t[-1], period)
    return new, np.stack([np.interp(new, clock, x) for x in smooth])
