"""Minimal contact force along a simulation, with every design point of a grid at once (section 6.4.1)."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from pipeline.models.conditions import Bench, CamTable, Conditions
from pipeline.models.dynamics import Dynamics
from pipeline.numerics.integrate import step
from pipeline.physics.kernels import torch_function
from pipeline.physics.mechanisms import cam_follower as physics
from pipeline.physics.mechanisms.cam import TURN

#: The force is evaluated at this many instants per step; its minimum is narrow.
DENSE = 5


class ContactForce:
    """The interface force of eq. 6.4 along dense trajectories, on the pitch curve."""

    def __init__(self, bench: Bench) -> None:
        self.cams = CamTable(torch.tensor(bench.curves("pitch"), dtype=torch.float32))
        symbols = (physics.omega, physics.alpha, physics.dh, physics.d2h, physics.m)
        function: Callable[..., Tensor] = torch_function(
            physics.INTERFACE_FORCE, (*symbols, *physics.CONSTANTS)
        )
        self.force = lambda *x: function(*x, *bench.mechanism.constants)

    def minimum(self, start: tuple[Tensor, ...], end: tuple[Tensor, ...], period: float, q: Conditions) -> Tensor:
        """Smallest force during one step, N.

        Args:
            start, end: angle, speed, acceleration at both ends, each (batch, runs).
            period: s.
            q: conditions, (runs,) or (batch, runs).
        """
        (a0, w0, k0), (a1, w1, k1) = start, end
        lowest = torch.full_like(a0, torch.inf)
        for i in range(DENSE):
            s = i / DENSE
            # cubic Hermite: the states agree with the simulation at both ends
            h00, h10, h01, h11 = (1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2, s * s * (3 - 2 * s), s * s * (s - 1)
            a = h00 * a0 + h10 * period * w0 + h01 * a1 + h11 * period * w1
            w = h00 * w0 + h10 * period * k0 + h01 * w1 + h11 * period * k1
            k = (1 - s) * k0 + s * k1
            lowest = torch.minimum(lowest, self.force(w, k, *self.cams(q.cam, a), q.m))
        return lowest


@torch.no_grad()
def minimal_force(
    model: Dynamics, bench: Bench, start: tuple[Tensor, Tensor], q: Conditions, seconds: Tensor, period: float
) -> Tensor:
    """F_min-dagger of free-run simulations, N, eq. 6.11.

    Args:
        model: a stack of models.
        bench: the mechanism.
        start: initial angle and speed, (batch, runs).
        q: conditions, (batch, runs) or (runs,).
        seconds: (batch, runs) or (runs,) how long each simulation lasts; none lasts longer than four turns.
        period: sampling period of the model, s.

    Returns:
        (batch, runs).
    """
    contact = ContactForce(bench)
    h = period / model.substeps
    (theta, omega), limit = start, start[0] + 4.0 * TURN
    lowest = torch.full_like(theta, torch.inf)
    acceleration = model.acceleration(theta, omega, q)
    for i in range(int(torch.ceil(seconds.max() / h))):
        active = (i * h < seconds) & (theta < limit)
        if not bool(active.any()):
            break
        a, w, _ = step(lambda x, v: model.acceleration(x, v, q), theta, omega, h, model.method)
        w = torch.nan_to_num(w, nan=200.0).clamp(-200.0, 200.0)
        k = model.acceleration(a, w, q)
        force = contact.minimum((theta, omega, acceleration), (a, w, k), h, q)
        lowest = torch.where(active, torch.minimum(lowest, force), lowest)
        theta, omega, acceleration = a, w, k
    return lowest
