"""Base class of the effects in a coil."""

from typing import ClassVar

from unmodelled.effects.effect import Need, PortEffect
from unmodelled.systems.model import Port, System
from unmodelled.systems.units import parse_unit


class CoilEffect(PortEffect):
    """Effort of a port whose effort is a voltage and whose velocity is a current."""

    needs: ClassVar[tuple[Need, ...]] = ("velocity",)

    def suits(self, system: System, port: Port) -> bool:
        states = {state.name: state.unit for state in system.states}
        units = [port.unit, states.get(port.velocity or "", "1")]
        is_coil = [parse_unit(u).dimension for u in units] == [parse_unit(u).dimension for u in ("V", "A")]
        return is_coil and super().suits(system, port)
