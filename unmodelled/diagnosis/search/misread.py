"""The diagnosis of logs that are to be checked first: a fault of theirs is the answer."""

from __future__ import annotations

from collections.abc import Sequence

from unmodelled.diagnosis.data.diagnosis import Diagnosis
from unmodelled.diagnosis.data.log_fault import LogFault
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting import models
from unmodelled.diagnosis.search.confidence import HIGHEST


def misread(study: Study, seed: int, faults: Sequence[LogFault]) -> Diagnosis:
    """Answer with the faults of the logs; nothing is searched and nothing fitted.

    The confidence is the share of the gap that the fault explains, and full where logs are identical.

    Args:
        study: the known physics and the logs as they are. seed: of the held-out experiments.
        faults: one of them or more decide.
    """
    known = models.known(study)
    shares = [fault.explains for fault in faults if fault.decides and fault.explains is not None]
    return Diagnosis(
        *(study.system, study.logs, study.horizon, seed, "check_logs"),
        confidence=min([HIGHEST, *shares]),
        effects=(),
        partial=False,
        known=known,
        reidentified=known,
        augmented=known,
        neural=known,
        steps=(known,),
        floor=known.gap.floor,
        shrink=0.0,
        interval=(0.0, 0.0),
        held_out=study.held_out,
        parameters={},
        candidates=(),
        notes=study.logs.notes,
        faults=tuple(faults),
    )
