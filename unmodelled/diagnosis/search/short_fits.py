"""Short fits over few windows, which rank what a linear system proposes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.search.proposal import Proposal

#: Share of the windows over which many numbers at once are fitted first.
BEGUN = 0.1
#: Iterations of that, and of a short fit: a budget.
BEGINNING, ITERATIONS = 8, 3


@dataclass(frozen=True, eq=False)
class ShortFits:
    """Short fits of candidates."""

    known: FittedHypothesis
    recording: Recording  # few windows

    def of(self, proposal: Proposal) -> LeftOut:
        """Return the left-out predictions of a proposal after a short fit."""
        substeps, larger, starts = proposal.base.fit.substeps, proposal.hypothesis, proposal.starts
        if len(proposal.atoms) > 1:
            # many numbers at once begin with short free runs, as the known physics does
            shorter = self.recording.shortened(BEGUN)
            begun = FittedHypothesis.of(larger, shorter, starts, BEGINNING, substeps)
            starts = (begun.fit.every,)
        return LeftOut.of(FittedHypothesis.of(larger, self.recording, starts, ITERATIONS, substeps))

    def again(self, fitted: FittedHypothesis) -> LeftOut:
        """Return the left-out predictions of a hypothesis that is fitted again, like the proposals."""
        return self._again(fitted) if fitted.hypothesis.effects else self._without

    @cached_property
    def _without(self) -> LeftOut:
        """The known physics, fitted like the proposals."""
        return self._again(self.known)

    def _again(self, fitted: FittedHypothesis) -> LeftOut:
        start, substeps = fitted.fit.every, fitted.fit.substeps
        return LeftOut.of(
            FittedHypothesis.of(fitted.hypothesis, self.recording, [start], ITERATIONS, substeps)
        )
