"""The robot file of a diagnosed system with identified numbers, and effects that its format can say."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import copysign, inf
from pathlib import Path

import sympy as sp

from unmodelled.diagnosis.answer.augmented import FILE
from unmodelled.diagnosis.data.result import DiagnosedEffect
from unmodelled.diagnosis.gates.robot_numbers import of_parameters
from unmodelled.effects.added import Added
from unmodelled.engine.robot.supplement import QUANTITIES, Supplement
from unmodelled.systems import grammar, syntax
from unmodelled.systems.functions import lookup
from unmodelled.systems.model import TIME, System, symbol
from unmodelled.systems.printing import printed
from unmodelled.systems.procedure import evaluated
from unmodelled.systems.robot.actuators import activation
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.efforts import Efforts
from unmodelled.systems.robot.numbers import Key, differing, numbers, servo_gains, unit_of
from unmodelled.systems.robot.patch import Patched, patched
from unmodelled.systems.scope import Scope, Value

#: Stands for a limit that a file does not have, in the arithmetic of laws.
_FAR = 1e100


@dataclass(frozen=True)
class Change:
    """Number of the robot file that the patched file changes."""

    element: str  # joint, actuator or body
    quantity: str
    unit: str  # SI
    given: float  # infinite for a limit that is missing
    patched: float


@dataclass(frozen=True)
class Missing:
    """Part of the augmented system that the patched robot file does not hold."""

    what: str  # effect or number, in words
    reason: str  # and what to do
    supplemented: bool  # whether the supplement holds it


@dataclass(frozen=True)
class TakeHome:
    """Patched robot file, and what belongs to it."""

    name: str  # of the file
    text: str
    changes: tuple[Change, ...]  # numbers that differ from the file as given
    supplement: Supplement  # numbers and forces for MuJoCo that the file cannot say
    missing: tuple[Missing, ...]  # parts of the augmented system that the file does not hold
    efforts: Efforts  # on the joints in the system as given
    #: State that is the activation of an actuator of the file, by the input of the actuator.
    activations: Mapping[str, str]


def take_home(given: System, system: System, effects: Sequence[DiagnosedEffect]) -> TakeHome:
    """Return the robot file of a system, patched to say what the augmented system says."""
    robot = given.robot
    assert robot is not None
    name = Path(robot.file).name
    efforts = Efforts(given, compiled(robot.text, name))
    values = {p.name: p.value for p in system.parameters}
    written = _written(effects, efforts, values)
    file = patched(robot.text, name, _wanted(efforts, written, values))
    forces, silent = _forces(system, efforts, written)
    beside: dict[str, dict[str, float]] = {}
    for (element, quantity), value in file.missing.items():
        if quantity in QUANTITIES:
            beside.setdefault(element, {})[quantity] = value
    rates = _memory(system, forces.values(), efforts)
    used = {str(s) for e in (*forces.values(), *rates.values()) for s in e.free_symbols}
    texts, memory = (
        {name: printed(e, [str(s) for s in e.free_symbols], []) for name, e in each.items()}
        for each in (forces, rates)
    )
    starts = {s.name: float(s.initial) for s in system.states if s.name in rates and s.initial.is_number}
    supplement = Supplement(beside, texts, {n: v for n, v in values.items() if n in used}, memory, starts)
    return TakeHome(
        *(name, file.text, tuple(_changes(efforts.robot, file.text, name)), supplement),
        missing=(
            *_missing(efforts.robot, file),
            *(m for e in written for m in e.missing(file, forces)),
            *_laws(given, file, forces),
            *silent,
        ),
        efforts=efforts,
        activations=_activations(efforts.robot, system, written),
    )


def _activations(robot: Robot, system: System, effects: Sequence[_Written]) -> dict[str, str]:
    lags = {e.added.place.name: name for e in effects if e.element for name in e.added.memory}
    own = {f"u_{a.name}": activation(a.name) for a in robot.actuators}
    return lags | {name: state for name, state in own.items() if symbol(state) in system.x}


def _changes(given: Robot, text: str, name: str) -> Iterator[Change]:
    before, after = numbers(given), numbers(compiled(text, name))
    follows = servo_gains(given, after)  # what a servo's stiffness or damping says already
    for (element, quantity), value in differing(after, before).items():
        if follows.get((element, quantity)) == value:
            continue
        unit = unit_of(given, (element, quantity))
        yield Change(element, quantity, unit, before[element, quantity], value)


def _missing(robot: Robot, file: Patched) -> Iterator[Missing]:
    for (element, quantity), value in file.missing.items():
        held, unit = quantity in QUANTITIES, unit_of(robot, (element, quantity))
        reason = f"{file.format} has no attribute for it here" + (
            "" if held else ": set it where you load the file"
        )
        yield Missing(f"{element}.{quantity} = {value:.4g} {unit}".removesuffix(" 1"), reason, held)


def _laws(given: System, file: Patched, forces: Mapping[str, sp.Expr]) -> Iterator[Missing]:
    """Laws that the system file gives to ports."""
    for port in given.ports:
        if port.law is not None:
            what = f"the law of the port {port.name} in the system file"
            yield Missing(what, f"{file.format} has no law of the user", port.name in forces)


def _wanted(efforts: Efforts, effects: Sequence[_Written], values: Mapping[str, float]) -> dict[Key, float]:
    """All numbers of the file: identified ones, and those that say effects."""
    robot, wanted = efforts.robot, of_parameters(efforts, values)
    # the equations have no dry friction of the file: all that there is was found by the diagnosis
    wanted |= {(joint, "frictionloss"): 0.0 for joint in efforts.moving}
    wanted |= servo_gains(robot, wanted)
    # an effect acts on what the effects before it make of an input
    for effect in sorted(effects, key=lambda effect: len(effect.added.system.parameters)):
        wanted |= effect.said(wanted)
    return wanted


def _memory(system: System, forces: Iterable[sp.Expr], efforts: Efforts) -> dict[str, sp.Expr]:
    """Rates of the states that forces remember by: those that are no motion of the robot."""
    motion = {symbol(f"{s}_{joint}") for s in ("q", "qd") for joint in efforts.joints}
    behind = system.states_behind(forces, motion)
    return {system.states[k].name: system.dynamics[k] for k in behind}


def _forces(
    system: System, efforts: Efforts, effects: Sequence[_Written]
) -> tuple[dict[str, sp.Expr], list[Missing]]:
    """Efforts on joints that the file does not make, and those that a supplement cannot make either."""
    driven, made = efforts.of(system, laws=False), efforts.of_file(system)
    whole = efforts.of(system)
    # a law that grows with the load also needs what the file says of the actuator that makes the load
    off = {symbol(n): sp.S.Zero for e in effects if e.absent or not e.at_actuator for n in e.off}
    off_in_drives = off | {symbol(n): sp.S.Zero for e in effects for n in e.off}
    known = {TIME, *system.p, *(symbol(f"applied_{joint}") for joint in efforts.joints)}
    known |= {symbol(f"{s}_{joint}") for s in ("q", "qd") for joint in efforts.joints}
    known |= {symbol(name) for inputs in efforts.controls.values() for name in inputs}
    forces, silent = {}, []
    for joint in efforts.joints:
        laws, drive = whole[joint] - driven[joint], driven[joint] - made[joint]
        force = laws.xreplace(off) + drive.xreplace(off_in_drives)
        if force == 0:
            continue
        rates = _memory(system, [force], efforts)
        parts = [force, *rates.values()]
        foreign = sorted({str(s) for e in parts for s in e.free_symbols - known} - rates.keys())
        if foreign or any(e.has(evaluated, lookup) for e in parts):
            what = foreign[0] if foreign else "an acceleration or a table"
            reason = f"it depends on {what}, which MuJoCo does not know: simulate {FILE}"
            silent.append(Missing(f"further effort on {joint}", reason, False))
        else:
            forces[joint] = force
    return forces, silent


def _written(
    effects: Sequence[DiagnosedEffect], efforts: Efforts, values: Mapping[str, float]
) -> list[_Written]:
    alone = [_Written(found, efforts, values) for found in effects]
    forced = {e.added.place for e in alone if e.at_actuator and not e.absent and e.element is None}
    return [replace(e, crowded=e.added.place in forced) for e in alone]


@dataclass(frozen=True)
class _Written:
    """A diagnosed effect, as a robot file or its supplement says it."""

    found: DiagnosedEffect
    efforts: Efforts
    values: Mapping[str, float]
    #: Whether another effect at the same input is none that a file can say: what both make of it is a force.
    crowded: bool = False

    @property
    def added(self) -> Added:
        return self.found.added

    @property
    def element(self) -> str | None:
        """Joint or actuator whose numbers say the effect; None if none do."""
        place = self.added.place
        if not self.added.robot or self.differs or self.crowded:
            return None
        if place.kind == "port":
            return place.name if place.name in self.efforts.joints else None
        return place.name.removeprefix("u_") if self.controlled else None

    @property
    def at_actuator(self) -> bool:
        """Whether the effect is at an input."""
        return self.added.place.kind == "actuator"

    @property
    def differs(self) -> bool:
        """Whether the effect is not the same in every experiment."""
        added = self.added
        return bool(added.place.factor or added.per_experiment or added.columns)

    @property
    def controlled(self) -> bool:
        """Whether the effect is at the input of an actuator of the file."""
        return any(self.added.place.name in inputs for inputs in self.efforts.controls.values())

    def said(self, wanted: Mapping[Key, float]) -> dict[Key, float]:
        """Numbers of the file that say the effect."""
        if self.element is None:
            return {}
        own = {quantity: value for (name, quantity), value in wanted.items() if name == self.element}
        finite = {q: value if abs(value) < _FAR else copysign(_FAR, value) for q, value in own.items()}
        of_law = {n: self.values[n] for n in (*self.added.amplitudes, *self.added.shapes)}
        scope = Scope({name: Value(sp.Float(value)) for name, value in {**finite, **of_law}.items()})
        found = {}
        for quantity, text in self.added.robot.items():
            value = float(grammar.parse(text, scope, self.added.family))
            found[self.element, quantity] = value if abs(value) < 1e-3 * _FAR else copysign(inf, value)
        return found

    @property
    def off(self) -> tuple[str, ...]:
        """Amplitudes that the supplement does not contain: the file says them, or nothing does."""
        if self.absent:
            return self.added.amplitudes
        if self.element is None:
            return ()
        words = {word for text in self.added.robot.values() for word in syntax.names(text)}
        return tuple(n for n in self.added.amplitudes if n in words or n in self.added.shares)

    def missing(self, file: Patched, forces: Mapping[str, sp.Expr]) -> Iterator[Missing]:
        """Yield what the file does not hold of the effect."""
        others = [other.title for other in self.found.indistinguishable if other.robot]
        alike = (
            f"; the logs cannot tell it from {others[0]}, which a robot has a number for" if others else ""
        )
        if self.absent:
            yield Missing(self.added.title, self.absent + alike, False)
        elif rest := [n for n in self.added.amplitudes if n not in self.off]:
            part = f"{', '.join(rest)} of {self.added.title}" if self.off else self.added.title
            held = any(symbol(n) in force.free_symbols for n in rest for force in forces.values())
            yield Missing(part, f"{file.format} has no such law{'' if held else alike}", held)

    @property
    def absent(self) -> str:
        """Why neither the file nor its supplement holds the effect; empty if one of them can."""
        delays = [self.found.estimates[n].value for n in self.added.delays]
        if self.added.place.kind == "sensor":
            return "the sensor is no part of the robot: correct what it shows"
        if delays:
            return f"robot files have no delay: apply the input {delays[0]:.3g} s later"
        if self.differs or self.added.place.kind == "parameter":
            return f"it changes with time or between experiments: simulate {FILE}"
        if self.added.memory and self.at_actuator and self.element is None:
            return f"it has states of its own: simulate {FILE}"
        if self.at_actuator and not self.controlled:
            return "the input is not one of the file: change the drive that you compute from it"
        return ""
