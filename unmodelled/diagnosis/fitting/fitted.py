"""A hypothesis after its fit, and how well every experiment agrees with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.fit import Fit, fit
from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.fitting.residuals import Errors, spread
from unmodelled.diagnosis.fitting.unknowns import Unknowns

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fitted:
    """A hypothesis whose unknowns were fitted to a recording."""

    hypothesis: Hypothesis
    recording: Recording
    fit: Fit

    @classmethod
    def of(
        cls,
        hypothesis: Hypothesis,
        recording: Recording,
        starts: Sequence[Mapping[str, float]] = ({},),
        iterations: int = 30,
        substeps: int | None = None,
    ) -> Fitted:
        """Fit from the best of `starts`, see `fit`."""
        simulation = hypothesis.simulation(recording)
        found = fit(simulation, hypothesis.unknowns, starts, iterations, substeps)
        return cls(hypothesis, recording, found)

    @cached_property
    def unknowns(self) -> Unknowns:
        """Over the recording."""
        return Unknowns(self.hypothesis.simulation(self.recording), self.hypothesis.unknowns)

    def vector(self, unknowns: Unknowns) -> Array:
        """(entries,) the fitted values, in the vector of unknowns of the same hypothesis."""
        runs = sorted(unknowns.simulation.recording.runs)
        ids = [unknowns.simulation.recording.logs.ids[i] for i in runs]
        values = [
            value
            for u in unknowns.each
            for value in ([self.fit.own[u.name][i] for i in ids] if u.own else [self.fit.values[u.name]])
        ]
        return np.array(values) / unknowns.scale

    def moved(self, recording: Recording) -> tuple[Array, Array]:
        """By how much the starts of the windows of `recording`, which are among those of the fit, were moved,
        in their noise; and that noise: (windows, measured states) both."""
        order = np.argsort(self.recording.start)
        rows = order[np.searchsorted(self.recording.start[order], recording.start)]
        sigma = start_noise(self.hypothesis.simulation(recording), self.fit.numbers)
        return self.fit.start[rows] / sigma, sigma

    @cached_property
    def errors(self) -> tuple[Array, Array]:
        """Errors (windows, most steps, outputs) in units of the sensors' noise, and moved starts."""
        moved, sigma = self.moved(self.recording)
        errors = Errors(self.unknowns, sigma, self.fit.substeps)
        return errors(self.vector(self.unknowns)[None], moved[:, None])[:, 0], moved

    @cached_property
    def spread(self) -> Array:
        """(outputs,) of the errors, see `spread`."""
        return spread(self.errors[0], self.recording.counted)
