"""Fixed-step integration of a second-order system, batched."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import torch
from torch import Tensor

Method = Literal["euler", "rk4"]
Acceleration = Callable[[Tensor, Tensor], Tensor]  # (angle, speed) -> acceleration, all of one shape

#: A diverging simulation is held at this speed, rad/s: far beyond any machine, finite for every metric.
SPEED_LIMIT = 200.0


def step(
    acceleration: Acceleration, angle: Tensor, speed: Tensor, period: float, method: Method
) -> tuple[Tensor, Tensor, Tensor]:
    """One step of `period` seconds.

    Args:
        acceleration: the system.
        angle, speed: (...) state, rad and rad/s.
        period: s.
        method: "euler" as in eq. 6.15, or "rk4".

    Returns:
        New angle, new speed, and the acceleration at the start of the step, each (...).
    """
    k1 = acceleration(angle, speed)
    if method == "euler":
        return angle + period * speed, speed + period * k1, k1
    half = 0.5 * period
    v2 = speed + half * k1
    k2 = acceleration(angle + half * speed, v2)
    v3 = speed + half * k2
    k3 = acceleration(angle + half * v2, v3)
    v4 = speed + period * k3
    k4 = acceleration(angle + period * v3, v4)
    sixth = period / 6.0
    return (
        angle + sixth * (speed + 2.0 * (v2 + v3) + v4),
        speed + sixth * (k1 + 2.0 * (k2 + k3) + k4),
        k1,
    )


def limited(speed: Tensor) -> Tensor:
    """`speed` within the limit; NaN means that the simulation has diverged, and becomes the limit."""
    return torch.nan_to_num(speed, nan=SPEED_LIMIT).clamp(-SPEED_LIMIT, SPEED_LIMIT)


def rollout(
    acceleration: Acceleration, angle: Tensor, speed: Tensor, steps: int, period: float, method: Method
) -> tuple[Tensor, Tensor, Tensor]:
    """Free-run simulation from an initial state.

    Returns:
        Angle (rad), speed (rad/s) and acceleration (rad/s^2), each (..., steps + 1).
    """
    angles, speeds, accelerations = [angle], [speed], []
    for _ in range(steps):
        angle, speed, k = step(acceleration, angle, speed, period, method)
        speed = limited(speed)
        angles.append(angle)
        speeds.append(speed)
        accelerations.append(k)
    accelerations.append(acceleration(angle, speed))
    return torch.stack(angles, -1), torch.stack(speeds, -1), torch.stack(accelerations, -1)
