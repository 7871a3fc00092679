"""An actuator that cannot do all that is asked."""

from __future__ import annotations

from pipeline.physics.effects.effect import ActuatorEffect
from pipeline.physics.effects.law import Law, Shape, share
from pipeline.physics.effects.place import Site


class ActuatorSaturation(ActuatorEffect):
    """The same limit on both sides."""

    family = "actuator_saturation"
    complexity = 2.0

    def law(self, at: Site) -> Law:
        largest = max(abs(at["u"].low), abs(at["u"].high), at["u"].rms)
        grid = tuple(largest * k for k in (0.2, 0.35, 0.5, 0.65, 0.8, 0.9))
        limited = "clip(u, -u_max, u_max)"
        shapes = {"u_max": Shape("u", grid, (0.01 * largest, largest))}
        return Law(limited, {"c_u": share(f"{limited} - u")}, shapes)
