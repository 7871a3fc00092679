"""Dead zone of an actuator: no effect of small inputs."""

from typing import ClassVar

from unmodelled.effects.effect import DriveEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Shape, share
from unmodelled.effects.place import Site


class _DeadZone(DriveEffect):
    family = "actuator_dead_zone"
    lost: ClassVar[str]  # part of the input that has no effect

    def law(self, at: Site) -> Law:
        largest = at["u"].largest
        shapes = {"u_d": Shape("u", geometric(0.01 * largest, 0.5 * largest, 6), (1e-4 * largest, largest))}
        amplitudes = {"c_u": share(f"-{self.lost}")}
        return Law(f"u - {self.lost}", amplitudes, shapes, phrase="dead zone of ±{u_d}")


class DeadZone(_DeadZone):
    """Dead zone of equal width on both sides; beyond it the actuator gives the input minus the width."""

    lost = "clip(u, -u_d, u_d)"


class RoundedDeadZone(_DeadZone):
    """Dead zone with a gradual transition."""

    variant = "rounded"
    lost = "u_d*tanh(u/u_d)"
