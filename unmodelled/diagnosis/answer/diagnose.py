"""The story of a diagnosis, from top to bottom.

Why a law was named: `judge/judgement.py` compares the evidence of laws, and `judge/classes.py` says which of
them the logs cannot tell apart.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from unmodelled.base.errors import BadInput
from unmodelled.base.extras import missing
from unmodelled.base.progress import say
from unmodelled.diagnosis.answer.augmented import FILE, beyond_the_data, write_augmented
from unmodelled.diagnosis.answer.findings import Findings, note_on, reason_of
from unmodelled.diagnosis.answer.guesses import resting_on_guesses
from unmodelled.diagnosis.answer.judged import judged
from unmodelled.diagnosis.answer.misread import misread
from unmodelled.diagnosis.answer.robot_file import RobotFile, offered
from unmodelled.diagnosis.answer.shorter_windows import shorter_windows
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS, Options
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.result import Diagnosis, LogFault
from unmodelled.diagnosis.data.robot_numbers import with_robot_numbers
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.faults.duplicates import different
from unmodelled.diagnosis.faults.look import without_copies
from unmodelled.diagnosis.faults.outside_forces import outside_forces
from unmodelled.diagnosis.fitting.checks import check, check_families, check_laws, check_seed, check_windows
from unmodelled.diagnosis.gates.refusal import Refusal, given_file
from unmodelled.diagnosis.gates.system_file import reason_against_system
from unmodelled.diagnosis.where.where import where
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import without_own_laws
from unmodelled.effects.own_law import Law as OwnLaw
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import several
from unmodelled.systems.model import System


def findings(
    system: System,
    logs: Logs,
    horizon: float | None = None,
    seed: int = 0,
    workers: int | None = None,
    laws: Sequence[OwnLaw] = (),
    options: Options = DEFAULT_OPTIONS,
    without: Sequence[str] = (),
) -> Findings:
    """Diagnose the gap between a system and experiments (horizon in s), and check all files of the answer."""
    # 1. What cannot be diagnosed is refused before anything is computed.
    check_seed(seed)
    check_families(without)
    logs = several(system, logs)
    horizon = horizon_of(logs, horizon)
    check(system, logs, horizon)

    # 2. A column that is computed from another one measures nothing; a unit, a sign or a clock that is wrong
    #    would be explained by physics.
    system, logs, faults = without_copies(system, logs, horizon, options)
    faulty = any(fault.decides for fault in faults)
    if not faulty:
        check_windows(system, logs, horizon)
        check_laws(laws, system, logs, horizon)

    # 3. to 5. What is missing, and how sure is that? A number of the file may be wrong, too, also of a robot.
    system = with_robot_numbers(system)
    threads = os.cpu_count() or 1 if workers is None else workers
    found = diagnose_gap(system, logs, horizon, seed, threads, say, faults, options, laws, without)

    # 6. Where does the gap enter? Efforts that make the model follow short windows of the measurements say it
    #    without any law. Pushes from outside are told; beside a model that is right, they are a remark.
    place = where(found)
    if found.verdict == "check_logs":
        return Findings(
            found, place, exported=False, laws=tuple(laws), options=options, without=tuple(without)
        )
    alarm = found.verdict != "no_gap"
    pushed = outside_forces(place.left, alarm)
    if pushed is not None and alarm:
        found = replace(found, faults=(*found.faults, pushed))
    remark = [pushed.sentence] if pushed is not None and not alarm else []

    # 7. Nothing leaves that its own reader refuses, that no machine can be, or that predicts whole
    #    runs worse than the file it came from.
    reason, notes = _checked(found)
    refused = [Refusal(FILE, reason, given_file(found))] if reason else []
    robot, more = _robot(found)
    if isinstance(robot, Refusal):
        refused, robot = [*refused, robot], None
    answer = Findings(found, place, not reason, robot, tuple(refused), tuple(laws), options, tuple(without))
    more += [*shorter_windows(found), *resting_on_guesses(found), *without_own_laws(found.system)]
    return answer.with_notes(*notes, *more, *remark)


def diagnose_gap(
    system: System,
    logs: Logs,
    horizon: float,
    seed: int,
    workers: int = 2,
    progress: Callable[[str], None] = lambda _: None,
    faults: tuple[LogFault, ...] | None = None,
    options: Options = DEFAULT_OPTIONS,
    laws: Sequence[Effect] = (),
    without: Sequence[str] = (),
) -> Diagnosis:
    """Find the effects that explain the gap between a system and measured experiments (horizon in s)."""
    if faults is None:
        system, logs, faults = without_copies(system, logs, horizon, options)
    if any(fault.decides for fault in faults):
        return misread(Study(system, logs, horizon, tuple(range(len(logs))), options), seed, faults)
    study = Study(system, different(logs), horizon, (), options, seed, tuple(laws), frozenset(without))
    return judged(study, workers, progress, faults)


def _checked(found: Diagnosis) -> tuple[str, Sequence[str]]:
    """Why the augmented system is not offered, empty if it is, and notes on its whole runs."""
    say("simulate whole experiments with the augmented system")
    with TemporaryDirectory() as folder:
        try:
            write_augmented(found, Path(folder))
        except ValueError as fault:  # not every expression has a form in a file
            return f"it cannot be written ({fault})", ()
        try:
            reason, notes = reason_against_system(found, Path(folder) / FILE)
        except Exception as fault:  # nothing leaves unchecked
            return f"it could not be checked ({reason_of(fault)}): please report this line", ()
    return reason, (*notes, *beyond_the_data(found))


def _robot(found: Diagnosis) -> tuple[RobotFile | Refusal | None, list[str]]:
    """The patched robot file of a system that has one, and a note if it cannot be made."""
    if found.system.robot is None:
        return None, []
    what = f"{found.system.robot.file} was not patched"
    try:
        say("patch the robot file and run it in MuJoCo")
        return offered(found), []
    except BadInput as reason:
        return None, [f"{what}: {reason}"]
    except ModuleNotFoundError as reason:
        return None, [f"{what}: {missing(reason) or reason}"]
    except Exception as fault:
        return None, [note_on(what, fault)]
