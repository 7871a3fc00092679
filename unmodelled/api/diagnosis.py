"""Diagnose the gap between a system and its logs, and read the answer again."""

from __future__ import annotations

from pathlib import Path

from unmodelled.api.answer import Answer
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.diagnosis.answer.findings import SUMMARY
from unmodelled.diagnosis.answer.summary import SCHEMA
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.systems.given import SystemGiven


def diagnose(
    system: SystemGiven,
    logs: LogsGiven,
    horizon: float | None = None,
    seed: int = 0,
    workers: int | None = None,
) -> Answer:
    """Diagnose the gap: say which unmodelled effects cause it, where it lies, and how far it shrinks.

    A quarter of the experiments takes no part in fitting or choosing; all gaps are theirs. Where a fault of
    the logs, such as a unit or a sign, explains most of the gap, that is the answer (verdict check_logs).

    Args:
        system: known physics, or the path of its file; parameters marked `identify` are refitted.
        logs: measured experiments, the path of their folder, or data frames (by id, in a list, or one with
            the column `experiment`); a record that is alone is cut into several.
        horizon: length of the free-run windows, s; default: from the logs, see
            `unmodelled.diagnosis.data.persistence.default_horizon`.
        seed: seed of the random generators; the same seed gives the same answer; default 0.
        workers: number of threads; default: one per core.

    Returns:
        Verdict, effects with their numbers, where the gap lies, and the augmented system.

    Raises:
        BadInput: when the system, the logs, the horizon or the seed cannot be used.

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

        The augmented system is simulated like any other:

        >>> before, after = um.simulate(system, logs), um.simulate(answer.system, logs)
        >>> bool(after.value < 0.1 * before.value)
        True
    """
    return Answer.of(findings(*read_inputs(system, logs), horizon, seed, workers))


def read_answer(folder: Path | str) -> Answer:
    """Read the answer that `Answer.save` or the verb `diagnose` wrote.

    Args:
        folder: folder of the answer, with diagnosis.json.

    Returns:
        The answer as it was written: verdict, effects, tables, figures and the augmented system.

    Raises:
        BadInput: when the folder holds no answer of this version.

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
    content = read_json(file := Path(folder) / SUMMARY)
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise BadInput(f"{file}: is no answer of this version (schema {SCHEMA}): diagnose again")
    return Answer(Path(folder), content)
