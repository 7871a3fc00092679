"""Models that explain the logs of a diagnosis equally well, fitted to these logs and ready to simulate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import ceil
from typing import Any

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.design.draws import drawn_between
from unmodelled.design.limits import Limits
from unmodelled.design.runs import Simulated, equations, quantities, simulated
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import with_fitted
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.diagnosis.judge.known_physics import KnownPhysics
from unmodelled.effects.added import DISCOVERED
from unmodelled.effects.columns import Member
from unmodelled.effects.discovered_law import DiscoveredLaw
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System

Entry = Mapping[str, Any]

#: Starting values of a fit that are tried, at most.
STARTS = 24
#: Half of a 95 % interval, in standard deviations.
HALF_INTERVAL = 1.96


def place_of(entry: Entry) -> Place:
    """Return the place of an effect in diagnosis.json.

    Examples:
        >>> place_of({"family": "actuator_offset", "port": "actuator:torque"}).name
        'torque'
    """
    local = entry.get("factor"), entry.get("level"), entry.get("signal")
    if "parameter" in entry:
        return Place("parameter", entry["parameter"], *local)
    kind, _, name = entry["port"].rpartition(":")
    return Place(kind if kind in ("actuator", "sensor") else "port", name, *local)


@dataclass(frozen=True)
class Known:
    """A number of an answer, SI."""

    value: float
    low: float  # ends of its 95 % interval; not finite where the logs leave it open
    high: float

    @property
    def doubt(self) -> float:
        """Standard deviation, inf where the logs leave the number open."""
        width = abs(self.high - self.low)
        return width / (2.0 * HALF_INTERVAL) if np.isfinite(width) else np.inf


def fitted_rival(
    physics: KnownPhysics, entries: Sequence[Entry], known: Mapping[str, Known], label: str
) -> Rival:
    """Fit the known physics with effects to the training experiments, from known numbers on."""
    hypothesis = Hypothesis.known(physics.study)
    library: dict[tuple[str, str], Effect] = {
        (e.family, e.variant): e for e in (*effects(), *physics.study.laws)
    }
    for entry in entries:
        family, variant = entry["family"], entry.get("variant", "")
        try:
            effect = DiscoveredLaw.named(variant) if family == DISCOVERED else library[family, variant]
            hypothesis = hypothesis.plus(effect, place_of(entry))
        except KeyError:
            raise BadInput(
                f"answer: {entry['family']} at {entry['port']} cannot be added to "
                f"{physics.study.system.place}: use the system file of the diagnosis"
            ) from None
    values = {name: each.value for name, each in known.items()}
    free = {n: g for e in hypothesis.effects for n, g in e.shapes.items() if n not in values}
    grids = list(product(*free.values()))
    starts = [{**values, **dict(zip(free, g, strict=True))} for g in grids[:: -(-len(grids) // STARTS)]]
    fitted = FittedHypothesis.of(hypothesis, physics.fitted.recording, starts)
    return Rival(label, fitted, known)


@dataclass(frozen=True, eq=False)
class Rival:
    """A fitted model with the uncertainty of its numbers."""

    label: str
    fitted: FittedHypothesis
    #: Numbers of the answer by name; the larger one of their deviation and that of the fit counts.
    known: Mapping[str, Known]

    @cached_property
    def values(self) -> dict[str, float]:
        """Return the fitted numbers by name, SI; of a number that differs between experiments the mean."""
        own = {name: float(np.mean(list(each.values()))) for name, each in self.fitted.fit.own.items()}
        return {u.name: {**self.fitted.fit.values, **own}[u.name] for u in self.fitted.hypothesis.unknowns}

    @cached_property
    def root(self) -> Array:
        """Return R, shape (numbers, numbers), SI: R times its transpose is the covariance of the numbers."""
        fit, unknowns = self.fitted.fit, self.fitted.hypothesis.unknowns
        rows = [fit.names.index(u.name) if u.name in fit.names else -1 for u in unknowns]
        covariance = np.where(np.isfinite(fit.covariance), fit.covariance, 0.0)[np.ix_(rows, rows)]
        deviation = np.array([self._deviation(k) for k in range(len(unknowns))])
        own = np.sqrt(np.diag(covariance))
        usable = (own > 0.0) & (np.array(rows) >= 0)
        scale = np.where(usable, own, 1.0)
        correlation = np.where(np.outer(usable, usable), covariance / np.outer(scale, scale), 0.0)
        np.fill_diagonal(correlation, 1.0)
        eigenvalues, vectors = np.linalg.eigh(correlation)
        return np.asarray(deviation[:, None] * vectors * np.sqrt(np.maximum(eigenvalues, 0.0)))

    def _deviation(self, number: int) -> float:
        """Standard deviation of an unknown, at most half of the width of its bounds."""
        unknown = self.fitted.hypothesis.unknowns[number]
        known = self.known.get(unknown.name)
        return _within(max(self._fitted_deviation(number), known.doubt if known else 0.0), unknown)

    def _fitted_deviation(self, number: int) -> float:
        """Standard deviation of an unknown from the fit, not finite where the fit leaves it open."""
        fit, unknown = self.fitted.fit, self.fitted.hypothesis.unknowns[number]
        if unknown.own:
            return float(np.std(list(fit.own[unknown.name].values())))
        row = fit.names.index(unknown.name)
        return float(np.sqrt(fit.covariance[row, row]))

    @cached_property
    def intervals(self) -> Array:
        """Return the lowest and the highest value of every number, shape (numbers, 2), SI, within its bounds.

        They are those of the answer; of a number that the answer does not have, those of the fit. What only
        smooths a corner of a law keeps its value.
        """
        found = []
        effects = self.fitted.hypothesis.effects
        smooth = {n for e in effects for n in e.shapes if n not in {*e.reported, *e.delays}}
        for k, (unknown, value) in enumerate(zip(self._unknowns, self.values.values(), strict=True)):
            known = self.known.get(unknown.name)
            # an end that the answer leaves open is as far as the bounds, whatever the fit thinks of it
            half = HALF_INTERVAL * _within(np.inf if known else self._fitted_deviation(k), unknown)
            half *= unknown.name not in smooth
            given = (known.low, known.high) if known else (np.nan, np.nan)
            pairs = zip(given, (value - half, value + half), strict=True)
            ends = [end if np.isfinite(end) else far for end, far in pairs]
            ends = np.clip(ends, unknown.low, unknown.high).tolist()
            found.append([min(*ends, value), max(*ends, value)])
        return np.array(found).reshape(-1, 2)

    @cached_property
    def draws(self) -> Array:
        """Return sets (draws, numbers), SI, from `intervals`: an answer has no covariance."""
        return drawn_between(self.intervals)

    @cached_property
    def drawn(self) -> list[System]:
        """Return the systems of `draws`."""
        return [self._system(point) for point in self.draws]

    @cached_property
    def around_draws(self) -> list[tuple[list[System], Array]]:
        """Return the systems around the numbers of every draw, and steps (columns,), see `around`."""
        return [self.around(point) for point in self.draws]

    @property
    def _unknowns(self) -> Sequence[Unknown]:
        return self.fitted.hypothesis.unknowns

    def _system(self, point: Array) -> System:
        numbers = dict(zip(self.values, point.tolist(), strict=True))
        return with_fitted(self.fitted.hypothesis, numbers)

    @cached_property
    def sets(self) -> tuple[list[System], Array]:
        """Return the systems around the fitted numbers, and steps (columns,), see `around`."""
        return self.around(np.array(list(self.values.values())))

    def around(self, here: Array) -> tuple[list[System], Array]:
        """Return systems at numbers (numbers,), SI, and a step along every column of `root`, and the steps.

        A step is a standard deviation, or less where a bound is nearer, in the direction with more room.
        """
        unknowns = self._unknowns
        low, high = np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])
        size = np.array([u.scale for u in unknowns])
        points, steps = [here], []
        for column in self.root.T:
            both = [np.clip(here + sign * column, low, high) for sign in (1.0, -1.0)]
            lengths = [float(np.linalg.norm((there - here) / size)) for there in both]
            side = int(np.argmax(lengths))
            points.append(both[side])
            steps.append(1.0 if side == 0 else -1.0)
        return [self._system(point) for point in points], np.array(steps)

    def runs(
        self, u: Array, limits: Limits, systems: Sequence[System], shown: Sequence[sp.Expr] | None = None
    ) -> Simulated:
        """Simulate experiments (designs, samples, inputs), SI, as `simulated` does.

        `shown` are expressions at the samples in place of what the travel limits hold for.
        """
        more = quantities(systems[0], limits) if shown is None else tuple(shown)
        how = (self._constants(limits), self.substeps(limits), self._equations(more))
        return simulated(systems, u, limits, *how, watching=shown is None)

    def substeps(self, limits: Limits) -> int:
        """Return the integration steps per sample of an experiment, no longer than those of the fit."""
        ratio = limits.period / self.fitted.hypothesis.study.logs.period
        return max(1, ceil(self.fitted.fit.substeps * ratio * (1.0 - 1e-9)))

    def _equations(self, watched: tuple[sp.Expr, ...]) -> Program:
        known = self.__dict__.setdefault("_programs", {})
        if watched not in known:
            known[watched] = equations(self.sets[0][0], watched)
        found: Program = known[watched]
        return found

    def _constants(self, limits: Limits) -> Array:
        """Operating point with the constants of the effects, whose group has the experiment, after all
        others.
        """
        hypothesis = self.fitted.hypothesis
        values = dict(limits.constants)
        for effect in hypothesis.effects:
            for name, column in effect.columns.items():
                values[name] = 1.0 if isinstance(column, Member) else float(len(hypothesis.study.logs))
        return np.array([values[c.name] for c in hypothesis.system.operating_point])


def _within(deviation: float, unknown: Unknown) -> float:
    """A standard deviation, at most half of the width of the unknown's bounds."""
    widest = 0.5 * (unknown.high - unknown.low)
    widest = widest if np.isfinite(widest) else 10.0 * unknown.scale
    return min(deviation, widest) if np.isfinite(deviation) else widest
