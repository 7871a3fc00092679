"""Compare hypotheses of one's own about the gap between a system and its logs."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass

import pandas as pd

from unmodelled.base.errors import BadInput, closest
from unmodelled.base.notebook import shown
from unmodelled.base.progress import silence
from unmodelled.diagnosis.answer.own_hypotheses import ComparedHypotheses, Laws, compare_hypotheses
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.report.answer_tables import ComparisonTable
from unmodelled.systems.given import SystemGiven


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Hypotheses about what a model leaves out, ranked by how they predict; made by `compare`.

    Attributes:
        found: hypotheses, the one that predicts best first, with their probabilities and numbers.
    """

    found: ComparedHypotheses

    @property
    def best(self) -> str:
        """Return the name of the hypothesis that predicts experiments best that are left out of the fit."""
        return self.found.each[0].name

    def probability(self, name: str) -> float:
        """Return the probability of a hypothesis among those that were compared, 0 to 1.

        Args:
            name: name of the hypothesis.

        Raises:
            BadInput: when no hypothesis has this name.
        """
        known = {
            one.name: share for one, share in zip(self.found.each, self.found.probabilities, strict=True)
        }
        if name not in known:
            raise BadInput(f"hypotheses: there is no {name!r}{closest(name, known)}")
        return known[name]

    def table(self) -> pd.DataFrame:
        """Return the hypotheses, the one that predicts best first, as az.compare lists models.

        Columns: rank, hypothesis, laws (and places, in words), elpd (expected log predictive density of
        experiments left out of the fit, nats, up to a constant of the logs; every number of a law costs),
        difference from the best one and its standard_error over experiments (positive is worse), probability
        (weight, 0 to 1), evidence (log evidence over the known physics without a law, windows of both
        lengths in the mean, nats) and warning.
        """
        each, best = self.found.each, self.found.each[0]
        rows = [
            (one.name, ", ".join(one.laws), one.elpd, *one.difference(best), share, one.evidence, one.warning)
            for one, share in zip(each, self.found.probabilities, strict=True)
        ]
        columns = ["hypothesis", "laws", "elpd", "difference", "standard_error", "probability"]
        table = ComparisonTable(rows, columns=[*columns, "evidence", "warning"])
        table.insert(0, "rank", range(1, len(table) + 1))
        return table

    @property
    def numbers(self) -> pd.DataFrame:
        """Return the fitted numbers of the laws, a row each, as a person says them.

        Columns: hypothesis, law (and place), parameter, value, low, high (95 % interval), unit.
        """
        rows = [
            (one.name, law, number.symbol, *number.values, number.unit)
            for one in self.found.each
            for law, number in one.numbers
        ]
        columns = ["hypothesis", "law", "parameter", "value", "low", "high", "unit"]
        return ComparisonTable(rows, columns=columns)

    @property
    def notes(self) -> tuple[str, ...]:
        """Return remarks on the logs, a sentence each."""
        return self.found.notes

    def __repr__(self) -> str:
        return "\n".join([self._title, "", repr(self.table()), "", *(f"note: {note}" for note in self.notes)])

    @property
    def _title(self) -> str:
        share = self.found.probabilities[0]
        windows = f"free runs of {self.found.horizon:.3g} s"
        return f"{self.best} predicts best, probability {100.0 * share:.0f} % ({windows})"

    def _repr_html_(self) -> str:
        tables = {"Hypotheses, the best predicting first": self.table(), "Numbers of the laws": self.numbers}
        return shown(self._title, self.notes, tables)


def compare(
    system: SystemGiven,
    logs: LogsGiven,
    hypotheses: Mapping[str, Laws],
    horizon: float | None = None,
    workers: int | None = None,
    quiet: bool = False,
) -> Comparison:
    """Compare hypotheses of your own about what a model leaves out, as a diagnosis compares laws.

    The laws of a hypothesis are fitted together, inside the simulation, beside everything that a diagnosis
    leaves open: uncertain parameters, delays, lags, gains and zeros of the logs. Every experiment is left out
    once, and a hypothesis is judged by how well it predicts this experiment (Vehtari, Gelman and Gabry 2017;
    probabilities as weights of Yao, Vehtari, Simpson and Gelman 2018). A difference below 4 nats, or below
    two standard errors, decides nothing.

    Args:
        system: known physics, or the path of its file.
        logs: measured experiments, the path of their folder, or data frames.
        hypotheses: laws by name of the hypothesis: laws of your own (`Law`), and families of the library such
            as "coulomb_friction", also with a place, "coulomb_friction@elbow" or
            "actuator_lag@actuator:u"; without one, a law acts where it explains most. No law ([]) is always
            compared.
        horizon: length of the free-run windows, s; default: from the logs. Windows of four times this length
            are compared, too; the longest over which the best hypothesis stands decide.
        workers: number of threads; default: one per core.
        quiet: whether nothing is said about the progress; default False.

    Returns:
        Hypotheses, the one that predicts best first, with differences, probabilities and numbers.

    Raises:
        BadInput: when the system, the logs, the horizon or a law cannot be used, or a fault of the logs
            explains the gap.

    Examples:
        The logs of the example have dry friction in the joint:

        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> drag = um.Law("drag", "c*v*abs(v)", {"c": {"unit": "N m s^2/rad^2", "plausible": 0.01, "low": 0}})
        >>> found = um.compare(
        ...     system, logs, {"friction": ["coulomb_friction"], "play": ["backlash"], "drag": [drag]}
        ... )
        >>> found.best, round(found.probability("friction"), 2)
        ('friction', 1.0)
        >>> print(found.table()[["rank", "hypothesis"]].to_string(index=False))
         rank hypothesis
            1   friction
            2       play
            3     no law
            4       drag
        >>> found.numbers.head(1)[["law", "parameter", "value", "unit"]].round(3)
                                 law parameter  value unit
        0  Coulomb friction at joint       F_c   0.06  N m
    """
    given = read_inputs(system, logs)
    with silence() if quiet else nullcontext():
        return Comparison(compare_hypotheses(*given, hypotheses, horizon, workers, DEFAULT_OPTIONS.level))
