"""Candidate terms of a force law: a function of position times a function of velocity."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from unmodelled.base.arrays import Array

HIGHEST_POWER, HIGHEST_HARMONIC = 5, 4


class Motion(Enum):
    """Function of the velocity v in a term.

    DRY (dry friction) is sign(v) or tanh(v / jump), PEAK (Stribeck peak) the same times exp(-(v / fade)^2).
    """

    NONE, VISCOUS, QUADRATIC, CUBIC, DRY, PEAK = range(6)


#: The functions of v alone, and their factors as text.
_PLAIN: Mapping[Motion, tuple[Callable[[Array], Array], tuple[str, ...]]] = {
    Motion.NONE: (np.ones_like, ()),
    Motion.VISCOUS: (lambda v: v, ("{v}",)),
    Motion.QUADRATIC: (lambda v: v * np.abs(v), ("{v}", "abs({v})")),
    Motion.CUBIC: (lambda v: v**3, ("{v}**3",)),
}


@dataclass(frozen=True)
class Term:
    """Term of a force law, without its coefficient."""

    motion: Motion = Motion.NONE
    power: int = 0  # of the position
    harmonic: int = 0  # k of sin(k x), or -k of cos(k x), instead of the power
    jump: float = 0.0  # velocity scale of dry friction; 0: sign(v)
    fade: float = 0.0  # velocity scale of a Stribeck peak; 0: no peak

    def __call__(self, position: Array, velocity: Array) -> Array:
        """Return the values of the term at positions and velocities of one shape."""
        return self._along(position) * self._during(velocity)

    def text(self, position: str, velocity: str, jump: str = "", fade: str = "") -> str:
        """Return the term in the grammar of system files; "1" for a constant."""
        scales = jump or short_number(self.jump), fade or short_number(self.fade)
        return "*".join([*self._along_text(position), *self._during_text(velocity, *scales)]) or "1"

    def shaped(self, jump: float, fade: float) -> Term:
        """Return the term with other velocity scales, as far as it has them."""
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
        if self.motion in _PLAIN:
            return _PLAIN[self.motion][0](v)
        jump = np.tanh(v / self.jump) if self.jump else np.sign(v)
        return jump if self.motion is Motion.DRY else jump * np.exp(-((v / self.fade) ** 2))

    def _during_text(self, v: str, jump: str, fade: str) -> list[str]:
        if self.motion in _PLAIN:
            return [factor.format(v=v) for factor in _PLAIN[self.motion][1]]
        step = f"tanh({v}/{jump})" if self.jump else f"sign({v})"
        return [step] if self.motion is Motion.DRY else [step, f"exp(-({v}/{fade})**2)"]


def short_number(value: float) -> str:
    """Return a number as text with four significant digits.

    Examples:
        >>> short_number(550800.0), short_number(0.002), short_number(-4.25)
        ('5.508e5', '0.002', '-4.25')
    """
    digits, _, exponent = f"{value:.4g}".partition("e")
    return f"{digits}e{int(exponent)}" if exponent else digits


def candidates(jump: float, fades: Sequence[float], angle: bool = False, turns: bool = False) -> list[Term]:
    """Return all candidate terms for one velocity scale of dry friction; their order does not depend on it.

    They are a constant load, powers of the position, damping and dry friction (constant or proportional to
    the position), and Stribeck peaks.
    """
    springs = [Term(power=power) for power in range(1 if turns else HIGHEST_POWER + 1)]
    powers = (0,) if turns else (0, 1)
    friction = [Term(motion, power) for motion in (Motion.VISCOUS, Motion.DRY) for power in powers]
    drag = [Term(Motion.QUADRATIC), Term(Motion.CUBIC)]
    peaks = [Term(Motion.PEAK, fade=fade) for fade in fades]
    waves = [Term(harmonic=k) for k in range(-HIGHEST_HARMONIC, HIGHEST_HARMONIC + 1) if k and angle]
    return [term.shaped(jump, term.fade) for term in (*springs, *friction, *drag, *peaks, *waves)]


def compatible(terms: Sequence[Term]) -> bool:
    """Return whether a set of terms has at most one Stribeck peak, and one only with dry friction."""
    motions = [term.motion for term in terms if not term.power]
    return motions.count(Motion.PEAK) <= motions.count(Motion.DRY)


def columns_of(terms: Sequence[Term], position: Array, velocity: Array) -> Array:
    """Evaluate terms at positions and velocities (...), (..., k)."""
    if not terms:
        return np.empty((*position.shape, 0))
    return np.stack([term(position, velocity) for term in terms], axis=-1)


def sum_text(coefficients: Mapping[str, float]) -> str:
    """Return the sum of terms with their coefficients on one line.

    Examples:
        >>> sum_text({"1": 2.0, "d": -30.0})
        '2 - 30*d'
    """
    parts = [
        short_number(c) if text == "1" else f"{short_number(c)}*{text}" for text, c in coefficients.items()
    ]
    return " + ".join(parts).replace("+ -", "- ") or "0"
