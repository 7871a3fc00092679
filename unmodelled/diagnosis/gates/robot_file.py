"""The gate of a robot file that a diagnosis patches, with its supplement."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.data.gap import Off
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.gates.robot_numbers import impossible_robot
from unmodelled.diagnosis.gates.whole_runs import worse
from unmodelled.engine.robot.supplement import Supplement
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.numbers import numbers


def reason_against_numbers(robot: Robot, text: str, name: str, supplement: Supplement) -> str:
    """Return why a patched robot file cannot be read back, or which of its numbers is impossible."""
    try:
        wanted = numbers(compiled(text, name))
        with TemporaryDirectory() as folder:
            supplement.write(path := Path(folder, "supplement.json"))
            beside = Supplement.read(path).numbers
    except BadInput as fault:
        return f"it cannot be read back ({fault}); please report this line"
    wanted |= {(e, quantity): value for e, own in beside.items() for quantity, value in own.items()}
    return impossible_robot(robot, wanted)


def reason_against_runs(
    diagnosis: Diagnosis, gaps: tuple[float, float], before: Mapping[str, Off], after: Mapping[str, Off]
) -> str:
    """Return why the free runs of a patched robot file, before and after, are no improvement."""
    old, new = gaps
    if not new < old:
        return f"its gap in MuJoCo is {new:.3g} standard deviations, and {old:.3g} with the file as given"
    whole = [{name: each.whole_run for name, each in units.items()} for units in (before, after)]
    recording = Recording.whole(diagnosis.known.logs, diagnosis.held_out)
    return worse(whole[0], whole[1], recording, {name: each.unit for name, each in before.items()})
