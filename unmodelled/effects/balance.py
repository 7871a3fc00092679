"""Base class of the effects at a port that balances heat, fluid or charge."""

from typing import ClassVar

from unmodelled.effects.effect import Need, PortEffect
from unmodelled.effects.place import coordinate_unit
from unmodelled.effects.surroundings import TEMPERATURE
from unmodelled.systems.model import Port, System
from unmodelled.systems.units import parse_unit


class BalanceEffect(PortEffect):
    """Loss of a balance per time as a function of its level, which is a temperature, a depth or a charge."""

    needs: ClassVar[tuple[Need, ...]] = ("position",)
    domains = ("balance",)
    warm: ClassVar[bool | None] = None  # of temperatures only, of other levels only, or of both

    def suits(self, system: System, port: Port) -> bool:
        if not super().suits(system, port) or port.position is None:
            return False
        unit = coordinate_unit(system, port.position)
        return self.warm in (None, parse_unit(unit).dimension == TEMPERATURE)


class ToKnownSurroundings(BalanceEffect):
    """Exchange with surroundings whose level the log or the system file gives."""

    variant = "to_known"
    needs = ("position", "surroundings")
