"""Base class of the effects in a coil."""

from typing import ClassVar

from unmodelled.effects.effect import Need, PortEffect
from unmodelled.effects.place import coordinate_unit
from unmodelled.systems.model import Port, System
from unmodelled.systems.units import parse_unit


class CoilEffect(PortEffect):
    """Effort of a port whose effort is a voltage and whose velocity is a current."""

    needs: ClassVar[tuple[Need, ...]] = ("velocity",)

    def suits(self, system: System, port: Port) -> bool:
        if not super().suits(system, port) or port.velocity is None:
            return False
        units = [port.unit, coordinate_unit(system, port.velocity)]
        return [parse_unit(u).dimension for u in units] == [parse_unit(u).dimension for u in ("V", "A")]
