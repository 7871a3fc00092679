"""Ripple over position, as of cogging, eccentricity or gear mesh."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.gravity_load import GravityLoad
from unmodelled.effects.grids import waves
from unmodelled.effects.law import Law, Shape, Wave, signed
from unmodelled.effects.place import Site

#: Spatial frequencies that are tried.
_MOST = 64


class TorqueRipple(PortEffect):
    """Sine wave over position, of at least one period over the travel; add it again for a second wave."""

    kind = "load"
    family = "torque_ripple"
    says = "ripple with the wave number {k_x}"
    needs = ("position",)
    power = "stored"

    def law(self, at: Site) -> Law:
        grid = waves(at, _MOST, whole=True)
        amplitudes = {"A_s": signed("sin(k_x*x)", at.effort), "A_c": signed("cos(k_x*x)", at.effort)}
        frequency = Shape("1/x", grid, (grid[0], 1.5 * grid[-1]))
        return Law("A_s*sin(k_x*x) + A_c*cos(k_x*x)", amplitudes, {"k_x": frequency})


class TorqueRippleWithOvertones(TorqueRipple):
    """Sine wave over position with its second and third harmonic."""

    variant = "with_overtones"

    def law(self, at: Site) -> Law:
        grid = waves(at, _MOST // 3, whole=True)
        parts = {"A_s": "sin(k_x*x)", "A_c": "cos(k_x*x)"}
        for letter, k in (("B", 2), ("C", 3)):
            parts |= {f"{letter}_s": f"sin({k}*k_x*x)", f"{letter}_c": f"cos({k}*k_x*x)"}
        return Law(
            " + ".join(f"{name}*{wave}" for name, wave in parts.items()),
            {name: signed(wave, at.effort) for name, wave in parts.items()},
            {"k_x": Shape("1/x", grid, (grid[0], 1.5 * grid[-1]))},
        )


class TorqueRippleOncePerTurn(GravityLoad):
    """Sine wave of one period per turn, as of a magnet or winding off its axis.

    It is the law of a weight off the axis: only another position of the axis tells them apart.
    """

    family = "torque_ripple"
    variant = "once_per_turn"
    says = "ripple of {A_s}"

    def law(self, at: Site) -> Law:
        amplitudes = {"A_s": signed("sin(x)", at.effort), "A_c": signed("cos(x)", at.effort)}
        return Law("A_s*sin(x) + A_c*cos(x)", amplitudes, waves={"A_s": Wave("A_c", 1.0)})
