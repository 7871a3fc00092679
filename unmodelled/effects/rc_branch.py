"""Slow part of an output on which an input acts directly: an RC branch, the polarisation of a battery."""

from unmodelled.effects.effect import SensorEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Memory, Shape, signed
from unmodelled.effects.outputs import direct_input
from unmodelled.effects.place import Place, Site
from unmodelled.systems.model import System

#: Of the longest experiment: the slowest time constant from which a fit starts, and the slowest of all.
_SLOW, _SLOWEST = 0.3, 10.0


class RcBranch(SensorEffect):
    """Response of an output to its direct input that builds up with a time constant, at rest at the start.

    In the voltage of a battery, -R_1 is the resistance of an RC branch and -tau_1/R_1 its capacitance, if the
    current is positive while the battery is discharged.
    """

    family = "rc_branch"
    says = "RC branch of {R_1} with {tau_1}"
    says_negative = "negative RC branch of {R_1} with {tau_1}"

    def places(self, system: System) -> tuple[Place, ...]:
        outputs = (o for o in system.outputs if direct_input(system, o) is not None)
        return tuple(Place("sensor", output.name) for output in outputs)

    def law(self, at: Site) -> Law:
        grid = geometric(4.0 * at.period, _SLOW * at.duration, 5)
        return Law(
            "y + R_1*u_1, tau_1*d(u_1)/dt = u - u_1",
            {"R_1": signed("u_1", 0.1 * at["y"].rms / at["u"].rms)},
            {"tau_1": Shape("t", grid, (at.period, _SLOWEST * at.duration))},
            memory={"u_1": Memory("u", "(u - u_1)/tau_1")},
        )
