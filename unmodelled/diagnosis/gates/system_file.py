"""The gate of a system file that a diagnosis writes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.fitting.own_numbers import SEEN
from unmodelled.diagnosis.gates.effect_numbers import impossible_numbers
from unmodelled.diagnosis.gates.robot_numbers import impossible_parameters
from unmodelled.diagnosis.gates.whole_runs import WholeRuns, worse
from unmodelled.logs.preparation import prepared_for
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system


def reason_against_system(diagnosis: Diagnosis, file: Path) -> tuple[str, Sequence[str]]:
    """Return why a system file of the augmented model may not leave.

    The file is read back, works on new logs, has possible numbers, and predicts the held-out experiments from
    their start to their end no worse than the given system, in every output. Where experiments have numbers
    of their own, only the part counts to which these were not fitted.
    """
    try:
        system = read_system(file)
    except BadInput as fault:
        problem = str(fault).removeprefix(f"{file}: ")
        return f"it cannot be read back ({problem}); please report this line", ()
    reason = (
        _needs(diagnosis.system, system) or impossible_numbers(diagnosis) or impossible_parameters(system)
    )
    if reason:
        return reason, ()
    held_out, known = diagnosis.held_out, diagnosis.known
    before = WholeRuns.of(diagnosis.system, known.logs, known.gap.substeps, held_out)
    after = WholeRuns.of(system, prepared_for(system, diagnosis.logs), diagnosis.augmented.gap.substeps)
    units = {output.name: output.unit for output in system.outputs}
    # numbers of their own were fitted to the first part of the held-out experiments
    since = SEEN if any(constant.identify for constant in system.operating_point) else 0.0
    off = before.errors(held_out, since), after.errors(held_out, since)
    reason = worse(*off, before.recording, units)
    return reason, () if reason else tuple(after.divergence(file.name))


def _needs(given: System, system: System) -> str:
    """The constant that new logs cannot have, as they know neither the diagnosis nor its experiments."""
    own = {constant.name for constant in given.operating_point}
    for constant in system.operating_point:
        if constant.name not in own and constant.other is None:
            return f"new logs have no value of {constant.name}, which only the diagnosed experiments have"
    return ""
