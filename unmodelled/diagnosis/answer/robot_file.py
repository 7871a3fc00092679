"""The robot file of an answer: patched, run in MuJoCo, and what the answer says of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from unmodelled.base.files import replacing
from unmodelled.diagnosis.answer.augmented import with_right_numbers
from unmodelled.diagnosis.answer.take_home import TakeHome, take_home
from unmodelled.diagnosis.data.gap import Off
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.fitting.free_runs import replayed
from unmodelled.diagnosis.gates.effect_numbers import impossible_numbers
from unmodelled.diagnosis.gates.refusal import Refusal
from unmodelled.diagnosis.gates.robot_file import reason_against_numbers, reason_against_runs
from unmodelled.diagnosis.gates.robot_numbers import impossible_parameters
from unmodelled.engine.robot.mujoco_runs import RobotInMujoco
from unmodelled.engine.robot.supplement import Supplement

#: Folder of the patched file in the folder of an answer.
FOLDER = "robot"


@dataclass(frozen=True)
class Replayed:
    """A robot file in MuJoCo beside the measured outputs of the experiments."""

    gap: float  # root mean square error over free-run windows, in standard deviations of the outputs
    units: Mapping[str, Off]  # by name of the output


@dataclass(frozen=True)
class Replay:
    """Robot files in MuJoCo along the experiments."""

    given: Replayed  # the file as given
    patched: Replayed  # the patched file alone
    supplemented: Replayed | None  # with its supplement; None if it has none

    @property
    def final(self) -> Replayed:
        """The patched file with all that belongs to it."""
        return self.supplemented or self.patched


@dataclass(frozen=True)
class RobotFile:
    """Patched robot file with its free runs in MuJoCo."""

    found: TakeHome
    replay: Replay  # along the experiments

    @classmethod
    def of(cls, diagnosis: Diagnosis) -> RobotFile:
        """Return the patched robot file of a diagnosis."""
        effects = diagnosis.effects
        right = with_right_numbers(diagnosis.augmented.system, effects)
        laws = tuple(found for found in effects if not found.added.is_other_value)
        found = take_home(diagnosis.system, right, laws)
        return cls(found, _replay(diagnosis, found))

    def reason_against(self, diagnosis: Diagnosis) -> str:
        """Return why the file may not leave; empty if it may.

        The file and its supplement are read back and have possible numbers. In MuJoCo, they predict windows
        of the experiments better than the given file, and whole runs no worse.
        """
        found, run = self.found, self.replay
        if not found.changes and not found.supplement:
            return "no number of it differs"
        return reason_against_numbers(
            found.efforts.robot, found.text, found.name, found.supplement
        ) or reason_against_runs(diagnosis, (run.given.gap, run.final.gap), run.given.units, run.final.units)

    @property
    def file(self) -> str:
        """Name of the patched file in the folder of an answer."""
        return f"{FOLDER}/{self.found.name}"

    @property
    def supplement(self) -> str | None:
        """Name of the file of the supplement in the folder of an answer; None if there is none."""
        return f"{FOLDER}/{Path(self.found.name).stem}_supplement.json" if self.found.supplement else None

    def write(self, folder: Path) -> None:
        """Write the patched file and its supplement."""
        (folder / FOLDER).mkdir()
        with replacing(folder / self.file) as temporary:
            temporary.write_text(self.found.text, encoding="utf-8")
        if self.supplement is not None:
            self.found.supplement.write(folder / self.supplement)

    @property
    def content(self) -> dict[str, Any]:
        """Return the entry `robot` of diagnosis.json."""
        runs = {name: _errors(run) for name, run in vars(self.replay).items() if run is not None}
        return {
            "file": self.file,
            "supplement": self.supplement,
            "changes": [asdict(change) for change in self.found.changes],
            "missing": [asdict(part) for part in self.found.missing],
            "replay": {**runs, "improves": True},
        }


def offered(diagnosis: Diagnosis) -> RobotFile | Refusal:
    """Return the patched robot file of a diagnosis, or why it is not offered."""
    robot = diagnosis.system.robot
    assert robot is not None
    name = Path(robot.file).name
    reason = impossible_numbers(diagnosis) or impossible_parameters(diagnosis.augmented.system)
    if not reason:
        file = RobotFile.of(diagnosis)
        reason = file.reason_against(diagnosis)
        if not reason:
            return file
    return Refusal(f"{FOLDER}/{name}", reason, name)


def _errors(run: Replayed) -> dict[str, Any]:
    units = {
        name: {"unit": off.unit, "at_horizon": off.at_horizon, "whole_run": off.whole_run}
        for name, off in run.units.items()
    }
    return {"gap": run.gap, "units": units}


def _replay(diagnosis: Diagnosis, found: TakeHome) -> Replay:
    """Free runs of the given and the patched robot file in MuJoCo along the experiments.

    Windows start at the measured states, whole runs at the first one. The given file is driven as the system
    file says, and the patched one with what the diagnosis says of inputs and sensors.
    """
    robot, known, after = diagnosis.system.robot, diagnosis.known, diagnosis.augmented
    assert robot is not None
    controls = [name for names in found.efforts.controls.values() for name in names]

    def run(model: JudgedModel, text: str, supplement: Supplement) -> Replayed:
        applied, own = found.efforts.applied(model.system), {state.name for state in model.system.states}
        states = {name: state for name, state in found.activations.items() if state in own}
        backend = RobotInMujoco(text, found.name, controls, applied, robot.locked, supplement, states)
        return Replayed(*replayed(backend, model.system, model.logs, diagnosis.horizon, diagnosis.held_out))

    full = run(after, found.text, found.supplement) if found.supplement else None
    return Replay(run(known, robot.text, Supplement()), run(after, found.text, Supplement()), full)
