"""Course of the inputs between samples, chosen from the logs before effects are searched."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.effect_search import EffectSearch


def begun(study: Study, workers: int, progress: Callable[[str], None]) -> EffectSearch:
    """Begin a search with inputs that run straight between samples, or that keep their values.

    A digital controller keeps the value of its output until the next sample. States that are as fast as a
    sample, such as the current of a motor, tell the difference, and effects would stand in for it. Inputs are
    held only if the known physics then predicts left-out experiments better, and no input acts at the end of
    its time frame: an input that is held acts half a sample later, which gains where a latency is missing.
    """
    straight = EffectSearch(study, workers, progress)
    inputs = tuple(replace(item, hold=True) for item in study.system.inputs)
    if inputs == study.system.inputs:
        return straight
    progress("compare inputs that are held between samples")
    held = EffectSearch(replace(study, system=replace(study.system, inputs=inputs)), workers)
    both = Candidates((straight.found[frozenset()], held.found[frozenset()]), study.thresholds)
    late = any(held.base.at_bound(name) for name in held.base.hypothesis.timing)
    return held if both.beats(1, 0) and not late else straight
