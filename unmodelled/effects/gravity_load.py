"""Weight of a body that turns about an axis off its centre of gravity."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Law, Wave, signed
from unmodelled.effects.place import Site
from unmodelled.systems import units
from unmodelled.systems.model import Port, System
from unmodelled.systems.units import parse_unit


class GravityLoad(PortEffect):
    """Sine wave of one period per turn, of unknown direction; only for a port whose effort is a torque.

    Along a straight line a weight is a constant load.
    """

    kind = "load"
    family = "gravity_load"
    says = "weight of {W_s}"
    needs = ("position",)
    power = "stored"

    def suits(self, system: System, port: Port) -> bool:
        torque = parse_unit(port.unit).dimension in (parse_unit("N m").dimension, units.ONE)
        return torque and super().suits(system, port)

    def law(self, at: Site) -> Law:
        amplitudes = {"W_s": signed("sin(x)", at.effort), "W_c": signed("cos(x)", at.effort)}
        return Law("W_s*sin(x) + W_c*cos(x)", amplitudes, waves={"W_s": Wave("W_c", 1.0)})
