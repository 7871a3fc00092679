"""Damaged logs are the answer before any search; faultless twins of machines with dry friction are not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import unmodelled as um
from tests.inspection.machines import PENDULUM, SCREW, Frames, Machine, spiked
from tests.machines.folders import Array, system_of
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.search.log_faults import without_copies
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Machines with a dry friction that their system files leave out.
SWING = replace(
    PENDULUM,
    rates=lambda x, u: np.array(
        [x[1], (u - 2.0 * np.sin(x[0]) - 0.05 * x[1] - 0.06 * np.tanh(100.0 * x[1])) / 0.05]
    ),
)
SLIDE = replace(
    SCREW, rates=lambda x, u: np.array([x[1], (u - 40.0 * x[1] - 4.0 * np.tanh(200.0 * x[1])) / 12.0])
)
#: Samples for which a command is held.
HELD = 20


def scaled(columns: str, factor: float) -> Callable[[Frames], Frames]:
    return lambda frames: {
        name: f.assign(**{column: factor * f[column] for column in columns.split()})
        for name, f in frames.items()
    }


def swapped(column: str) -> Callable[[Frames], Frames]:
    def spoil(frames: Frames) -> Frames:
        names = list(frames)
        own = dict(zip(names, [*names[1:], names[0]], strict=True))
        return {name: f.assign(**{column: frames[own[name]][column]}) for name, f in frames.items()}

    return spoil


def held(column: str, samples: int) -> Callable[[Frames], Frames]:
    """Log a channel only every so many samples."""
    return lambda frames: {
        name: f.assign(**{column: f[column].to_numpy()[np.arange(len(f)) // samples * samples]})
        for name, f in frames.items()
    }


def as_measurement(output: str, command: str) -> Callable[[Frames], Frames]:
    return lambda frames: {name: f.assign(**{output: 0.01 * f[command] - 2.0}) for name, f in frames.items()}


#: Machine, damage, fault with its channels and whether it decides.
DAMAGED = {
    "electrical speed": (SWING, scaled("tacho", 4.0), "slope", ("tacho",), True),
    "time in millions of seconds": (SLIDE, scaled("t", 1e-6), "megaseconds", ("t",), True),
    "angles in nanoradians": (SWING, scaled("phi tacho", 1e9), "nano", None, True),
    "inputs of other runs": (SWING, swapped("torque"), "other_run", ("torque",), True),
    "command logged rarely": (SWING, held("torque", HELD), "slow", ("torque",), True),
    "no command": (SWING, scaled("torque", 0.0), "constant", ("torque",), True),
    "command as measurement": (SLIDE, as_measurement("s", "force"), "command", ("s",), True),
    "command as one of two": (SWING, as_measurement("tacho", "torque"), "command", ("tacho",), False),
}


def found(machine: Machine, frames: Frames, folder: Path) -> tuple[System, Logs, tuple[LogFault, ...]]:
    system = system_of(machine.system, folder)
    logs = Logs.from_frames(frames, system)
    return without_copies(system, logs, default_horizon(logs))


@pytest.mark.long
@pytest.mark.parametrize("case", DAMAGED)
def test_a_damage_is_the_answer(case: str, tmp_path: Path) -> None:
    machine, spoil, problem, channels, decides = DAMAGED[case]
    system, logs, (fault,) = found(machine, spoil(machine.frames(3, runs=6)), tmp_path)
    assert (fault.problem, fault.decides) == (problem, decides), fault.sentence
    assert channels is None or fault.channels == channels
    if not decides:
        assert logs.outputs == ("phi",) == tuple(output.name for output in system.outputs)


def _stairs(u: Array) -> Array:
    return u[:, np.arange(u.shape[1]) // HELD * HELD]


TWINS = {
    "swing": lambda: (SWING, SWING.frames(3, runs=6)),
    "slide": lambda: (SLIDE, SLIDE.frames(3, runs=6)),
    "command that is really held": lambda: (SWING, replace(SWING, inputs=_stairs).frames(3, runs=6)),
    "free motion": lambda: (SWING, replace(SWING, inputs=np.zeros_like, start=1.0).frames(3, runs=6)),
    "sensor with a gain of 1.3": lambda: (SWING, scaled("tacho", 1.3)(SWING.frames(3, runs=6))),
}


@pytest.mark.long
@pytest.mark.parametrize("twin", TWINS)
def test_a_faultless_twin_is_diagnosed(twin: str, tmp_path: Path) -> None:
    _, _, told = found(*TWINS[twin](), tmp_path)
    assert not any(fault.decides for fault in told), told


@pytest.mark.long
@pytest.mark.parametrize("garbage", [0.0, 2.0])
def test_garbage_does_not_change_the_effect(garbage: float, tmp_path: Path) -> None:
    """The dry friction of the pendulum is named with and without spikes in its angle."""
    system = system_of(SWING.system, tmp_path)
    frames = SWING.frames(4, runs=6, samples=800)
    logs = Logs.from_frames(spiked(frames, "phi", garbage) if garbage else frames, system)
    assert any("spikes" in note for note in logs.notes) == bool(garbage)
    answer = um.diagnose(system, logs, workers=1)
    assert answer.verdict == "effect"
    assert answer.effects[0].family == "coulomb_friction"
    assert answer.table()["value"][0] == pytest.approx(0.06, rel=0.15)
