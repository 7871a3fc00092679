"""What the name and the unit of a column say about it."""

from __future__ import annotations

import re
from enum import Enum

from unmodelled.logs.time_units import seconds_of
from unmodelled.systems.units import describe, parse_logged


class Role(Enum):
    """Meaning that a column may have."""

    TIME = "time"
    POSITION = "position"
    VELOCITY = "speed"
    EFFORT = "torque or force"
    CURRENT = "current"
    VOLTAGE = "voltage"
    GOAL = "commanded position"
    PART = "name of a part"
    OTHER = "not used"


WORDS = {
    Role.TIME: "t time timestamp stamp times zeit clock seconds secs timestep",
    Role.POSITION: "pos position positions q theta angle angles phi x encoder travel stroke winkel weg state",
    Role.VELOCITY: "vel velocity velocities speed omega qd dq qdot dtheta w drehzahl geschwindigkeit rpm",
    Role.EFFORT: "torque torques tau effort efforts force forces moment drehmoment kraft load pwm duty",
    Role.CURRENT: "current currents i iq strom amps",
    Role.VOLTAGE: "voltage voltages u volt volts spannung",
    Role.PART: "run episode trial experiment segment",
}
_COMMAND = "cmd command goal ref reference set setpoint desired des target soll action control con"
#: Words beside a role that say that the quantity was measured.
_MEASURED = "meas measured actual act state ist encoder"
_DIMENSIONS = {
    "rad/s": Role.VELOCITY,
    "m/s": Role.VELOCITY,
    "N m": Role.EFFORT,
    "N": Role.EFFORT,
    "A": Role.CURRENT,
    "V": Role.VOLTAGE,
    "m": Role.POSITION,
    "rad": Role.POSITION,
    "s": Role.TIME,
}
_UNIT_WORDS = {
    **{word: word for word in ("rad", "deg", "mm", "cm", "m", "rpm", "ms", "us", "ns")},
    **{"nm": "N m", "n": "N", "a": "A", "ma": "mA", "v": "V", "mv": "mV", "degree": "deg", "degrees": "deg"},
}


def words_of(name: str) -> list[str]:
    """Return the words of a name in lower case, without numbers and units.

    Args:
        name: name of a column, with its table.

    Examples:
        >>> words_of("/joint_states.posMeas1[2]"), words_of("state[hip.vel]"), words_of("speed [rpm]")
        (['joint', 'states', 'pos', 'meas'], ['state', 'hip', 'vel'], ['speed'])
    """
    beside = r"[\[(].*" if unit_in(name) else r"\(.*"
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", re.sub(beside, "", name))
    return [word.lower() for word in re.findall(r"[A-Za-zµ]+", apart)]


def role_of(name: str, unit: str | None) -> Role | None:
    """Return what a column is by its last telling word, otherwise by its unit; None if neither says.

    Args:
        name: name of the column, with its table.
        unit: unit of the column; None: unknown.

    Examples:
        >>> role_of("goal_position", None), role_of("tau_con1", None), role_of("3", "rpm")
        (<Role.GOAL: 'commanded position'>, <Role.EFFORT: 'torque or force'>, <Role.VELOCITY: 'speed'>)
    """
    words = words_of(name)
    found = next(
        (role for word in words[::-1] for role, known in WORDS.items() if word in known.split()), None
    )
    if found in (None, Role.POSITION) and is_command(name):
        return Role.GOAL if found or "action" in words else None
    if found is None and unit:
        try:
            si, _ = parse_logged(unit)
        except ValueError:
            return None
        found = _DIMENSIONS.get(si.text) or _DIMENSIONS.get(describe(si.dimension))
        if seconds_of(unit) is not None:
            found = Role.TIME
    return found


def is_command(name: str) -> bool:
    """Return whether a name is that of a set point.

    Args:
        name: name of a column, with its table.
    """
    return bool({*_COMMAND.split()} & {*words_of(name)})


def is_measured(name: str) -> bool:
    """Return whether a name says that its quantity was measured.

    Args:
        name: name of a column, with its table.
    """
    return bool({*_MEASURED.split()} & {*words_of(name)})


def unit_in(name: str) -> str | None:
    """Return the unit that a name ends with; None if there is none.

    Args:
        name: name of a column.

    Examples:
        >>> unit_in("theta_deg"), unit_in("motor current mA"), unit_in("speed [rpm]"), unit_in("theta")
        ('deg', 'mA', 'rpm', None)
    """
    bracket = re.search(r"[\[(]([^\[\]()]*[A-Za-z°%][^\[\]()]*)[\])]\s*$", name)
    words = re.findall(r"[A-Za-zµ]+", name)
    found = bracket[1] if bracket else _UNIT_WORDS.get(words[-1].lower()) if len(words) > 1 else None
    try:
        return found if found and parse_logged(found) else None
    except ValueError:
        return None


def number_of(name: str) -> str:
    """Return the number or name of the joint in a name: element of a list, or last digits; "" if none.

    The number of a table without a name of its own, such as `group2`, is none.

    Args:
        name: name of a column, with its table.

    Examples:
        >>> [number_of(name) for name in ("positions[3]", "state[hip.pos]", "motor1.speed", "group2.speed")]
        ['3', 'hip', '1', '']
    """
    name = re.sub(r"^group\d+\.", "", name)
    found = re.search(r"\[(\w+)(?:\.\w+)?\]\s*$", name) or re.search(r"(\d+)\D*$", name)
    return found[1] if found else ""
