"""The moving positions of a machine, each with its speed and what drives it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.drafting.chains import geared
from unmodelled.drafting.channels import (
    Channel,
    correlation,
    fit_of,
    followed,
    input_channel,
    is_slope,
    position_channel,
    slope,
    velocity_channel,
)
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.homes import UNNAMED, Home, distinct, unnamed_pairs
from unmodelled.drafting.motion import Drive
from unmodelled.drafting.names import (
    ACTING,
    FORCES,
    Role,
    is_command,
    is_force,
    number_of,
    words_of,
)
from unmodelled.drafting.units import dimension_of, is_angle, is_position

#: Joints of a first model.
MOST = 6
#: Share of the largest motion below which a position stands still.
STILL = 0.02
#: Correlation with the slope of a position from which on a column that is called a speed is its speed.
NAMED = 0.7
#: Share of an acceleration that an input must explain: to give its sign and size, and to be found by it.
EXPLAINED, FOUND = 0.1, 0.3
#: Ratios of the areas of the two chambers of a cylinder that are tried.
AREAS = tuple(float(ratio) for ratio in np.geomspace(0.25, 4.0, 33))
#: Difference between such shares that says nothing.
ALIKE = 0.05


@dataclass(frozen=True)
class Joint:
    """A moving position."""

    position: Channel
    velocity: Channel | None
    drive: Channel | None
    servo: bool  # the drive is a commanded position
    fit: Drive  # acceleration by the drive, in SI units
    others: tuple[Signal, ...]  # further columns that could drive it
    goal: Signal | None = None  # commanded position beside a drive: a controller makes the drive from both
    against: Channel | None = None  # pressure of the other chamber, scaled by the ratio of the areas

    @property
    def angular(self) -> bool:
        """Whether the position is an angle."""
        return is_angle(self.position.unit)

    @property
    def trusted(self) -> bool:
        """Whether the logs show how the drive accelerates the position."""
        return self.fit.share > EXPLAINED and self.fit.gain != 0.0


def joints_of(experiments: Sequence[Sequence[Signal]], most: int = MOST) -> list[Joint]:
    """Find the moving positions, at most so many, with their speeds and drives."""
    named = any(signal.role is Role.POSITION for signals in experiments for signal in signals)
    homes: dict[str, Home] = {}
    for signals in experiments:
        pairs = {} if named else unnamed_pairs(signals)
        for position in [s for s in signals if s.role is Role.POSITION] if named else pairs:
            home = Home(position, signals, pairs.get(position))
            homes[position.address] = max(
                homes.get(position.address, home), home, key=lambda each: each.motion
            )
    widest = max((home.motion for home in homes.values()), default=0.0)
    moving = [home for home in homes.values() if home.moves(STILL * widest if named else 0.0)]
    kept = distinct(moving)[:most]
    found = [_joint(home, kept) for home in kept]
    alike = _of_one_kind(_completed(found, kept))
    return [_fitted(joint, experiments) for joint in alike]


def _of_one_kind(joints: Sequence[Joint]) -> list[Joint]:
    """Joints whose drives are of one kind by their names, such as measured, where all have such a one."""
    kinds: list[dict[str, Channel]] = []
    for joint in joints:
        drives = [joint.drive] if joint.drive is not None and not joint.servo else []
        drives += [input_channel(s, joint.angular) for s in joint.others] if drives else []
        kinds.append({_without_number(each.signal.address): each for each in drives})
    common = [name for name in kinds[0] if all(name in kind for kind in kinds)] if kinds else []
    if len({_without_number(j.drive.signal.address) for j in joints if j.drive}) < 2 or not common:
        return list(joints)
    fits = {
        name: [fit_of(j.position, kind[name], False) for j, kind in zip(joints, kinds, strict=True)]
        for name in common
    }
    shares = {name: float(np.mean([fit.share for fit in found])) for name, found in fits.items()}
    usable = [name for name in common if shares[name] > max(shares.values()) - ALIKE]
    best = min(usable, key=is_command)
    others = [tuple(drive.signal for name, drive in kind.items() if name != best) for kind in kinds]
    chosen = zip(joints, kinds, fits[best], others, strict=True)
    return [replace(j, drive=kind[best], fit=fit, others=rest) for j, kind, fit, rest in chosen]


def _completed(joints: Sequence[Joint], homes: Sequence[Home]) -> list[Joint]:
    """Joints with a drive where the columns of the others tell which one it is, by its number, and what.

    A joint that carries others is accelerated by more than its own drive, which the values then do not show,
    and follows its set point less closely.
    """
    known = [j for j in joints if j.drive and number_of(j.position.signal.address)]
    first = max(known, key=lambda joint: joint.servo, default=None)
    if first is None or first.drive is None:
        return list(joints)
    found, drive = list[Joint](), first.drive
    for joint, home in zip(joints, homes, strict=True):
        here = {signal.address: signal for signal in home.signals}
        address = _shifted(drive.signal.address, first.position.signal.address, joint.position.signal.address)
        signal = here.get(address)
        if signal is not None and (joint.drive is None or joint.drive.signal is signal):
            like = Channel(signal, drive.unit, drive.certain)
            fit = fit_of(joint.position, like, first.servo)
            joint = replace(joint, drive=like, servo=first.servo, fit=fit)
        found.append(joint)
    return found


def _shifted(address: str, origin: str, other: str) -> str:
    """The address that is to `other` what `address` is to `origin`: its number is as much larger."""
    own = number_of(origin)
    if own and not own.isdigit():
        return address.replace(own, number_of(other))
    mine, from_, to = (re.search(r"(\d+)(\D*)$", text) for text in (address, origin, other))
    if mine is None or from_ is None or to is None:
        return ""
    return f"{address[: mine.start()]}{int(mine[1]) + int(to[1]) - int(from_[1])}{mine[2]}"


def _fitted(joint: Joint, experiments: Sequence[Sequence[Signal]]) -> Joint:
    """The joint with the fit of the experiment that shows best how its drive accelerates it."""
    fits, drive = [joint.fit], joint.drive
    for signals in experiments:
        here = {signal.address: signal for signal in signals}
        q, u = here.get(joint.position.signal.address), here.get(drive.signal.address if drive else "")
        if drive and q and u:
            against = joint.against
            if against is not None and against.signal.address in here:
                against = replace(against, signal=here[against.signal.address])
            own, acting = replace(joint.position, signal=q), replace(drive, signal=u)
            fits.append(fit_of(own, acting, joint.servo, against))
    return replace(joint, fit=max(fits, key=lambda fit: fit.share * (fit.gain > 0.0 or not joint.servo)))


def _velocity(home: Home, free: Sequence[Signal]) -> Signal | None:
    """The speed of a position; None if none agrees with its slope."""
    position, known = home.position, [s for s in free if s.role is Role.VELOCITY]
    if home.velocity is not None:
        return home.velocity
    same = [s for s in known if _same(position, s)] or known
    rated = [(slope(position, s).correlation, s) for s in same if not geared(position, s)]
    best, found = max(rated, key=lambda pair: pair[0], default=(0.0, None))
    if best >= NAMED:
        return found
    # a symbol, such as p of a roll rate, is no drive if it is the slope and something else may drive
    slopes = [s for s in free if is_slope(position, s, UNNAMED)]
    others = [s for s in free if s not in slopes and (s.role is None or s.role in FORCES)]
    return slopes[0] if slopes and others else None


def _is_force(signal: Signal) -> bool:
    """Whether a column is a force by its unit, or by its name where it has none."""
    if signal.unit is None:
        return is_force(signal.address)
    return dimension_of(signal.unit) == dimension_of("N")


def _same(position: Signal, other: Signal) -> bool:
    """Whether two columns have the number of one joint."""
    number = number_of(position.address)
    return bool(number) and number == number_of(other.address)


def _akin(position: Signal, near: Sequence[Signal], positions: Sequence[Signal]) -> list[Signal]:
    """Columns without those whose names have a word that only another position has, such as its joint."""
    words = {each.address: {*words_of(each.address)} for each in positions}
    every = [word for each in words.values() for word in each]
    other = {word for word in every if every.count(word) == 1} - words[position.address]
    return [s for s in near if not other & {*words_of(s.address)}]


def _joint(home: Home, homes: Sequence[Home]) -> Joint:
    position, many, taken = home.position, len(homes) > 1, {each.position.address for each in homes}
    free = [signal for signal in home.signals if signal.address not in taken]
    speed = _velocity(home, free)
    free = [signal for signal in free if signal is not speed]
    # elements of one list have one unit
    name = _without_number(position.address)
    widest = max(each.motion for each in homes if _without_number(each.position.address) == name)
    pushed = any(_is_force(s) for s in free)
    here = position_channel(position, speed, widest, pushed)
    velocity = None if speed is None else velocity_channel(here, speed)
    near = [s for s in free if not many or not number_of(s.address) or _same(position, s)]
    near = _akin(position, near, [each.position for each in homes])
    # of what acts, what was measured goes before what was wanted
    acting = [s for s in near if s.role in ACTING]
    acting.sort(key=lambda s: (s.role is Role.PRESSURE, is_command(s.address)))
    efforts = [s for s in acting if s.role in FORCES] or acting
    goals = [s for s in near if s.role is Role.GOAL or followed(here, s)]
    goal = max(goals, key=lambda signal: correlation(position, signal), default=None)
    servo = None if goal is None else followed(here, goal) or _servo(here, goal)
    loop = Drive(0.0, 0.0, 0.0) if servo is None else fit_of(here, servo, True)
    unknown = [s for s in free if s.role is None and s is not goal]
    drives = [input_channel(s, is_angle(here.unit)) for s in efforts or unknown]
    rated = [(fit_of(here, drive, False), drive) for drive in drives]
    best = max((fit.share for fit, _ in rated), default=0.0)
    if servo is not None and goal is not None and (not efforts or best < min(EXPLAINED, loop.share)):
        # what acts shows nothing of it, such as the voltage of a supply: the loop can be modelled
        return Joint(here, velocity, servo, True, loop, (*efforts, *_without(goal, goals)))
    if not efforts and best < FOUND:
        return Joint(here, velocity, None, False, Drive(0.0, 0.0, 0.0), ())
    # of those that explain about the same: the first with a telling name, otherwise what varies most
    alike = [pair for pair in rated if pair[0].share > best - ALIKE]
    fit, drive = alike[0] if efforts else max(alike, key=lambda pair: float(np.std(pair[1].signal.values)))
    others = efforts or [pair[1].signal for pair in alike]
    joint = Joint(here, velocity, drive, False, fit, _without(drive.signal, others), goal)
    return _with_chamber(joint, drive)


def _with_chamber(joint: Joint, drive: Channel) -> Joint:
    """The joint with the pressure of the other chamber, if a pressure drives it and one more is logged."""
    chambers = [s for s in joint.others if s.role is Role.PRESSURE and drive.signal.role is Role.PRESSURE]
    if len(chambers) != 1:
        return joint
    second = input_channel(chambers[0], False)
    scaled = [replace(second, scale=ratio) for ratio in AREAS]
    pairs = [(fit_of(joint.position, drive, False, each), each) for each in scaled]
    best = max(fit.share for fit, _ in pairs)
    # of ratios that explain about the same, the one nearest to equal areas
    like = [pair for pair in pairs if pair[0].share > best - ALIKE * (1.0 - best)]
    fit, against = min(like, key=lambda pair: abs(np.log(pair[1].scale)))
    return replace(joint, fit=fit, others=_without(second.signal, joint.others), against=against)


def _servo(position: Channel, goal: Signal) -> Channel:
    """A commanded position as a drive, in the unit of the position if it has none that fits."""
    if goal.unit is not None and is_position(goal.unit) and is_angle(goal.unit) == is_angle(position.unit):
        return Channel(goal, goal.unit, True)
    asked = "is its scale that of the position?" if position.question else ""
    return Channel(goal, position.unit, False, position.scale, asked)


def with_goal(joint: Joint) -> Joint:
    """Return a joint that follows its commanded position, if one is logged, for a model with a servo."""
    if joint.goal is None:
        return joint
    servo = followed(joint.position, joint.goal) or _servo(joint.position, joint.goal)
    return replace(joint, drive=servo, servo=True, fit=fit_of(joint.position, servo, True), goal=None)


def _without(signal: Signal, signals: Sequence[Signal]) -> tuple[Signal, ...]:
    return tuple(other for other in signals if other is not signal)


def _without_number(address: str) -> str:
    return re.sub(r"\[[^\]]*\]$|\d+", "", address)
