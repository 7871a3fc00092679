"""Diagnose the gap between a system and its logs, and read the answer again."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from unmodelled.api.answer import Answer
from unmodelled.base.answers import read_diagnosis
from unmodelled.base.progress import silence
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.diagnosis.answer.findings import SUMMARY
from unmodelled.diagnosis.data.options import Options
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.effects.law_files import LawsGiven, given_laws
from unmodelled.effects.own_law import Law
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.logs.preparation import several
from unmodelled.systems.given import SystemGiven


def diagnose(
    system: SystemGiven,
    logs: LogsGiven,
    horizon: float | None = None,
    seed: int = 0,
    workers: int | None = None,
    laws: LawsGiven | None = None,
    options: Options | Mapping[str, float] | None = None,
    without: Sequence[str] = (),
    quiet: bool = False,
) -> Answer:
    """Diagnose the gap: say which unmodelled effects cause it, where it lies, and how far it shrinks.

    Every experiment is left out once, and gaps are those of experiments left out. Where a fault of
    the logs, such as a unit or a sign, explains most of the gap, that is the answer (verdict check_logs).

    Args:
        system: known physics, or the path of its file; parameters marked `identify` are refitted.
        logs: measured experiments, the path of their folder, or data frames (by id, in a list, or one with
            the column `experiment`); a record that is alone is cut into several.
        horizon: length of the free-run windows, s; default: from the logs, see
            `unmodelled.diagnosis.data.persistence.default_horizon`.
        seed: seed of the random generators; the same seed gives the same answer on one kind of processor;
            default 0.
        workers: number of threads; default: one per core.
        laws: laws of your own that are tried beside those of the library (`Law`), or the path of a file of
            them (laws/1); default none.
        options: the few numbers that decide (`Options`), or those that are not the defaults by name; the
            answer says which were changed.
        without: families of the library that are not tried, such as ["hysteresis"]; default none.
        quiet: whether nothing is said about the progress; default False.

    Returns:
        Verdict, effects with their numbers, where the gap lies, and the augmented system.

    Raises:
        BadInput: when the system, the logs, the horizon, the seed, a law or an option cannot be used.

    Examples:
        The logs of the example have dry friction in the joint, which its system file leaves out:

        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> answer = um.diagnose(system, logs)
        >>> answer.verdict
        'effect'
        >>> answer.effects[0].family, answer.effects[0].port, answer.effects[0].law
        ('coulomb_friction', 'joint', 'F_c*sign(omega)')
        >>> answer.table()[["parameter", "value", "unit"]].round(3)
          parameter  value unit
        0       F_c   0.06  N m

        >>> answer.effects[0].F_c.unit, answer.comparison.query("named").hypothesis.item()
        ('N m', 'Coulomb friction at joint')

        The augmented system is simulated like any other:

        >>> before, after = um.simulate(system, logs), um.simulate(answer.system, logs)
        >>> bool(after.value < 0.1 * before.value)
        True
    """
    limits, started = Options.of(options), time.monotonic()
    own = given_laws(laws)
    file = str(laws) if isinstance(laws, str | Path) else ""
    with silence() if quiet else nullcontext():
        found = findings(*read_inputs(system, logs), horizon, seed, workers, own, limits, without)
    return Answer.of(replace(found, seconds=round(time.monotonic() - started, 1)), file)


def check_law(law: Law, system: SystemGiven, logs: LogsGiven) -> tuple[str, ...]:
    """Check a law of your own as those of the library are checked, at every place of a system.

    At size zero it changes nothing; its numbers are parameters with the units that the formula needs, within
    bounds; the system with it is written and read back.

    Args:
        law: the law.
        system: known physics, or the path of its file.
        logs: measured experiments, which say how large the quantities of the machine are.

    Returns:
        Names of the places where the law can act.

    Raises:
        BadInput: when the law fails a check, with what is wrong, or can act nowhere.

    Examples:
        >>> import unmodelled as um
        >>> swing = um.Law("swing", "k*sin(2*x)", {"k": {"unit": "N m", "plausible": 0.1}})
        >>> um.check_law(swing, *um.example("pendulum"))
        ('joint',)
    """
    known, measured = read_inputs(system, logs)
    measured = several(known, measured)
    given_laws([law])
    return law.check(known, Study.of(known, measured, horizon_of(measured, None), 0).scales)


def read_answer(folder: Path | str) -> Answer:
    """Read the answer that `Answer.save` or the verb `diagnose` wrote.

    Args:
        folder: folder of the answer, with diagnosis.json.

    Returns:
        The answer as it was written: verdict, effects, tables, figures and the augmented system.

    Raises:
        BadInput: when the folder holds no answer of this version, or an entry of it was damaged.

    Examples:
        >>> import tempfile, unmodelled as um
        >>> folder = f"{tempfile.mkdtemp()}/answer"
        >>> um.diagnose(*um.example("pendulum")).save(folder)
        ()
        >>> answer = um.read_answer(folder)
        >>> answer.verdict, answer.effects[0].law
        ('effect', 'F_c*sign(omega)')
        >>> answer.system.port("joint").law
        F_c*tanh(omega/v_c)
    """
    return Answer(Path(folder), read_diagnosis(Path(folder) / SUMMARY))
