"""The terms a force law may be made of: a function of the position times a function of the velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
HIGHEST_POWER, HIGHEST_HARMONIC = 5, 4


class Motion(Enum):
    """How a term follows the velocity v.

    Not at all; v; v |v|; v^3; the jump of dry friction: sign(v) or tanh(v / jump); the Stribeck peak: that
    jump times exp(-(v / fade)^2).
    """

    NONE, VISCOUS, QUADRATIC, CUBIC, DRY, PEAK = range(6)


@dataclass(frozen=True)
class Term:
    """One term, without its coefficient.

    Attributes:
        motion: how it follows the velocity.
        power: of the position.
        harmonic: k of sin(k x) or, negative, of cos(k x), in place of the power; 0 for none.
        jump, fade: velocities; zero where the motion has none, and `jump` zero for sign(v).
    """

    motion: Motion = Motion.NONE
    power: int = 0
    harmonic: int = 0
    jump: float = 0.0
    fade: float = 0.0

    def __call__(self, position: Array, velocity: Array) -> Array:
        """Its values, of the shape of the arguments."""
        return self._along(position) * self._during(velocity)

    def text(self, position: str, velocity: str) -> str:
        """In the grammar of a system file, with these names; "1" for a constant."""
        return "*".join([*self._along_text(position), *self._during_text(velocity)]) or "1"

    def shaped(self, jump: float, fade: float) -> Term:
        """The same term with other velocities, where it has them."""
        if self.motion is Motion.DRY:
            return replace(self, jump=jump)
        return replace(self, jump=jump, fade=fade) if self.motion is Motion.PEAK else self

    def _along(self, x: Array) -> Array:
        if self.harmonic:
            return np.sin(self.harmonic * x) if self.harmonic > 0 else np.cos(self.harmonic * x)
        return x**self.power

    def _along_text(self, x: str) -> list[str]:
        if self.harmonic:
            times = "" if abs(self.harmonic) == 1 else f"{abs(self.harmonic)}*"
            return [f"{'sin' if self.harmonic > 0 else 'cos'}({times}{x})"]
        return [x if self.power == 1 else f"{x}**{self.power}"] if self.power else []

    def _during(self, v: Array) -> Array:
        match self.motion:
            case Motion.NONE:
                return np.ones_like(v)
            case Motion.VISCOUS:
                return v
            case Motion.QUADRATIC:
                return v * np.abs(v)
            case Motion.CUBIC:
                return v**3
        jump = np.tanh(v / self.jump) if self.jump else np.sign(v)
        return jump if self.motion is Motion.DRY else jump * np.exp(-((v / self.fade) ** 2))

    def _during_text(self, v: str) -> list[str]:
        match self.motion:
            case Motion.NONE:
                return []
            case Motion.VISCOUS:
                return [v]
            case Motion.QUADRATIC:
                return [v, f"abs({v})"]
            case Motion.CUBIC:
                return [f"{v}**3"]
        jump = f"tanh({v}/{number(self.jump)})" if self.jump else f"sign({v})"
        return [jump] if self.motion is Motion.DRY else [jump, f"exp(-({v}/{number(self.fade)})**2)"]


def number(value: float) -> str:
    """A number of four significant digits.

    >>> number(550800.0), number(0.002), number(-4.25)
    ('5.508e5', '0.002', '-4.25')
    """
    digits, _, exponent = f"{value:.4g}".partition("e")
    return f"{digits}e{int(exponent)}" if exponent else digits


def candidates(jump: float, fades: Sequence[float], angle: bool = False, turns: bool = False) -> list[Term]:
    """Every term with dry friction of this `jump`; only the jump in them depends on it, never their order.

    A constant load, powers of the position, damping and friction (also in proportion to the position) and
    Stribeck peaks that fade at `fades`. If the position is an `angle`, loads that repeat every turn; if it
    `turns` all the way round, only those follow the position.
    """
    springs = [Term(power=power) for power in range(1 if turns else HIGHEST_POWER + 1)]
    powers = (0,) if turns else (0, 1)
    friction = [Term(motion, power) for motion in (Motion.VISCOUS, Motion.DRY) for power in powers]
    drag = [Term(Motion.QUADRATIC), Term(Motion.CUBIC)]
    peaks = [Term(Motion.PEAK, fade=fade) for fade in fades]
    waves = [Term(harmonic=k) for k in range(-HIGHEST_HARMONIC, HIGHEST_HARMONIC + 1) if k and angle]
    return [term.shaped(jump, term.fade) for term in (*springs, *friction, *drag, *peaks, *waves)]


def compatible(terms: Sequence[Term]) -> bool:
    """Whether there is a Stribeck peak only on top of dry friction, and only one."""
    motions = [term.motion for term in terms if not term.power]
    return motions.count(Motion.PEAK) <= motions.count(Motion.DRY)


def columns_of(terms: Sequence[Term], position: Array, velocity: Array) -> Array:
    """Values of `terms` along a last axis that follows the axes of `position` and `velocity`."""
    if not terms:
        return np.empty((*position.shape, 0))
    return np.stack([term(position, velocity) for term in terms], axis=-1)


def formula(coefficients: Mapping[str, float]) -> str:
    """The sum of terms with their coefficients, on one line.

    >>> formula({"1": 2.0, "d": -30.0})
    '2 - 30*d'
    """
    parts = [number(c) if text == "1" else f"{number(c)}*{text}" for text, c in coefficients.items()]
    return " + ".join(parts).replace("+ -", "- ") or "0"
