"""Stiction of an actuator: a valve that stays where it is until its command is far enough away."""

from typing import ClassVar

from unmodelled.effects.effect import DriveEffect
from unmodelled.effects.grids import geometric, relaxation
from unmodelled.effects.law import Law, Memory, Shape, share
from unmodelled.effects.place import Site

#: Share of the band over which the stem begins to move, and at which it sticks again.
_EDGE = 0.05


class _Stiction(DriveEffect):
    """Stem u_m that follows the input with the time constant of one sample, once it is u_s behind."""

    family = "actuator_stiction"
    phrase: ClassVar[str]
    memory: ClassVar[dict[str, Memory]]

    def law(self, at: Site) -> Law:
        largest = at["u"].largest
        shapes = {"u_s": Shape("u", geometric(0.005 * largest, 0.3 * largest, 7), (1e-4 * largest, largest))}
        return Law(
            "u_m, abs(u - u_m) <= u_s",
            {"c_u": share("u_m - u")},
            shapes,
            {"tau": relaxation(at)},
            memory=self.memory,
            phrase=self.phrase,
        )


class Play(_Stiction):
    """Play of an actuator: it follows the input at a distance, and not at once where this reverses."""

    variant = "play"
    phrase = "band of ±{u_s} in which it does not move"
    memory: ClassVar[dict[str, Memory]] = {
        "u_m": Memory("u", "(u - u_m - clip(u - u_m, -u_s, u_s))/tau", start="u")
    }


class Jump(_Stiction):
    """Stiction of a valve: it moves in jumps to its input (Stenman, Gustafsson and Forsman 2003)."""

    phrase = "sticks until its input is {u_s} away, then jumps"
    memory: ClassVar[dict[str, Memory]] = {
        "u_m": Memory("u", "u_j*(u - u_m)/tau", start="u"),
        # 1 while it moves: then it goes on down to a twentieth of the band
        "u_j": Memory("1", f"(0.5 + 0.5*tanh((abs(u - u_m)/u_s - 1 + {1 - _EDGE}*u_j)/{_EDGE}) - u_j)/tau"),
    }
