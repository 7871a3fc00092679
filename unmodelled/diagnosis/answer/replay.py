"""Free runs of robot files in MuJoCo along the held-out experiments: before and after the diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from unmodelled.diagnosis.answer.take_home import TakeHome
from unmodelled.diagnosis.data.gap import Off
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.fitting.free_runs import replayed
from unmodelled.engine.robot.mujoco_runs import RobotInMujoco
from unmodelled.engine.robot.supplement import Supplement


@dataclass(frozen=True)
class Replayed:
    """A robot file in MuJoCo beside the measured outputs of the held-out experiments."""

    gap: float  # root mean square error over free-run windows, in standard deviations of the outputs
    units: Mapping[str, Off]  # by name of the output


@dataclass(frozen=True)
class Replay:
    """Robot files in MuJoCo along the held-out experiments."""

    given: Replayed  # the file as given
    patched: Replayed  # the patched file alone
    supplemented: Replayed | None  # with its supplement; None if it has none

    @property
    def final(self) -> Replayed:
        """The patched file with all that belongs to it."""
        return self.supplemented or self.patched


def replay(diagnosis: Diagnosis, found: TakeHome) -> Replay:
    """Run the given and the patched robot file in MuJoCo along the held-out experiments.

    Windows start at the measured states, whole runs at the first one. The given file is driven as the system
    file says, and the patched one with what the diagnosis says of inputs and sensors.
    """
    robot = diagnosis.system.robot
    assert robot is not None
    given = _run(diagnosis, diagnosis.known, found, robot.text, Supplement())
    after = diagnosis.augmented
    alone = _run(diagnosis, after, found, found.text, Supplement())
    full = _run(diagnosis, after, found, found.text, found.supplement) if found.supplement else None
    return Replay(given, alone, full)


def _run(
    diagnosis: Diagnosis, model: JudgedModel, found: TakeHome, text: str, supplement: Supplement
) -> Replayed:
    controls = [name for names in found.efforts.controls.values() for name in names]
    applied = found.efforts.applied(model.system)
    robot = diagnosis.system.robot
    assert robot is not None
    known = {state.name for state in model.system.states}
    states = {name: state for name, state in found.activations.items() if state in known}
    backend = RobotInMujoco(text, found.name, controls, applied, robot.locked, supplement, states)
    gap, units = replayed(backend, model.system, model.logs, diagnosis.horizon, diagnosis.held_out)
    return Replayed(gap, units)
