"""Dry friction that does not depend on speed."""

from __future__ import annotations

from pipeline.physics.effects.effect import PortEffect
from pipeline.physics.effects.grids import creep
from pipeline.physics.effects.law import Law, positive
from pipeline.physics.effects.place import Site


class CoulombFriction(PortEffect):
    """The same in both directions."""

    family = "coulomb_friction"
    complexity = 1.0
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        return Law("F_c*sign(v)", {"F_c": positive("tanh(v/v_c)", at.effort)}, {"v_c": creep(at)})


class CoulombFrictionByDirection(PortEffect):
    """Another level for each direction."""

    family = "coulomb_friction"
    variant = "by_direction"
    complexity = 2.5
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        amplitudes = {
            "F_p": positive("max(tanh(v/v_c), 0)", at.effort),
            "F_n": positive("min(tanh(v/v_c), 0)", at.effort),
        }
        return Law("where(v > 0, F_p, -F_n)", amplitudes, {"v_c": creep(at)})
