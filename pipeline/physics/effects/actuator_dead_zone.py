"""An actuator that does nothing at small inputs."""

from __future__ import annotations

from pipeline.physics.effects.effect import ActuatorEffect
from pipeline.physics.effects.grids import geometric
from pipeline.physics.effects.law import Law, Shape, share
from pipeline.physics.effects.place import Site


class ActuatorDeadZone(ActuatorEffect):
    """The same width on both sides; beyond, it gives what the input exceeds it by."""

    family = "actuator_dead_zone"
    complexity = 2.0

    def law(self, at: Site) -> Law:
        largest = max(abs(at["u"].low), abs(at["u"].high), at["u"].rms)
        lost = "clip(u, -u_d, u_d)"
        shapes = {"u_d": Shape("u", geometric(0.01 * largest, 0.5 * largest, 6), (0.0, largest))}
        return Law(f"u - {lost}", {"c_u": share(f"-{lost}")}, shapes)
