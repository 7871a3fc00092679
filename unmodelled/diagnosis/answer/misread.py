"""The answer where the logs are at fault: nothing is fitted."""

from __future__ import annotations

from collections.abc import Sequence

from unmodelled.diagnosis.data.result import Diagnosis, LogFault
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.doubts.confidence import HIGHEST_CONFIDENCE
from unmodelled.diagnosis.fitting.judged_models import known_model


def misread(study: Study, seed: int, faults: Sequence[LogFault]) -> Diagnosis:
    """Return the answer with the faults of the logs, as sure as they explain the gap; nothing is fitted."""
    known = known_model(study)
    shares = [f.explains for f in faults if f.decides and f.explains is not None]
    return Diagnosis(
        *(study.system, study.logs, study.horizon, seed, "check_logs"),
        confidence=min([HIGHEST_CONFIDENCE, *shares]),
        chance=None,
        effects=(),
        remainder=None,
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
        comparison=(),
        notes=study.logs.notes,
        faults=tuple(faults),
    )
