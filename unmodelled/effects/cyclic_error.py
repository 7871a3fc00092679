"""Cyclic error of an encoder: an angle that is shown wrongly in the same way in every turn."""

import math
from typing import ClassVar

from unmodelled.effects.effect import SensorEffect
from unmodelled.effects.law import Amplitude, Law, Shape, Told, Wave
from unmodelled.effects.outputs import rate_output
from unmodelled.effects.place import Place, Site
from unmodelled.systems.model import System

#: rad, a plausible error and the largest one: a magnet or disc that is off its axis by a few per cent of its
#: radius. The shown angle never runs backwards.
_PLAUSIBLE, _LARGEST = 0.02, 0.5
#: Waves per turn that are tried: one of a disc off its axis, more of a magnet with several poles.
_MOST = 8


class _CyclicError(SensorEffect):
    family = "cyclic_error"
    waves: ClassVar[tuple[str, ...]]  # numbers of waves per turn
    speed: ClassVar[bool] = False  # whether the speed is the derivative of the shown angle

    def places(self, system: System) -> tuple[Place, ...]:
        angles = {item.name for item in system.outputs if item.unit == "rad"}
        found = (place for place in super().places(system) if place.name in angles)
        return tuple(p for p in found if not self.speed or rate_output(system, p.name) is not None)

    def law(self, at: Site) -> Law:
        grid = tuple(map(float, range(1, _MOST + 1)))
        shapes = {n: Shape("1", grid, (0.9, 1.1 * _MOST)) for n in self.waves if not n.isdecimal()}
        amplitudes, waves = {}, {}
        for letter, n in zip("AB", self.waves, strict=False):
            times = "" if n == "1" else f"{n}*"
            sine, cosine = (f"{function}({times}y)" for function in ("sin", "cos"))
            amplitudes[f"{letter}_s"] = self._amplitude(sine, f"{times}r*{cosine}")
            amplitudes[f"{letter}_c"] = self._amplitude(cosine, f"{times}r*(-{sine})")
            waves[f"{letter}_s"] = Wave(f"{letter}_c", n if n in shapes else float(n))
        text = " + ".join(f"{name}*{a.adds}" for name, a in amplitudes.items())
        (item,) = (o for o in at.system.outputs if o.name == at.place.name)
        unit = item.as_difference
        told = dict.fromkeys(amplitudes, Told(unit=unit.text, factor=1.0 / unit.factor))
        return Law(
            f"y + {text}",
            amplitudes,
            shapes,
            told=told,
            waves=waves,
            phrase="cyclic error of " + "; ".join(f"{{{name}}}" for name in waves),
            cycle=2.0 * math.pi,
        )

    def _amplitude(self, wave: str, slope: str) -> Amplitude:
        return Amplitude(wave, _PLAUSIBLE, (-_LARGEST, _LARGEST), rate=slope if self.speed else "")


class CyclicError(_CyclicError):
    """Sine wave over the angle; the speed is measured otherwise."""

    waves = ("n_y",)


class CyclicErrorOfSpeed(_CyclicError):
    """Sine wave over the angle, and the speed that the same encoder shows is the slope of the shown angle."""

    variant = "angle_and_speed"
    waves = ("n_y",)
    speed = True


class CyclicErrorWithOvertone(_CyclicError):
    """Two sine waves, once and twice per turn, as of a disc off its axis and askew."""

    variant = "with_overtone"
    waves = ("1", "2")


class CyclicErrorOfSpeedWithOvertone(_CyclicError):
    """Two sine waves, once and twice per turn, also in the speed that the same encoder shows."""

    variant = "angle_and_speed_with_overtone"
    waves = ("1", "2")
    speed = True
