"""Integrate a second-order system with fixed steps, for a batch of states."""

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
    """Integrate one step.

    Args:
        acceleration: function from angle (rad) and speed (rad/s) to acceleration (rad/s^2), all of one shape.
        angle: angle, rad, any shape.
        speed: speed, rad/s, same shape.
        period: length of the step, s.
        method: "euler" (eq. 6.15) or "rk4".

    Returns:
        New angle (rad), new speed (rad/s), and the acceleration at the start of the step (rad/s^2), all of
        the same shape.
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
    """Limit the speed of diverging simulations to `SPEED_LIMIT`; nan becomes the limit.

    Args:
        speed: speed, rad/s, any shape.

    Returns:
        Limited speed, rad/s, same shape.
    """
    return torch.nan_to_num(speed, nan=SPEED_LIMIT).clamp(-SPEED_LIMIT, SPEED_LIMIT)


def rollout(
    acceleration: Acceleration, angle: Tensor, speed: Tensor, steps: int, period: float, method: Method
) -> tuple[Tensor, Tensor, Tensor]:
    """Simulate a free run from an initial state.

    Args:
        acceleration: function from angle (rad) and speed (rad/s) to acceleration (rad/s^2), all of one shape.
        angle: initial angle, rad, any shape.
        speed: initial speed, rad/s, same shape.
        steps: number of steps.
        period: length of a step, s.
        method: "euler" or "rk4".

    Returns:
        Angle (rad), speed (rad/s) and acceleration (rad/s^2), each of shape (..., steps + 1).
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
