"""Kinds of balances: heat, fluid, charge and momentum, by the quantities that are logged."""

from __future__ import annotations

from dataclasses import dataclass

from unmodelled.drafting.names import Role


@dataclass(frozen=True)
class Kind:
    """A kind of balance."""

    level: Role  # shows how full a store is
    supply: Role  # fills it
    indirect: tuple[Role, ...]  # set the supply where it is not logged
    symbols: tuple[str, str, str, str]  # of level, supply, size of the store and loss
    store: str  # name of the size of the store
    effort: str  # SI unit of the supply
    port: str

    @property
    def verb(self) -> str:
        """Word for the action of a supply on the level."""
        return {"shaft": "drives", "heat": "heats"}.get(self.port, "fills")

    @property
    def turns(self) -> bool:
        """Whether the level is a speed, which the effort drives."""
        return self.level is Role.VELOCITY

    @property
    def electric(self) -> bool:
        """Whether the level is a voltage, which shows the resistance before the store as well."""
        return self.level is Role.VOLTAGE

    @property
    def around(self) -> bool:
        """Whether losses go to surroundings with a level of their own."""
        return self.level is Role.TEMPERATURE

    @property
    def loses(self) -> bool:
        """Whether a loss grows with the level."""
        return self.supply is not Role.CURRENT


_SET = (Role.DUTY, Role.VOLTAGE, Role.CURRENT)
SPEED = Kind(
    Role.VELOCITY, Role.EFFORT, (*_SET, Role.PRESSURE), ("w", "u", "J", "b"), "inertia", "N m", "shaft"
)
HEAT = Kind(Role.TEMPERATURE, Role.POWER, _SET, ("T", "P", "C", "k"), "heat capacity", "W", "heat")
TANK = Kind(Role.LEVEL, Role.FLOW, _SET, ("h", "Q", "A", "k"), "cross-section", "m^3/s", "fluid")
VESSEL = Kind(
    Role.PRESSURE, Role.FLOW, _SET, ("p", "Q", "C", "k"), "stored volume per pressure", "m^3/s", "fluid"
)
CHARGE = Kind(Role.CHARGE, Role.CURRENT, (), ("s", "i", "C", "k"), "capacity", "A", "charge")
CELL = Kind(Role.VOLTAGE, Role.CURRENT, (), ("U", "i", "C", "R"), "capacitance", "A", "charge")
#: Kinds, those whose supply is logged before those whose supply is set by something else.
DIRECT, INDIRECT = (SPEED, HEAT, TANK, VESSEL), (SPEED, TANK, HEAT, VESSEL)
