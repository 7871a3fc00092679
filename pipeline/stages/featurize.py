"""Compute the features of every experiment on a slower clock, and its minimal contact force."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.kernels import numpy_function
from pipeline.cam_follower.labels import mean_extreme
from pipeline.recordings.resample import resample
from unmodelled.base.arrays import Array
from unmodelled.base.campaign import Campaign
from unmodelled.base.ownership import verb
from unmodelled.base.progress import track

#: What to do with the result (`unmodelled.cli.written`).
NEXT = "next: {program} train model=f_h2 split=extrapolation model.features={out}"


#: Angles per turn of the tabulated pitch curve; linear interpolation is then exact to 1e-6 of the stroke.
TABLE = 7200
RESAMPLED = ("theta", "omega", "alpha", "eps")


@verb()
def featurize(trajectories: Path, mechanism: CamFollower, period: float, out: Path) -> None:
    """Write the resampled campaign with features, and per experiment `f_min` and `f_bar_min`.

    Signals: t, theta, omega, alpha, eps, and from the pitch curve at the measured angle h (m), dh (m/rad),
    d2h (m/rad^2), h_dot (m/s), h_ddot (m/s^2), F_dagger (N). The forces per experiment, N, are taken at the
    logged rate: `f_min` is eq. 6.11, `f_bar_min` the mean of the minima of the full revolutions (5.3).

    Args:
        trajectories: store written by ingest.
        mechanism: constants of the bench.
        period: sampling period of the new clock, s.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the store is missing or damaged.
    """
    campaign = Campaign.read(trajectories)
    curves: dict[tuple[float, float], Array] = {}
    parts: list[dict[str, Array]] = []
    forces: list[tuple[float, float]] = []
    settings = campaign.experiments[["H", "beta", "m"]].itertuples(index=False)
    for (H, beta, m), log in track(zip(settings, campaign, strict=True), len(campaign), "features"):
        if (H, beta) not in curves:
            curves[H, beta] = mechanism.cam(H, beta).pitch_curve(TABLE)
        curve = curves[H, beta]
        raw = _features(log, curve, m, mechanism)["F_dagger"]
        forces.append((float(raw.min()), mean_extreme(log["theta"], raw, largest=False)))
        t, slow = resample(log["t"], np.stack([log[k] for k in RESAMPLED]), period)
        signals = dict(zip(RESAMPLED, slow, strict=True))
        parts.append({"t": t - t[0], **signals, **_features(signals, curve, m, mechanism)})
    joined = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    offsets = np.concatenate([[0], np.cumsum([len(p["t"]) for p in parts])]).astype(np.int64)
    minima = pd.DataFrame(forces, columns=["f_min", "f_bar_min"])
    table = pd.concat([campaign.experiments.drop(columns="samples"), minima], axis=1)
    Campaign(table, joined, offsets, campaign.provenance).write(out)


def _features(log: Mapping[str, Array], curve: Array, m: float, mechanism: CamFollower) -> dict[str, Array]:
    """Features at every sample of a log, from its theta, omega and alpha."""
    omega, alpha = log["omega"], log["alpha"]
    h, dh, d2h = on_cam(curve, log["theta"])
    force = interface_force()(omega, alpha, dh, d2h, m, *mechanism.constants)
    linear = {"h_dot": dh * omega, "h_ddot": d2h * omega**2 + dh * alpha}
    return {"h": h, "dh": dh, "d2h": d2h, **linear, "F_dagger": force}


@cache
def interface_force() -> Callable[..., Array]:
    """Generate the function for F-dagger of eq. 6.4, N.

    Returns:
        Function from omega, alpha, dh, d2h, m and the constants to the force, N; all arguments are scalars or
        arrays of the same shape.
    """
    symbols = (physics.omega, physics.alpha, physics.dh, physics.d2h, physics.m)
    return numpy_function(physics.INTERFACE_FORCE, (*symbols, *physics.CONSTANTS))


def on_cam(curve: Array, theta: Array) -> Array:
    """Interpolate displacement and derivatives of a cam at given angles.

    Args:
        curve: displacement (m), first (m/rad) and second derivative (m/rad^2) over one turn, shape (3, N).
        theta: angles, rad, shape (n,).

    Returns:
        Displacement and derivatives, shape (3, n).
    """
    grid = np.arange(curve.shape[1]) * TURN / curve.shape[1]
    return np.stack([np.interp(theta, grid, row, period=TURN) for row in curve])
