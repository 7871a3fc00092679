"""Constant load."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site


class ConstantLoad(PortEffect):
    """Load that does not depend on the motion."""

    kind = "load"
    family = "constant_load"
    says = "load of {F_0}"
    power = "stored"
    domains = ("power", "balance")

    def law(self, at: Site) -> Law:
        return Law("F_0", {"F_0": signed("1", at.effort)})
