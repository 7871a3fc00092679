"""Backlash (play) between a port and the body that it moves."""

from __future__ import annotations

from abc import abstractmethod

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import creep, geometric, relaxation
from unmodelled.effects.law import Amplitude, Fixed, Law, Memory, Shape, positive
from unmodelled.effects.motion import is_inertial
from unmodelled.effects.place import Site
from unmodelled.systems.model import Port, System

#: Of the mass that the port feels: the most that can hide behind the play.
_MOST = 0.95
#: Contact frequency, in radians per sample.
_CONTACT = 0.3


#: Starting values of the play: a mass that hits its stops at the wrong moments explains nothing.
_FEW, _MANY = 6, 40


def _gap(at: Site, count: int) -> Shape:
    """Return the starting values of half the play, from a thousandth to a fifth of the half travel."""
    half = at["x"].half
    grid = geometric(1e-3 * half, 0.2 * half, count)
    return Shape("x", grid, (0.1 * grid[0], half))


class FrictionBehindPlay(PortEffect):
    """Dry friction of a body that is dragged along with play: no friction within the play, at every reversal.

    The distance r of the port from the body is held within delta with a time constant of one sampling period.
    """

    family = "backlash"
    variant = "friction"
    complexity = 4.0
    needs = ("position", "velocity")
    power = "lost over a cycle"

    def law(self, at: Site) -> Law:
        dragged = "(r - clip(r, -delta, delta))/tau"
        return Law(
            "F_b*sign(v - d(r)/dt), abs(r) <= delta",
            {"F_b": positive(f"tanh({dragged}/v_c)", at.effort)},
            {"delta": _gap(at, _FEW), "v_c": creep(at)},
            {"tau": relaxation(at)},
            {"r": Memory("x", f"v - {dragged}")},
        )


class _MassBehindPlay(PortEffect):
    """Mass m_b behind play of 2*delta: r is its distance from the port, v_b its speed.

    The contact is a spring of frequency omega_b with half its critical damping.
    """

    family = "backlash"
    needs = ("position", "velocity")
    pushed = "omega_b**2*(clip(r, -delta, delta) - r) + omega_b*(abs(r) > delta)*(v - v_b)"

    @abstractmethod
    def effort(self, mass: float) -> tuple[str, Amplitude]:
        """Return the effort on the port, as text and as amplitude; `mass` is the mass that the port feels."""

    def suits(self, system: System, port: Port) -> bool:
        return super().suits(system, port) and is_inertial(system, port)

    def law(self, at: Site) -> Law:
        text, amplitude = self.effort(1.0 / at.mobility)
        return Law(
            f"{text}, d(v_b)/dt = {self.pushed}, d(r)/dt = v_b - v",
            {"m_b": amplitude},
            {"delta": _gap(at, _MANY)},
            {"omega_b": Fixed("1/t", _CONTACT / at.period)},
            {"r": Memory("x", "v_b - v"), "v_b": Memory("v", self.pushed)},
        )


class MassBehindPlay(_MassBehindPlay):
    """Part of the known mass that is connected to the port with play."""

    variant = "mass"
    complexity = 4.0

    def effort(self, mass: float) -> tuple[str, Amplitude]:
        amplitude = Amplitude(f"{self.pushed} - a", 0.1 * mass, (0.0, _MOST * mass))
        return "m_b*(d(v_b)/dt - d(v)/dt)", amplitude


class LoadBehindPlay(_MassBehindPlay):
    """Additional mass that is connected to the port with play."""

    variant = "load"
    complexity = 4.2

    def effort(self, mass: float) -> tuple[str, Amplitude]:
        return "m_b*d(v_b)/dt", positive(self.pushed, 0.1 * mass)
