"""Physics-inspired features on a slower clock, and the minimal contact force of every experiment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.evaluation.labels import mean_extreme
from pipeline.numerics.resample import resample
from pipeline.physics.kernels import numpy_function
from pipeline.physics.mechanisms import cam_follower as physics
from pipeline.physics.mechanisms.cam import TURN
from pipeline.physics.mechanisms.cam_follower import CamFollower
from pipeline.progress import track
from pipeline.trajectory import Campaign

Array = NDArray[np.float64]

#: Angles per turn of the tabulated pitch curve; linear interpolation is then exact to 1e-6 of the stroke.
TABLE = 7200


def featurize(trajectories: Path, mechanism: CamFollower, period: float, out: Path) -> None:
    """Write the resampled campaign with features, and per experiment `f_min` and `f_bar_min`.

    Signals: t, theta, omega, alpha, eps, and from the pitch curve at the measured angle h (m), dh (m/rad),
    d2h (m/rad^2), h_dot (m/s), h_ddot (m/s^2), F_dagger (N). The forces per experiment, N, are taken at the
    logged rate: `f_min` is eq. 6.11, `f_bar_min` the mean of the minima of the full revolutions (5.3).

    Args:
        trajectories: store written by ingest.
        mechanism: constants of the bench.
        period: of the new clock, s.
        out: folder, replaced as a whole.

    Raises:
        BadInput: when the store is missing or damaged.
    """
    campaign = Campaign.read(trajectories)
    symbols = (physics.omega, physics.alpha, physics.dh, physics.d2h, physics.m)
    function = numpy_function(physics.INTERFACE_FORCE, (*symbols, *physics.CONSTANTS))
    curves: dict[tuple[float, float], Array] = {}
    parts: list[dict[str, Array]] = []
    forces: list[tuple[float, float]] = []
    rows = campaign.experiments.itertuples()
    for row, log in track(zip(rows, campaign, strict=True), len(campaign), "features"):
        pair = (float(row.H), float(row.beta))  # type: ignore[arg-type]
        if pair not in curves:
            curves[pair] = mechanism.cam(*pair).pitch_curve(TABLE)

        def force(theta: Array, omega: Array, alpha: Array, curve: Array = curves[pair], m: float = row.m) -> Array:  # type: ignore[assignment]
            _, dh, d2h = on_cam(curve, theta)
            return np.asarray(function(omega, alpha, dh, d2h, m, *mechanism.constants), np.float64)

        raw = force(log["theta"], log["omega"], log["alpha"])
        forces.append((float(raw.min()), mean_extreme(log["theta"], raw, largest=False)))
        t, (theta, omega, alpha, eps) = resample(
            log["t"], np.stack([log[k] for k in ("theta", "omega", "alpha", "eps")]), period
        )
        h, dh, d2h = on_cam(curves[pair], theta)
        part = {"t": t - t[0], "theta": theta, "omega": omega, "alpha": alpha, "eps": eps}
        part |= {"h": h, "dh": dh, "d2h": d2h, "h_dot": dh * omega, "h_ddot": d2h * omega**2 + dh * alpha}
        parts.append({**part, "F_dagger": force(theta, omega, alpha)})
    signals = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    offsets = np.concatenate([[0], np.cumsum([len(p["t"]) for p in parts])]).astype(np.int64)
    table = pd.concat(
        [campaign.experiments.drop(columns="samples"), pd.DataFrame(forces, columns=["f_min", "f_bar_min"])], axis=1
    )
    Campaign(table, signals, offsets, campaign.provenance).write(out)


def on_cam(curve: Array, theta: Array) -> Array:
    """(3, n) displacement and its derivatives at the angles `theta` (n,), from a table over one turn."""
    grid = np.arange(curve.shape[1]) * TURN / curve.shape[1]
    return np.stack([np.interp(theta, grid, row, period=TURN) for row in curve])
