"""Laws refitted inside the simulation, and their evidence over the fit beside which they stand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.judge.base import BETTER, NOISES, Base
from unmodelled.diagnosis.judge.chain import with_priors
from unmodelled.diagnosis.judge.elimination import OPEN
from unmodelled.diagnosis.judge.left_out import LeftOutRuns
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.residual import Residual
from unmodelled.diagnosis.judge.scan import Row
from unmodelled.diagnosis.judge.weights import Weights
from unmodelled.effects.added import Added

#: Laws of different kinds or places that are refitted at a length; at the place that wins so many of the
#: plainest and so many of the best ones, too, and one of every family of the kind that wins.
REFITS, SIBLINGS = 6, 2
#: Times as many integration steps that are tried at once.
FINER = 4
#: Share of a linear step from which a law is fitted that cannot be fitted from the whole step.
SMALLER = 0.1
#: Faults of a fit that leaves the range of a law: such a law is no answer.
FAULTS = ArithmeticError, ValueError, KeyError, np.linalg.LinAlgError


@dataclass(frozen=True, eq=False)
class Parent:
    """A fit beside which laws are judged."""

    base: Base
    fitted: FittedHypothesis
    residual: Residual
    around: Linearised  # residuals in their own size and correlation time
    square: Array  # mean squared residual of the base, as `Linearised.squares`, (3, outputs)

    @property
    def weights(self) -> Weights:
        """Return the weights of its residuals."""
        return self.around.weights

    @cached_property
    def score(self) -> LeftOutRuns:
        """Return the experiments left out, without a law more."""
        return LeftOutRuns.of(self.around)

    @property
    def explained(self) -> float:
        """Return the share of the squared residual of the base that is gone, where it is largest.

        In outputs whose gap matters, the noise of the sensors is no part of it: no law explains that.
        """
        square = self.base.residual.square
        above = np.where(square > NOISES**2, 1.0 - 1.0 / square, 1.0)
        return float(np.minimum(_gone(self.square, self.around.squares, square) / above, 1.0).max())

    def gone(self, law: Refit) -> float:
        """Return the share of the squared residual of this fit that a law removes, where it is largest."""
        return float(_gone(self.around.squares, law.square, self.residual.square).max())

    @classmethod
    def of(cls, base: Base) -> Parent:
        """Return the base itself."""
        around = Linearised.of(base.fitted, base.tau)
        return cls(base, base.fitted, base.residual, around, around.squares)

    def beside(self, law: Refit) -> Parent:
        """Return the fit with one law more, integrated as finely as it needs.

        Steps that are short enough beside the error of the base may be too long beside what a law leaves: dry
        friction is then rounded to what they can follow.
        """
        base, fitted, residual, square = self.base, law.fitted, law.residual, law.square
        while base.needed(fitted) > base.substeps:
            finer = replace(base, substeps=FINER * base.substeps)
            again = finer.fit(fitted.hypothesis, fitted.fit.every)
            if not again.fit.loss < (1.0 - BETTER) * fitted.fit.loss:
                break
            base, fitted = finer, again
        if fitted is not law.fitted:
            residual, square = Residual.of(fitted), Linearised.of(fitted, base.tau, self.weights).squares
        around = Linearised.of(fitted, base.tau)
        return Parent(base, fitted, residual, around, around.squares * self.square / square)


@dataclass(frozen=True, eq=False)
class Refit:
    """A law refitted inside the simulation with everything open."""

    row: Row
    fitted: FittedHypothesis
    residual: Residual
    score: LeftOutRuns
    nats: float  # evidence over its parent; -inf if the fit is worse than that of its parent
    overall: float  # the same over windows of every length, in the mean, where others were compared
    price: float  # of its numbers and shapes, nats
    square: Array  # mean squared residual, weighted, as `Linearised.squares`, (3, outputs)
    removed: float  # share of the squared residual of the base, of that in `square` where it is largest

    @property
    def added(self) -> Added:
        """Return the law in the system."""
        return next(e for e in self.fitted.hypothesis.effects if e.key == self.row.atom.key)

    @property
    def or_nothing(self) -> float:
        """Return the evidence, nats, at least that of the law at size zero."""
        return max(self.nats, -self.price)

    @property
    def log_scores(self) -> Array:
        """Return the log densities (experiments,) of experiments left out, each with a share of the price.

        A form with more numbers predicts as well where it holds the true one.
        """
        return np.asarray(self.score.log_scores - self.price / len(self.score.log_scores))

    @property
    def numbers(self) -> dict[str, tuple[float, float]]:
        """Return the fitted numbers of the law and their standard deviations, SI."""
        fit, added = self.fitted.fit, self.added
        names = [n for n in (*added.amplitudes, *added.shapes, *added.delays) if n in fit.values]
        return {n: (float(fit.values[n]), float(np.sqrt(fit.variance(n)))) for n in names}


def _gone(before: Array, after: Array, square: Array) -> Array:
    """Shares (outputs,) of squared residuals, as `Linearised.squares`, that are gone.

    Beside residuals `square`, in sensor noise, that are above it. Where all are as small as the noise, a law
    can only say how experiments deviate.
    """
    ours, new, usual = 1.0 - after / before
    return np.asarray(np.maximum(ours, usual) if np.any(square > NOISES**2) else new)


@dataclass
class Carried:
    """Fits of shorter windows by law, from which those of longer ones start."""

    starts: dict[tuple[str, str], Start] = field(default_factory=dict)
    nats: dict[tuple[str, str], float] = field(default_factory=dict)

    def learn(self, found: Sequence[Refit]) -> None:
        """Keep the numbers of fits, and rank by their evidence."""
        self.starts |= {one.row.key: one.fitted.fit.every for one in found}
        self.nats = {one.row.key: one.nats for one in found}

    def among(self, rows: Sequence[Row], most: int = 3) -> list[Row]:
        """Return the rows of the best laws of the last length, each with its best shape here."""
        best = sorted(self.nats, key=lambda key: -self.nats[key])[:most]
        own = [[row for row in rows if row.key == key] for key in best]
        return [max(each, key=lambda row: row.nats) for each in own if each]


def refits(parent: Parent, rows: Sequence[Row], workers: int, carried: Carried | None = None) -> list[Refit]:
    """Refit the best paying law of every kind and place, those of shorter windows, and some where one wins.

    The place is decided first, the form after it: the best laws of a linear step are often forms of one law.
    `carried` learns the fits.
    """
    wanted = _best_by((row for row in rows if row.nats > 0.0), lambda row: row.about)[:REFITS]
    known = {row.key for row in wanted}
    wanted += [row for row in carried.among(rows) if row.key not in known] if carried else []
    found = _fitted(parent, wanted, workers, carried)
    if found:
        found += _fitted(parent, _siblings(rows, found), workers, carried)
        best_fit = max(found, key=lambda one: one.nats)
        found = [_again(parent, one, best_fit) for one in found]
    if carried is not None:
        carried.learn(found)
    return found


def _best_by(rows: Iterable[Row], about: Callable[[Row], object]) -> list[Row]:
    """The best row of each of what they are about, the best first."""
    found = dict[object, Row]()
    for row in sorted(rows, key=lambda row: -row.nats):
        found.setdefault(about(row), row)
    return list(found.values())


def _siblings(rows: Sequence[Row], found: Sequence[Refit]) -> list[Row]:
    """The plainest and the best other laws at the place that wins, and one of every family of its kind."""
    winner, known = max(found, key=lambda one: one.nats).row, [one.row for one in found]
    keys, names = {row.key for row in known}, {row.name for row in known}
    here = [row for row in rows if row.place == winner.place and row.key not in keys]
    plainest = sorted(here, key=lambda row: (row.atom.numbers, -row.nats))[:SIBLINGS]
    best = sorted(here, key=lambda row: -row.nats)[:SIBLINGS]
    kin = [row for row in here if row.about == winner.about and row.name not in names]
    return list({row.key: row for row in (*plainest, *best, *_best_by(kin, lambda row: row.name))}.values())


def _again(parent: Parent, one: Refit, best: Refit) -> Refit:
    """A plainer law than the best one at its place, also fitted from the numbers of that; the better of both.

    A law that ended early would be told apart from the one that holds it.
    """
    plainer = one.row.place == best.row.place and one.row.atom.numbers < best.row.atom.numbers
    if not plainer or one.nats == -np.inf:
        return one
    own = {name: one.fitted.fit.values[name] for name in one.numbers}
    other = refit(parent, one.row, {**best.fitted.fit.every, **own})
    return one if other is None or other.nats <= one.nats else other


def completed(
    parent: Parent, rows: Sequence[Row], own: Sequence[Refit], others: Sequence[Refit], workers: int
) -> list[Refit]:
    """Return the refits of a length, with those of the laws that are best at another length."""
    known, carried = {one.row.key for one in own}, Carried()
    carried.learn([one for one in others if one.nats > 0.0])
    missing = [row for row in carried.among(rows, REFITS) if row.key not in known]
    return [*own, *_fitted(parent, missing, workers, carried)]


def _fitted(parent: Parent, rows: Sequence[Row], workers: int, carried: Carried | None) -> list[Refit]:
    """Refit laws, without those that cannot be."""
    starts = carried.starts if carried else {}
    with threads_of(workers) as pool:
        every = list(pool.map(lambda row: refit(parent, row, starts.get(row.key)), rows))
    return [one for one in every if one is not None]


def refit(parent: Parent, row: Row, carried: Start | None = None) -> Refit | None:
    """Fit a law from its fit to shorter windows or its linear step; None where it cannot be fitted.

    A linear step of a law with an edge, such as a mass that would be negative, may be too large by far.
    """
    first = _tried(parent, row, carried)
    if first is not None and first.nats > -np.inf:
        return first
    return _tried(parent, replace(row, amount=SMALLER * row.amount), None) or first


def _tried(parent: Parent, row: Row, carried: Start | None) -> Refit | None:
    """A law fitted; None where it cannot be."""
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of a fit that diverged
            return _refit(parent, row, carried)
    except FAULTS:
        return None


def _refit(parent: Parent, row: Row, carried: Start | None) -> Refit | None:
    base, known = parent.base, parent.fitted.hypothesis
    if row.atom.place.everywhere not in known.places(row.atom.effect):
        return None
    larger = known.plus(row.atom.effect, row.atom.place)
    start = {**parent.fitted.fit.every, **_linear(larger, row), **(carried or {})}
    fitted = base.fit(_with_priors(larger, base.tau), start)
    residual = Residual.of(fitted)
    around = Linearised.of(fitted, base.tau, parent.weights)
    price = parent.weights.price(row.atom.numbers) + float(np.log(row.shapes))
    nats = around.evidence - parent.around.evidence - price
    removed: Array = (parent.around.squares - around.squares) / parent.square
    own = -np.inf if went_astray(parent, fitted, residual, nats) else nats
    scores, share = LeftOutRuns.of(around), float(removed.max())
    return Refit(row, fitted, residual, scores, own, own, price, around.squares, share)


def went_astray(parent: Parent, fitted: FittedHypothesis, residual: Residual, nats: float) -> bool:
    """Return whether a fit beside a parent failed.

    Laws of size zero leave what the parent leaves: a fit that leaves more at a larger loss went astray.
    """
    more = float(np.mean(residual.square / parent.residual.square)) > 1.0
    worse = more and not fitted.fit.loss <= parent.fitted.fit.loss
    return not np.isfinite(nats) or worse or residual.diverged > parent.residual.diverged


def _linear(larger: Hypothesis, row: Row) -> dict[str, float]:
    """Numbers of a law, SI, from its shape and the amounts of a linear step."""
    atom, added = row.atom, next(e for e in larger.effects if e.key == row.atom.key)
    if added.delays:
        (name,) = added.delays
        return {name: float(np.clip(row.amount[0] * atom.shape["delay"], *added.bounds[name]))}
    found = dict(zip(added.shapes, atom.shape.values(), strict=True))
    if not added.per_experiment:
        amounts = zip(added.amplitudes, (row.amount * atom.scale).tolist(), strict=True)
        found |= {name: amount for name, amount in amounts if name not in added.shares}
    return found


def _with_priors(hypothesis: Hypothesis, tau: float) -> Hypothesis:
    """A law by which experiments differ, with priors of a fit whose errors are correlated."""
    last = hypothesis.effects[-1]
    if last.usual or not last.per_experiment:
        return hypothesis
    return with_priors(hypothesis, {n: OPEN * size / np.sqrt(tau) for n, size in last.priors.items()})
