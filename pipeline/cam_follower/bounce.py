"""Simulate the detachment of the follower from the measured motion of the cam, without a network."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.cam_follower.bounce_kernel import Law, Motion, Stretches, bounced, on_cams
from pipeline.cam_follower.cam_follower import CamFollower
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json

#: Angles per turn of the tabulated pitch curve.
TABLE = 7200
#: Longest integration step, s: about a quarter of a radian of the oscillation in contact.
STEP = 5e-4


@dataclass(frozen=True)
class BounceParameters:
    """Parameters of the bounce simulation that are identified; all are positive."""

    #: Coefficient of restitution e: speed after divided by speed before an impact on the cam, at most 1
    restitution: float
    contact_compliance: float  # compliance of the contact between roller and cam, m/N
    shaft_compliance: float  # torsional compliance between encoder and cam, rad/(N m)
    guide_coulomb: float  # Coulomb friction b_0 of the guide, N (eq. 5.3)
    guide_viscous: float  # viscous friction b_1 of the guide, N s/m (eq. 5.3)

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not (isinstance(value, float) and 0.0 < value < np.inf):
                raise BadInput(f"bounce parameters: {name} must be a positive number, got {value}")
        if self.restitution > 1.0:
            raise BadInput(f"bounce parameters: restitution must be at most 1, got {self.restitution}")

    def write(self, path: Path) -> None:
        """Write the parameters to a JSON file."""
        write_json(path, asdict(self))

    @classmethod
    def read(cls, path: Path) -> "BounceParameters":
        """Read parameters that `write` wrote."""
        content, names = read_json(path), [f.name for f in fields(cls)]
        if not isinstance(content, dict) or set(content) != set(names):
            raise BadInput(f"{path}: must hold {', '.join(names)}")
        try:
            return cls(**content)
        except BadInput as error:
            raise BadInput(f"{path}: {error}") from None


class Bounce(NamedTuple):
    """Result of a simulation."""

    eps: Array  # (samples,), detachment of the follower from the cam, m
    #: (samples,), share of the simulations of an ensemble in which the cam carries the follower, 0 to 1
    contact: Array


@dataclass(frozen=True)
class CamMotion:
    """Measured motion of the cams in several runs, continuous in time."""

    motion: Motion
    offsets: Indices  # (runs + 1,), first samples of the runs, and the number of all samples
    period: float  # s
    gravity: float  # m/s^2

    @classmethod
    def of(cls, campaign: Campaign, mechanism: CamFollower, rows: Indices | None = None) -> "CamMotion":
        """Interpolate the angle of the cam in measured runs by cubic splines.

        Only the given runs are read. With 100 Hz sampling, this predicts the detachment as well as with the
        measured 2 kHz.

        Takes rows (runs,).
        """
        rows = np.arange(len(campaign)) if rows is None else rows
        table = campaign.experiments.iloc[rows]
        _check_settings(table)
        runs = list(table["exp"])
        spans = [slice(*campaign.offsets[i : i + 2]) for i in rows]
        period = _period(runs, [campaign.signals["t"][span] for span in spans])
        pieces = []
        for run, span in zip(runs, spans, strict=True):
            theta = campaign.signals["theta"][span]
            check_finite(run, "theta", theta)
            pieces.append(CubicSpline(np.arange(len(theta)) * period, theta).c.T)
        shapes = list(zip(table["H"], table["beta"], strict=True))
        cams = {shape: k for k, shape in enumerate(dict.fromkeys(shapes))}
        motion = Motion(
            np.concatenate(pieces),
            np.stack([mechanism.cam(*shape).pitch_curve(TABLE)[:2] for shape in cams]),
            np.array([cams[shape] for shape in shapes]),
            table["m"].to_numpy(np.float64),
        )
        offsets = np.append(0, np.cumsum([span.stop - span.start for span in spans]))
        return cls(motion, offsets, period, mechanism.gravity)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def cam_at(self, run: Indices, piece: Indices) -> tuple[Array, Array]:
        """Return height and speed (n,) of the cam at the start of intervals, of run (n,) and piece (n,)."""
        *_, omega, theta = self.motion.pieces[piece].T
        h, dh = on_cams(self.motion.curves, self.motion.cam[run], theta).T
        return h, dh * omega

    def from_the_start(self) -> Stretches:
        """Return every run as one stretch that begins with the follower on the cam."""
        run = np.arange(len(self))
        piece = self.offsets[:-1] - run  # a run has one interval less than samples
        height, speed = self.cam_at(run, piece)
        return Stretches(run, piece, np.diff(self.offsets) - 1, height, speed, self.offsets[:-1])

    def simulate(self, parameters: BounceParameters, stretches: Stretches) -> Bounce:
        """Simulate the follower in all stretches.

        Args:
            parameters: identified parameters.
            stretches: parts of the runs to simulate.
        """
        e = parameters.restitution
        values = {k: v for k, v in asdict(parameters).items() if k != "restitution"}
        law = Law(loss=(1.0 - e**2) / (1.0 + e**2), gravity=self.gravity, **values)
        substeps = max(1, int(np.ceil(self.period / STEP - 1e-9)))
        eps, force = np.empty((2, int((stretches.steps + 1).sum())))
        bounced(self.motion, stretches, law, self.period, substeps, eps, force)
        return Bounce(eps, (force > 0.0).astype(np.float64))


def _check_settings(table: pd.DataFrame) -> None:
    for name in ("H", "beta", "m"):
        wrong = np.flatnonzero(~(table[name].to_numpy(np.float64) > 0.0))
        if len(wrong):
            run, value = table[["exp", name]].iloc[wrong[0]]
            raise BadInput(f"experiment {run:g}: {name} must be positive, got {value}")


def _period(runs: list[int], clocks: list[Array]) -> float:
    """The sampling period that all runs share, s."""
    period = np.nan
    for run, t in zip(runs, clocks, strict=True):
        if len(t) < 2:
            raise BadInput(f"experiment {run}: has fewer than two samples")
        period = float(t[1] - t[0]) if np.isnan(period) else period
        if not np.allclose(np.diff(t), period, rtol=1e-3, atol=0.0):
            raise BadInput(f"experiment {run}: t must be uniform with {period:g} s between samples")
    return period


def check_finite(run: int, name: str, values: NDArray[np.floating]) -> None:
    """Refuse a signal with samples that are not finite numbers. Takes values (samples,)."""
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong):
        raise BadInput(f"experiment {run}: {name} is not a finite number at sample {wrong[0]}")


def simulate(
    cams: CamMotion, parameters: BounceParameters, members: int = 1, spread: float = 0.1, seed: int = 0
) -> Bounce:
    """Simulate the detachment of the follower over whole runs.

    Small errors grow with every impact, so that an impact late in a run of many impacts cannot be predicted.
    The mean over an ensemble of parameters has the smallest error then.

    Args:
        cams: measured motion of the cams.
        parameters: parameters identified on training runs.
        members: number of simulations to average; default 1, with the parameters as they are.
        spread: standard deviation of the logarithms of the members' parameters; default 0.1.
        seed: seed of the ensemble; default 0.

    Returns:
        Mean detachment and contact, each of shape (samples,), one run after the other.
    """
    stretches = cams.from_the_start()
    if members == 1:
        return cams.simulate(parameters, stretches)
    draw = np.random.default_rng(seed)
    runs = [cams.simulate(_perturbed(parameters, draw.normal, spread), stretches) for _ in range(members)]
    return Bounce(*(np.mean(signal, axis=0) for signal in zip(*runs, strict=True)))


def _perturbed(p: BounceParameters, normal: Callable[..., float], spread: float) -> BounceParameters:
    values = {name: value * float(np.exp(normal(0.0, spread))) for name, value in asdict(p).items()}
    return replace(p, **values | {"restitution": min(values["restitution"], 1.0)})
