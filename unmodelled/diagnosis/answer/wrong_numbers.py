"""A number of the file that went through a wrong unit: gains per degree, damping per 1/min, weights in kgf.

One number of the file, times the factor of a usual mistake, is compared with all effects of an answer.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.base.wording import FILE_NUMBER
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.remark import quantity
from unmodelled.diagnosis.data.result import Diagnosis, LogFault
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.efforts import Efforts
from unmodelled.systems.robot.properties import properties

Array = NDArray[np.float64]

#: Usual mistakes by their factor.
MISTAKES = {
    180.0 / np.pi: "degrees instead of radians",
    2.0 * np.pi: "turns instead of radians",
    30.0 / np.pi: "1/min instead of rad/s",
    60.0: "minutes instead of seconds",
    9.80665: "kilograms instead of newtons",
    1000.0: "thousandths instead of the unit",
}
#: Quantities of joints and drives of a robot file that are tried, where they are not zero.
OF_ROBOTS = ("kp", "kv", "damping", "stiffness", "gain", "gear", "armature")
#: Share of the squared error that the right number explains at least.
EXPLAINS = 0.95
#: Simulated samples of a trial, about, and numbers with a factor at most that are simulated together.
SAMPLES, TOGETHER = 2000, 64


def wrong_number(found: Diagnosis) -> LogFault | None:
    """Return a warning of a number of the file that is off by the factor of a usual mistake, or None.

    Alone it explains nearly all of the error of the re-identified physics, and no less than all named
    effects do. No verdict depends on it.

    Args:
        found: diagnosis with a fitted model.
    """
    if found.verdict == "no_gap":
        return None
    try:
        system = _with_numbers(found.reidentified.system)
    except (BadInput, OSError, ValueError):  # a file that has moved, or names its model in another way
        return None
    names = [p.name for p in system.parameters if p.value != 0.0]
    if not names:
        return None
    trials = [(name, factor) for name in names for m in MISTAKES for factor in (m, 1.0 / m)]
    logs = found.reidentified.logs  # with the constants of numbers that differ between experiments
    sensors = Sensors(logs)
    latest = max(output.delay for output in found.augmented.system.outputs)
    recording = Recording.of(logs, found.horizon, latest=latest, sensors=sensors)
    recording = recording.thinned(max(2, round(SAMPLES / recording.steps.mean())))
    simulation = Simulation(system, recording)
    before, squares = (
        _square(simulation, [{}], found)[0],
        _square(simulation, _changes(system, trials), found),
    )
    named = replace(recording, logs=found.augmented.logs)
    after = _square(Simulation(found.augmented.system, named), [{}], found)[0]
    best = int(np.argmin(squares))
    if squares[best] > min((1.0 - EXPLAINS) * before, after):
        return None
    name, factor = trials[best]
    return _warning(system, name, factor, np.sqrt([before, squares[best]]))


def _with_numbers(system: System) -> System:
    """The system, of a robot with the numbers of its joints and drives as parameters."""
    if system.robot is None or not system.source:
        return system
    efforts = Efforts(system, compiled(system.robot.text, system.robot.file))
    some = [p for p in properties(efforts.robot, efforts.tree) if p.quantity in OF_ROBOTS and p.value]
    names = ", ".join(f'"{p.element}.{p.quantity}"' for p in some)
    text = Path(system.source).read_text(encoding="utf-8")
    (model,) = re.findall(r"^model:\s*[\"']?([^\"'#\n]+?)[\"']?\s*(?:#.*)?$", text, re.MULTILINE)
    own = re.sub(r"^identify:\s*\[", f"identify: [{names}, ", text, count=1, flags=re.MULTILINE)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "system.yaml"
        path.write_text(own if own != text else f"{text.rstrip()}\nidentify: [{names}]\n", encoding="utf-8")
        beside = Path(folder) / model
        beside.parent.mkdir(parents=True, exist_ok=True)
        beside.write_text(system.robot.text, encoding="utf-8")
        grown = read_system(path)
    known = {p.name: p.value for p in system.parameters}
    return grown.with_values({p.name: known[p.name] for p in grown.parameters if p.name in known})


def _changes(system: System, trials: list[tuple[str, float]]) -> list[dict[str, float]]:
    values = {p.name: p.value for p in system.parameters}
    return [{name: factor * values[name]} for name, factor in trials]


def _square(simulation: Simulation, changes: list[dict[str, float]], found: Diagnosis) -> Array:
    """Mean square errors (changes,), in variances of the outputs, of the system with some values changed."""
    return np.concatenate(list(_squares(simulation, changes, found)))


def _squares(simulation: Simulation, changes: list[dict[str, float]], found: Diagnosis) -> Iterator[Array]:
    system, recording = simulation.system, simulation.recording
    substeps = max(found.known.gap.substeps, found.augmented.gap.substeps)
    for first in range(0, len(changes), TOGETHER):
        some = changes[first : first + TOGETHER]
        values = np.stack([np.array(system.with_values(change).values) for change in some])
        runs = simulation(values[None], substeps=substeps)
        with np.errstate(all="ignore"):
            off = np.abs(runs.y - runs.measured) / recording.scale
        off = np.where(off <= LARGEST_ERROR, off, LARGEST_ERROR)
        yield np.mean(off.swapaxes(1, 2)[recording.counted] ** 2, axis=(0, 2))


def _warning(system: System, name: str, factor: float, errors: Array) -> LogFault:
    (parameter,) = (p for p in system.parameters if p.name == name)
    mistake = MISTAKES.get(factor) or MISTAKES[1.0 / factor]
    times = f"{max(factor, 1.0 / factor):.3g} times too {'small' if factor > 1.0 else 'large'}"
    right = quantity(factor * parameter.value, parameter.unit)
    sentence = (
        f"{name} = {quantity(parameter.value, parameter.unit)} of the file looks {times}, as by {mistake}: "
        f"with {right}, the model's error falls from {errors[0]:.2g} to {errors[1]:.2g} standard deviations, "
        "without any effect. Check this number first, then diagnose again."
    )
    share = 1.0 - float((errors[1] / errors[0]) ** 2)
    return LogFault((name,), FILE_NUMBER, share, (), sentence, False)
