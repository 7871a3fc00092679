"""Compute the minimal contact force along simulations, for all design points at once (section 6.4.1)."""

from functools import partial

import torch
from torch import Tensor

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.conditions import Bench, CamTable, Conditions
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.integrate import limited, step
from pipeline.cam_follower.kernels import torch_function

#: The force is evaluated at this many instants per step; its minimum is narrow.
DENSE = 4
#: Finished runs are dropped every so many steps.
PRUNE = 25


class ContactForce:
    """Interface force of eq. 6.4 between the samples of a simulation, on the pitch curve."""

    def __init__(self, bench: Bench) -> None:
        self.cams = CamTable(torch.tensor(bench.curves("pitch"), dtype=torch.float32))
        symbols = (physics.omega, physics.alpha, physics.dh, physics.d2h, physics.m)
        self._force = torch_function(physics.INTERFACE_FORCE, (*symbols, *physics.CONSTANTS))
        self._constants = bench.mechanism.constants

    def minimum(
        self, start: tuple[Tensor, ...], end: tuple[Tensor, ...], period: float, q: Conditions
    ) -> Tensor:
        """Return the smallest force (batch, runs), N, in one integration step between two states."""
        (a0, w0, k0), (a1, w1, k1) = start, end
        lowest = torch.full_like(a0, torch.inf)
        for i in range(DENSE):
            s = i / DENSE
            # cubic Hermite: the states agree with the simulation at both ends
            h00, h10, h01, h11 = (
                (1 + 2 * s) * (1 - s) ** 2,
                s * (1 - s) ** 2,
                s * s * (3 - 2 * s),
                s * s * (s - 1),
            )
            a = h00 * a0 + h10 * period * w0 + h01 * a1 + h11 * period * w1
            w = h00 * w0 + h10 * period * k0 + h01 * w1 + h11 * period * k1
            k = (1 - s) * k0 + s * k1
            dh, d2h = self.cams(q.cam, a)
            lowest = torch.minimum(lowest, self._force(w, k, dh, d2h, q.m, *self._constants))
        return lowest


def _acceleration(model: Dynamics, memory: Tensor, q: Conditions, theta: Tensor, omega: Tensor) -> Tensor:
    return model.react(memory, theta, omega, q)[0]


@torch.no_grad()
def minimal_force(
    model: Dynamics, bench: Bench, start: tuple[Tensor, Tensor], q: Conditions, seconds: Tensor, period: float
) -> Tensor:
    """Return the minimal contact force F_min-dagger (batch, runs) of free runs, N, eq. 6.11.

    Takes start (batch, runs), q (runs,), seconds (batch, runs) in s, period in s.
    """
    contact = ContactForce(bench)
    h = period / model.substeps
    theta, omega = start
    limit, seconds = theta + 4.0 * TURN, seconds.expand_as(theta)
    result = torch.full_like(theta, torch.inf)
    columns = torch.arange(theta.shape[1])
    memory = model.begin(theta, omega, q)
    acceleration, after = model.react(memory, theta, omega, q)
    for i in range(int(torch.ceil(seconds.max() / h))):
        active = (i * h < seconds) & (theta < limit)
        if i % PRUNE == 0:
            # a run that every model has finished costs nothing any more
            keep = active.any(0)
            if not bool(keep.any()):
                break
            columns, q = columns[keep], q[keep]
            theta, omega, acceleration, limit, seconds, active, memory, after = (
                x[:, keep] for x in (theta, omega, acceleration, limit, seconds, active, memory, after)
            )
        react = partial(_acceleration, model, memory, q)
        a, w = step(react, acceleration, theta, omega, h, model.method)
        w, memory = limited(w), after
        k, after = model.react(memory, a, w, q)
        force = contact.minimum((theta, omega, acceleration), (a, w, k), h, q)
        result[:, columns] = torch.where(active, torch.minimum(result[:, columns], force), result[:, columns])
        theta, omega, acceleration = a, w, k
    return result
