"""What the name and the unit of a column say about it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from unmodelled.drafting.tags import Tag, tag_in
from unmodelled.drafting.units import (
    bracketed,
    dimension_of,
    ending,
    in_degrees,
    is_angle,
    is_position,
    known_unit,
    of_temperature,
)


class Role(Enum):
    """Meaning that a column may have."""

    TIME = "time"
    POSITION = "position"
    VELOCITY = "speed"
    EFFORT = "torque or force"
    CURRENT = "current"
    VOLTAGE = "voltage"
    DUTY = "opening or duty"
    PRESSURE = "pressure"
    FLOW = "flow"
    POWER = "power"
    TEMPERATURE = "temperature"
    LEVEL = "level"
    CHARGE = "charge"
    GOAL = "commanded position"
    SET_POINT = "set point"
    PART = "name of a part"
    OTHER = "not used"


#: Quantities that act on a body, and those of them that do so without a source behind them.
ACTING = frozenset(
    [Role.EFFORT, Role.CURRENT, Role.VOLTAGE, Role.DUTY, Role.PRESSURE, Role.FLOW, Role.POWER, Role.SET_POINT]
)
FORCES = ACTING - {Role.FLOW, Role.POWER, Role.SET_POINT}
WORDS = {
    Role.TIME: "time timestamp stamp times zeit clock seconds secs timestep elapsed epoch datenum datetime "
    "date uhrzeit",
    Role.POSITION: "pos position positions theta angle angles phi encoder travel stroke winkel weg state enc "
    "hub lage displacement deflection pitch roll yaw attitude heading tilt azimuth elevation",
    Role.VELOCITY: "vel velocity velocities speed omega qd dq qdot dtheta drehzahl geschwindigkeit rpm "
    "gyro gyr gyroscope vx vy vz rollspeed pitchspeed yawspeed rollrate pitchrate yawrate",
    Role.EFFORT: "torque torques tau effort efforts force forces moment drehmoment kraft",
    Role.CURRENT: "current currents curr cur iq strom amps amperage",
    Role.VOLTAGE: "voltage voltages volt volts spannung",
    Role.DUTY: "pwm duty throttle valve pump ventil pumpe",
    Role.PRESSURE: "pressure pressures druck press",
    Role.FLOW: "flow flowrate inflow outflow durchfluss zufluss abfluss volumenstrom massenstrom mdot vdot",
    Role.POWER: "power leistung heizleistung",
    Role.TEMPERATURE: "temp temps temperature temperatures temperatur thermocouple ntc",
    Role.LEVEL: "level levels fill pegel füllstand fuellstand tank",
    Role.CHARGE: "soc charge ladung ladezustand",
    Role.PART: "run runs episode trial experiment segment cycle rep repetition versuch lauf zyklus",
    Role.OTHER: "acc accel acceleration accelerometer beschleunigung",
}
#: Symbols, in which a capital is another quantity.
_SYMBOLS = {
    **{"t": Role.TIME, "q": Role.POSITION, "x": Role.POSITION, "X": Role.POSITION, "w": Role.VELOCITY},
    **{"F": Role.EFFORT, "M": Role.EFFORT, "i": Role.CURRENT, "I": Role.CURRENT, "u": Role.VOLTAGE},
    **{"U": Role.VOLTAGE, "p": Role.PRESSURE, "Q": Role.FLOW, "P": Role.POWER, "T": Role.TEMPERATURE},
    **{"h": Role.LEVEL, "z": Role.POSITION, "Z": Role.POSITION},
}
#: Capitals that an index may follow without a sign between: `Ti`, `Ph`, `Fx`.
_INDEXED = re.compile(r"[TPFQUI](?=[a-z]$)")
#: Quantities of process tags, by their first letter.
_TAGGED = {"F": Role.FLOW, "L": Role.LEVEL, "P": Role.PRESSURE, "T": Role.TEMPERATURE, "S": Role.VELOCITY}
_TAGGED |= {"W": Role.LEVEL, "E": Role.VOLTAGE, "I": Role.CURRENT, "J": Role.POWER, "Z": Role.POSITION}
#: Words that make the speed of a position, such as `yaw_rate`.
_SLOPES = frozenset(["rate", "dot"])
#: Words of angles, which no letter after them makes a length: `theta_m` is that of a motor.
_ANGLES = ("q", "theta", "angle", "angles", "phi", "winkel", "pitch", "roll", "yaw")
_COMMAND = (
    "cmd command goal ref reference set setpoint desired des target soll action control con sollwert wanted "
    "demand sp"
)
#: Words of gyroscopes among those of speeds, and of forces among those of efforts.
_GYROS, _FORCES = "gyro gyr gyroscope", "force forces kraft"
#: Words beside a role that say that the quantity was measured.
_MEASURED = "meas measured actual act state ist encoder"
#: Quantities of which a set point is no drive: a controller drives until the quantity is there.
_CONTROLLED = frozenset([Role.VELOCITY, Role.TEMPERATURE, Role.LEVEL, Role.CHARGE])
#: Units of a quantity; a ratio may also be a percentage.
_UNITS = {
    Role.TIME: ("s",),
    Role.POSITION: ("m",),
    Role.VELOCITY: ("1/s", "m/s"),
    Role.EFFORT: ("N m", "N"),
    Role.CURRENT: ("A",),
    Role.VOLTAGE: ("V",),
    Role.PRESSURE: ("Pa",),
    Role.FLOW: ("m^3/s", "kg/s"),
    Role.POWER: ("W",),
    Role.TEMPERATURE: ("K",),
    Role.CHARGE: ("C",),
    Role.LEVEL: ("m", "m^3", "kg"),
    Role.OTHER: ("m/s^2", "1/s^2"),
}
_RATIOS = frozenset([Role.LEVEL, Role.CHARGE, Role.DUTY])
#: Units of a sensor without a scale, which a word may have beside it: `position [V]`, `level_mA`.
_RAW = ("V", "mV", "A", "mA", "count", "%")
#: Words of switches, limits and corrections, which are no quantity: `torque_enable`, `gyro_bias`.
_FLAGS = "enable enabled enabling flag flags status fault error err mode limit valid bias offset"
#: Words of things: a unit or a symbol beside them says which quantity of the thing it is.
_THINGS = "tank valve pump ventil pumpe throttle state encoder enc fill press"


@dataclass(frozen=True)
class Meaning:
    """Quantity and unit of a column by its name; None where neither tells."""

    role: Role | None
    unit: str | None


def words_of(name: str) -> list[str]:
    """Return the words of a name in lower case, without numbers and units.

    Examples:
        >>> words_of("/joint_states.posMeas1[2]"), words_of("state[hip.vel]"), words_of("speed [rpm]")
        (['joint', 'states', 'pos', 'meas'], ['state', 'hip', 'vel'], ['speed'])
    """
    return [word.lower() for word in _cased(name)]


def _cased(name: str) -> list[str]:
    """Words of a name as written."""
    beside = r"[\[(].*" if bracketed(name) else r"\(.*"
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", re.sub(beside, "", name))
    return re.findall(r"[^\W\d_]+", apart)


def meaning_of(name: str, given: str | None = None) -> Meaning:
    """Return what a column is, by its last telling word that its unit agrees with, otherwise by its unit."""
    if {*_FLAGS.split()} & {*words_of(name)}:
        return Meaning(Role.OTHER, known_unit(given) or bracketed(name) or _ending(name, ()))
    if (tag := tag_in(name)) is not None and (found := _of_tag(tag, known_unit(given) or bracketed(name))):
        return found
    told = _told(name)
    if (degrees := in_degrees(name, given)) and Role.CHARGE not in (role for _, role in told):
        sure = Role.TEMPERATURE in (role for _, role in told)  # C is coulomb as well
        return Meaning(_commanded(name, Role.TEMPERATURE), degrees if sure else None)
    unit = known_unit(given) or bracketed(name) or _ending(name, told)
    fitting = [role for word, role in told if unit is None or _fits(role, unit, word)]
    strong = [role for word, role in told if word not in _THINGS.split() and len(word) > 1]
    role = next(iter([*fitting, *(strong if unit in (None, *_RAW) else [])]), None) or _by_unit(unit)
    if unit is None and role is Role.TEMPERATURE:
        unit = of_temperature(name)
    if role is Role.POSITION and unit == "%" and any(other is Role.DUTY for _, other in told):
        role = Role.DUTY
    if role is Role.POSITION and unit is None and _SLOPES & {*words_of(name)}:
        role = Role.VELOCITY
    if role is Role.VELOCITY and unit in ("1/min", "1/min."):
        unit = "rpm"
    if role is None and unit is None:
        role = _indexed(name)
    return Meaning(_commanded(name, role), unit)


def _indexed(name: str) -> Role | None:
    """What a column is by a symbol with an index: `Ti`."""
    found = (_INDEXED.match(word) for word in _cased(name))
    return next((_SYMBOLS[match[0]] for match in found if match), None)


def _of_tag(tag: Tag, unit: str | None) -> Meaning | None:
    """What a process tag is; a unit that no such signal has says more than its letters."""
    if tag.kind == "set point":
        return Meaning(Role.SET_POINT, unit)
    role = _TAGGED.get(tag.variable, Role.DUTY) if tag.kind == "value" else Role.DUTY
    fits = unit is None or _fits(role, unit, "") or (role is Role.DUTY and unit in _RAW)
    other = Role.DUTY if unit == "%" else _by_unit(unit)
    if not tag.sure and (unit is None or not fits):
        return None
    told = role if fits else other or role
    return Meaning(Role.OTHER if tag.kind == "switch" and fits else told, unit)


def _told(name: str) -> list[tuple[str, Role]]:
    """Telling words of a name with their roles: the last quantity first, then symbols, things and parts."""
    found = [
        (word, role)
        for word in words_of(name)[::-1]
        for role, known in WORDS.items()
        if word in known.split()
    ]
    letters = [(word, _SYMBOLS[word]) for word in _cased(name) if word in _SYMBOLS]
    order = [
        [pair for pair in found if pair[0] not in _THINGS.split() and pair[1] is not Role.PART],
        letters,
        [pair for pair in found if pair[0] in _THINGS.split()],
        [pair for pair in found if pair[1] is Role.PART],
    ]
    return [pair for pairs in order for pair in pairs]


def _ending(name: str, told: Sequence[tuple[str, Role]]) -> str | None:
    """The unit that a name ends with, if no other word of it says another quantity."""
    found = ending(name)
    if found is None:
        return None
    unit, letter = found
    if any(_fits(role, unit, word) for word, role in told):
        return unit
    strong = any(word not in _THINGS.split() and len(word) > 1 for word, _ in told)
    if letter:
        return None if any(word not in _THINGS.split() for word, _ in told) or name[-1].islower() else unit
    return unit if not strong or unit in _RAW else None


def _fits(role: Role, unit: str, word: str) -> bool:
    """Whether a unit is one of a quantity."""
    if role is Role.POSITION:
        return (is_position(unit) and (is_angle(unit) or word not in _ANGLES)) or unit == "count"
    if role in _RATIOS and unit in ("%", "1", "-"):
        return True
    return dimension_of(unit) in map(dimension_of, _UNITS.get(role, ()))


def _by_unit(unit: str | None) -> Role | None:
    """What a column is whose name says nothing."""
    if unit is None or dimension_of(unit) == dimension_of("1"):
        angle = unit is not None and (is_angle(unit) or unit == "count")
        return Role.POSITION if angle else Role.DUTY if unit == "%" else None
    roles = (
        role for role, units in _UNITS.items() for each in units if dimension_of(unit) == dimension_of(each)
    )
    return next(roles, None)


def _commanded(name: str, role: Role | None) -> Role | None:
    """What a column is if its name is that of a set point, by what the quantity is."""
    if not is_command(name):
        return role
    if role is Role.POSITION or (role is None and "action" in words_of(name)):
        return Role.GOAL
    return Role.SET_POINT if role in _CONTROLLED and not is_measured(name) else role


def says_little(name: str) -> bool:
    """Return whether no word of a name tells what it is, only a symbol such as `p`.

    Examples:
        >>> says_little("imu.p"), says_little("pressure")
        (True, False)
    """
    return tag_in(name) is None and all(len(word) == 1 for word, _ in _told(name))


def is_gyro(name: str) -> bool:
    """Return whether a name is that of a gyroscope, which measures an angle per second.

    Examples:
        >>> is_gyro("gyroADC[0]"), is_gyro("motor_rpm")
        (True, False)
    """
    return bool({*_GYROS.split()} & {*words_of(name)})


def is_force(name: str) -> bool:
    """Return whether a name is that of a force, not of a torque.

    Examples:
        >>> is_force("F"), is_force("Kraft_soll"), is_force("torque"), is_force("F_joint torque")
        (True, True, False, False)
    """
    told = [word for word, role in _told(name) if role is Role.EFFORT]
    return bool(told) and told[0] in ("F", *_FORCES.split())


def is_command(name: str) -> bool:
    """Return whether a name is that of a set point."""
    return bool({*_COMMAND.split()} & {*words_of(name)})


def is_measured(name: str) -> bool:
    """Return whether a name says that its quantity was measured."""
    return bool({*_MEASURED.split()} & {*words_of(name)})


def number_of(name: str) -> str:
    """Return the number or name of the joint in a name: element of a list, or last digits; "" if none.

    The number of a table without a name of its own, such as `group2`, is none.

    Examples:
        >>> [number_of(name) for name in ("positions[3]", "state[hip.pos]", "motor1.speed", "group2.speed")]
        ['3', 'hip', '1', '']
    """
    name = re.sub(r"^group\d+\.", "", name)
    found = re.search(r"\[(\w+)(?:\.\w+)?\]\s*$", name) or re.search(r"(\d+)\D*$", name)
    return found[1] if found else ""
