"""Integrate a second-order system with fixed steps, for a batch of states."""

from collections.abc import Callable
from typing import Literal

import torch
from torch import Tensor

Method = Literal["euler", "rk4"]
Acceleration = Callable[[Tensor, Tensor], Tensor]  # (angle, speed) -> acceleration, all of one shape
Reaction = Callable[[Tensor, Tensor, Tensor], tuple[Tensor, Tensor]]  # with a memory before and after

#: A diverging simulation is held at this speed, rad/s: far beyond any machine, finite for every metric.
SPEED_LIMIT = 200.0


def step(
    acceleration: Acceleration, k1: Tensor, angle: Tensor, speed: Tensor, period: float, method: Method
) -> tuple[Tensor, Tensor]:
    """Integrate one step of `period` s; k1 (rad/s^2), angle (rad) and speed (rad/s) have one shape."""
    if method == "euler":
        return angle + period * speed, speed + period * k1
    half = 0.5 * period
    v2 = speed + half * k1
    k2 = acceleration(angle + half * speed, v2)
    v3 = speed + half * k2
    k3 = acceleration(angle + half * v2, v3)
    v4 = speed + period * k3
    k4 = acceleration(angle + period * v3, v4)
    sixth = period / 6.0
    return angle + sixth * (speed + 2.0 * (v2 + v3) + v4), speed + sixth * (k1 + 2.0 * (k2 + k3) + k4)


def limited(speed: Tensor) -> Tensor:
    """Limit the speed (any shape) of diverging simulations to `SPEED_LIMIT`; nan becomes the limit."""
    return torch.nan_to_num(speed, nan=SPEED_LIMIT).clamp(-SPEED_LIMIT, SPEED_LIMIT)


def rollout(
    react: Reaction, memory: Tensor, angle: Tensor, speed: Tensor, steps: int, period: float, method: Method
) -> tuple[Tensor, Tensor, Tensor]:
    """Simulate a free run from an initial state of any shape; gives (..., steps + 1)."""
    angles, speeds, accelerations = [angle], [speed], []
    for _ in range(steps):
        k, after = react(memory, angle, speed)
        angle, speed = step(lambda a, w, m=memory: react(m, a, w)[0], k, angle, speed, period, method)  # type: ignore[misc]
        speed, memory = limited(speed), after
        angles.append(angle)
        speeds.append(speed)
        accelerations.append(k)
    accelerations.append(react(memory, angle, speed)[0])
    return torch.stack(angles, -1), torch.stack(speeds, -1), torch.stack(accelerations, -1)
