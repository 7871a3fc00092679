"""Backlash (play) between a port and the body that it moves."""

from collections.abc import Mapping
from typing import ClassVar

from unmodelled.effects.body_behind import BodyBehind
from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import creep, geometric, relaxation
from unmodelled.effects.law import Fixed, Law, Memory, Shape, Told, positive, share
from unmodelled.effects.place import Site

#: Contact frequency, in radians per sample.
_CONTACT = 0.3
#: Starting values of the play: a mass that hits its stops at the wrong moments explains nothing.
_FEW, _MANY = 6, 40
#: A drawing and a dial gauge show the whole play, the laws have half of it.
_PLAY = Told("play from stop to stop", "2*{0}", 2.0)
_PHRASE = "{delta} of play from stop to stop"


def _gap(at: Site, count: int) -> Shape:
    """Return the starting values of half the play, from a thousandth to a fifth of the half travel."""
    half = at["x"].half
    grid = geometric(1e-3 * half, 0.2 * half, count)
    return Shape("x", grid, (0.1 * grid[0], half))


class FrictionBehindPlay(PortEffect):
    """Dry friction of a body that is dragged along with play: no friction within the play, at every reversal.

    The distance r of the port from the body is held within delta with a time constant of one sampling period.
    """

    kind = "play"
    family = "backlash"
    variant = "friction"
    needs = ("position", "velocity")
    power = "lost over a cycle"

    def law(self, at: Site) -> Law:
        dragged = "(r - clip(r, -delta, delta))/tau"
        return Law(
            "F_b*sign(v - d(r)/dt), abs(r) <= delta",
            {"F_b": positive(f"tanh({dragged}/v_c)", at.effort)},
            {"delta": _gap(at, _FEW), "v_c": creep(at, holds=False)},
            {"tau": relaxation(at)},
            {"r": Memory("x", f"v - {dragged}")},
            told={"delta": _PLAY},
            phrase=_PHRASE,
        )


class _BehindPlay(BodyBehind):
    """Body with play of 2*delta, whose stops are springs of frequency omega_b and damping ratio 0.5."""

    kind = "play"
    family = "backlash"
    pushed = "omega_b**2*(x - x_b - clip(x - x_b, -delta, delta)) + omega_b*(abs(x - x_b) > delta)*(v - v_b)"

    told: ClassVar[Mapping[str, Told]] = {"delta": _PLAY}
    phrase = _PHRASE

    def connection(self, at: Site) -> tuple[dict[str, Shape], dict[str, Fixed]]:
        return {"delta": _gap(at, _MANY)}, {"omega_b": Fixed("1/t", _CONTACT / at.period)}


class MassBehindPlay(_BehindPlay):
    """Part of the known mass that is connected to the port with play."""

    variant = "mass"
    is_part = True


class LoadBehindPlay(_BehindPlay):
    """Additional mass that is connected to the port with play."""

    variant = "load"
    is_part = False


class PlayInSpring(PortEffect):
    """Play of 2*delta about x_0 in series with the spring of the system file that acts at the port.

    The force of the spring becomes k*(x - x_0 - clip(x - x_0, -delta, delta)) in place of k*x: the dead zone
    model of Nordin and Gutman (Automatica 38, 2002). The port lies between two bodies, and the spring of the
    file has no force at position zero.
    """

    kind = "play"
    family = "backlash"
    variant = "in_spring"
    needs = ("position", "spring")

    def law(self, at: Site) -> Law:
        half = at["x"].half
        missing = "-s*(x_0 + clip(x - x_0, -delta, delta))"
        shapes = {
            "delta": Shape("x", geometric(0.02 * half, 0.8 * half, 8), (1e-3 * half, half)),
            "x_0": Shape("x", (0.0,), (min(at["x"].low, -half), max(at["x"].high, half))),
        }
        amplitudes = {"c_s": share(missing)}
        return Law(missing, amplitudes, shapes, told={"delta": _PLAY}, phrase=_PHRASE)
