"""Properties of an experiment that are known in advance: operating point and cam."""

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
import pandas as pd
import torch
from torch import Tensor, nn

from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.cam_follower import CamFollower
from unmodelled.base.errors import BadInput


@dataclass(frozen=True)
class Conditions:
    """Operating points; all fields have one shape, (experiments,) or any other."""

    V: Tensor  # motor voltage, V
    m: Tensor  # mass of the follower, kg
    H: Tensor  # stroke, m
    beta: Tensor  # angle of the rise, rad
    cam: Tensor  # number of the cam in the `CamTable`, int64
    J_c: Tensor  # inertia of the cam plate, kg m^2
    S_x: Tensor  # imbalance of the cam plate along x, N m
    S_y: Tensor  # the same along y, N m

    def __getitem__(self, index: Tensor) -> "Conditions":
        """The conditions of the experiments `index` (any shape, int64)."""
        return Conditions(*(getattr(self, f.name)[index] for f in fields(self)))


class CamTable(nn.Module):
    """Derivatives of the displacement of all cams, looked up by cam and angle."""

    #: (cams, 2, n), first (m/rad) and second derivative (m/rad^2) over one turn; here one row per angle
    curves: Tensor

    def __init__(self, curves: Tensor) -> None:
        super().__init__()
        n = curves.shape[-1]
        # the first angle again at the end, so that interpolation needs no wrap-around
        table = torch.cat([curves, curves[..., :1]], -1).transpose(1, 2)
        self.register_buffer("curves", table.reshape(-1, 2).contiguous(), persistent=False)
        self.n = n

    def forward(self, cam: Tensor, theta: Tensor) -> tuple[Tensor, Tensor]:
        """Interpolate the derivatives of the displacement linearly; shapes of (cam, theta) broadcast."""
        x = theta * (self.n / TURN)
        floor = torch.floor(x)
        weight = (x - floor)[..., None]
        index = cam * (self.n + 1) + torch.remainder(floor, self.n).long().clamp(0, self.n - 1)
        low = self.curves[index]
        value = low + (self.curves[index + 1] - low) * weight
        return value[..., 0], value[..., 1]


@dataclass(frozen=True)
class Bench:
    """The mechanism with the cams of a campaign."""

    mechanism: CamFollower
    #: Stroke (m) and angle of the rise (rad), in the order of the tables' first axis
    cams: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, mechanism: CamFollower, experiments: pd.DataFrame) -> "Bench":
        """Collect the cams of a table of experiments."""
        pairs = experiments[["H", "beta"]].drop_duplicates().sort_values(["H", "beta"])
        return cls(mechanism, tuple((float(H), float(beta)) for H, beta in pairs.to_numpy()))

    def conditions(self, experiments: pd.DataFrame) -> Conditions:
        """Return the operating points of experiments; gives (n,)."""
        index = {pair: i for i, pair in enumerate(self.cams)}
        try:
            cam = [index[float(H), float(b)] for H, b in experiments[["H", "beta"]].to_numpy()]
        except KeyError as error:
            raise BadInput(f"no cam with (H, beta) = {error.args[0]} in this campaign") from None
        constants = np.array([self.mechanism.cam_constants(self.mechanism.cam(*p)) for p in self.cams])
        columns = [experiments[c].to_numpy(np.float32) for c in ("V", "m", "H", "beta")]
        V, m, H, beta = (torch.tensor(c) for c in columns)
        J_c, S_x, S_y = torch.tensor(constants[cam].T, dtype=torch.float32)
        return Conditions(V, m, H, beta, torch.tensor(cam), J_c, S_x, S_y)

    @lru_cache(maxsize=8)  # noqa: B019 - a bench is immutable and lives as long as the process
    def curves(self, kind: str, n: int = 3600) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """Tabulate the derivatives of the displacement of all cams over one turn; gives (cams, 2, n)."""
        cams = [self.mechanism.cam(*pair) for pair in self.cams]
        if kind not in ("pitch", "theoretical"):
            raise BadInput(f"curve must be pitch or theoretical, got {kind}")
        tables = [c.pitch_curve(n) if kind == "pitch" else c.theoretical_curve(n) for c in cams]
        return np.stack(tables)[:, 1:]
