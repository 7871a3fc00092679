"""Identify the parameters of the bounce simulation from training runs."""

from dataclasses import asdict

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from pipeline.cam_follower.bounce import BounceParameters, CamMotion, check_finite
from pipeline.cam_follower.bounce_kernel import Stretches
from pipeline.cam_follower.cam_follower import CamFollower
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput

#: Length of a stretch, s: one or two impacts. Over more of them a small error of the first decides the rest.
STRETCH = 0.1
#: A stretch counts when the follower is further than this from the cam, m; others say nothing of impacts.
AWAY = 3e-4
#: An error beyond this, m, weighs linearly, not quadratically: it belongs to an impact that went astray.
ASTRAY = 3e-4
#: Lowest value, start and highest value of every parameter.
LOWEST = BounceParameters(0.05, 5e-7, 1e-4, 1e-2, 0.1)
START = BounceParameters(0.7, 5e-6, 2e-2, 0.5, 12.0)
HIGHEST = BounceParameters(1.0, 1e-3, 1.0, 20.0, 100.0)


def fit_bounce(campaign: Campaign, rows: Indices, mechanism: CamFollower) -> BounceParameters:
    """Identify the parameters of the bounce simulation by least squares on training runs.

    The runs are cut into short stretches that start from the measured height and speed of the follower
    (multiple shooting). SciPy's trust-region method minimises the errors of all stretches together.

    Takes rows (runs,).
    """
    cams = CamMotion.of(campaign, mechanism, rows)
    eps = [np.asarray(campaign.signals["eps"][campaign.offsets[i] : campaign.offsets[i + 1]]) for i in rows]
    for i, values in zip(rows, eps, strict=True):
        check_finite(campaign.experiments["exp"].iloc[i], "eps", values)
    stretches, samples = _stretches(cams, eps)
    if not len(stretches.run):
        raise BadInput(f"bounce: the follower never leaves the cam in the {len(rows)} training runs")
    target = np.concatenate(eps)[samples]

    def error(logarithms: Array) -> Array:
        return np.asarray((cams.simulate(_parameters(logarithms), stretches).eps - target) / ASTRAY)

    lowest, start, highest = (np.log([*asdict(p).values()]) for p in (LOWEST, START, HIGHEST))
    best = least_squares(error, start, bounds=(lowest, highest), loss="soft_l1", diff_step=1e-3)
    return _parameters(best.x)


def _parameters(logarithms: Array) -> BounceParameters:
    e, *others = np.exp(logarithms)
    # a difference quotient may step over the bound by a rounding error
    return BounceParameters(min(float(e), 1.0), *map(float, others))


def _stretches(cams: CamMotion, eps: list[Array]) -> tuple[Stretches, Indices]:
    """Stretches in which the follower leaves the cam, and which of the runs' samples they contain."""
    steps = max(1, round(STRETCH / cams.period))
    run, sample, height, speed = [], [], [], []
    for r, gap in enumerate(eps):
        starts = [k for k in range(1, len(gap) - steps, steps) if np.abs(gap[k : k + steps + 1]).max() > AWAY]
        if not starts:
            continue
        path, times = _path(cams, r, gap), np.array(starts) * cams.period
        run += [r] * len(starts)
        sample += [cams.offsets[r] + k for k in starts]
        height += list(path(times))
        speed += list(path(times, 1))
    begin, owner = np.array(sample, np.int64), np.array(run, np.int64)
    out = np.arange(len(owner)) * (steps + 1)
    lengths = np.full(len(owner), steps)
    stretches = Stretches(owner, begin - owner, lengths, np.array(height), np.array(speed), out)
    return stretches, (begin[:, None] + np.arange(steps + 1)).ravel()


def _path(cams: CamMotion, run: int, gap: Array) -> CubicSpline:
    """Measured height of the follower over time since the start, from all samples but the last."""
    pieces = np.arange(cams.offsets[run], cams.offsets[run + 1] - 1) - run
    h, _ = cams.cam_at(np.full(len(pieces), run), pieces)
    return CubicSpline(np.arange(len(pieces)) * cams.period, h + gap[:-1])
