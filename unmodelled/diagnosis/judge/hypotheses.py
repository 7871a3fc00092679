"""Hypotheses of a user, compared by the evidence of the logs as the judge compares laws."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.judge.base import Base, bases
from unmodelled.diagnosis.judge.chain import Key
from unmodelled.diagnosis.judge.classes import BAR, SHARE
from unmodelled.diagnosis.judge.left_out import LeftOutRuns
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.refit import Parent, Refit, refit, went_astray
from unmodelled.diagnosis.judge.scan import Row, scan

#: Variants and places of a law that are fitted, those whose linear steps explain most.
FORMS = 3


@dataclass(frozen=True)
class Wanted:
    """A law of a hypothesis, where and in which variant it explains most."""

    family: str
    channel: str = ""  # the only place, "" for any

    def is_row(self, row: Row) -> bool:
        """Return whether a row is this law; at levels of a factor only where it acts nowhere else."""
        effect, place = row.atom.effect, row.atom.place
        local = place.factor is not None and not effect.at_levels
        return effect.family == self.family and self.channel in ("", place.channel) and not local


@dataclass(frozen=True, eq=False)
class Tried:
    """Laws beside each other, fitted over windows of one length; none for the known physics."""

    laws: tuple[Refit, ...]
    final: Parent
    nats: float  # evidence over the known physics after the price of the numbers; -inf where it leaves more
    price: float  # of the numbers and shapes, nats
    removed: float  # share of the squared residual, of the output where it is largest
    log_scores: Array  # of experiments left out, each with a share of the price, (experiments,)

    @classmethod
    def of(cls, parent: Parent, laws: Sequence[Refit], final: Parent) -> Tried:
        """Judge a fit as `refit` judges a law beside the parent."""
        weights, atoms = parent.weights, [one.row.atom for one in laws]
        price = weights.price(sum(atom.numbers for atom in atoms))
        price += float(np.log([one.row.shapes for one in laws]).sum())
        around = Linearised.of(final.fitted, parent.base.tau, weights)
        nats = around.evidence - parent.around.evidence - price
        failed = went_astray(parent, final.fitted, final.residual, nats)
        score = parent.score if failed else LeftOutRuns.of(around)
        removed = float(((parent.around.squares - around.squares) / parent.square).max())
        own = -np.inf if failed else nats
        scores = score.log_scores - price / len(score.log_scores)
        return cls(tuple(laws), final, own, price, 0.0 if failed else removed, scores)

    @property
    def or_nothing(self) -> float:
        """Return the evidence, nats, at least that of the laws at size zero."""
        return max(self.nats, -self.price)

    @property
    def stands(self) -> bool:
        """Return whether the laws would be named."""
        return self.nats >= BAR and self.removed >= SHARE


@dataclass(frozen=True, eq=False)
class Ranked:
    """Hypotheses over windows of the length that decides, by name; None where it could not be fitted."""

    base: Base
    tried: Mapping[str, Tried | None]
    overall: Mapping[str, float]  # evidence over windows of both lengths in the mean, nats


def ranked(
    study: Study,
    begun: FittedHypothesis,
    wanted: Mapping[str, Sequence[Wanted]],
    workers: int,
    say: Callable[[str], None],
) -> Ranked:
    """Compare hypotheses, of whose laws the study has no others; `begun` is a fit of the known physics.

    Everything that a diagnosis leaves open beside a law is open here, too. The longest windows over which the
    best hypothesis stands decide, as in a diagnosis.
    """
    parents = [Parent.of(base) for base in bases(study, begun)]
    forms = _forms(parents, wanted)
    looks, starts = list[tuple[Parent, dict[_Form, Tried]]](), dict[_Form, Start]()
    for parent in parents:
        say(f"compare hypotheses over windows of {parent.base.horizon:.3g} s")
        looks.append(_over(parent, forms, starts, workers))
        starts = {form: one.final.fitted.fit.every for form, one in looks[-1][1].items()}

    whole = {form for form in forms if all(form in tried for _, tried in looks)}
    overall = {form: float(np.mean([tried[form].or_nothing for _, tried in looks])) for form in whole}
    best = max(whole, key=lambda form: overall[form], default=None)
    standing = [look for look in looks if best is not None and look[1][best].stands]
    parent, tried = (standing or looks)[-1]
    chosen = {
        name: max((form for form in whole if form.name == name), key=lambda f: overall[f], default=None)
        for name in wanted
    }
    return Ranked(
        parent.base,
        {name: None if form is None else tried[form] for name, form in chosen.items()},
        {name: float("nan") if form is None else overall[form] for name, form in chosen.items()},
    )


@dataclass(frozen=True)
class _Form:
    """A hypothesis with its laws in certain variants at certain places."""

    name: str
    keys: tuple[Key, ...]


def _forms(parents: Sequence[Parent], wanted: Mapping[str, Sequence[Wanted]]) -> list[_Form]:
    """The forms of every hypothesis whose linear steps explain most over windows of all lengths."""
    rows = [scan(parent.around) for parent in parents]
    found = []
    for name, laws in wanted.items():
        each = [_best_keys(rows, law) for law in laws]
        found += [_Form(name, keys) for keys in product(*each) if len({*keys}) == len(keys)]
    return found


def _best_keys(rows: Iterable[Sequence[Row]], law: Wanted) -> list[Key]:
    total: dict[Key, float] = {}
    for row in (row for each in rows for row in each if law.is_row(row)):
        total[row.atom.key] = total.get(row.atom.key, 0.0) + row.nats
    return sorted(total, key=lambda key: -total[key])[:FORMS]


def _over(
    parent: Parent, forms: Sequence[_Form], starts: Mapping[_Form, Start], workers: int
) -> tuple[Parent, dict[_Form, Tried]]:
    """Forms that can be fitted beside a base, or beside the better one that the best of them leads to."""
    while True:
        with threads_of(workers) as pool:
            every = pool.map(partial(_tried, parent), forms, map(starts.get, forms))
            tried = {form: one for form, one in zip(forms, every, strict=True) if one is not None}
        best = max(tried.values(), key=lambda one: one.nats, default=None)
        better = parent.base.improved(best.final.fitted) if best is not None and best.stands else None
        if better is None:
            return parent, tried
        parent = Parent.of(better)


def _tried(parent: Parent, form: _Form, start: Start | None) -> Tried | None:
    """The laws of a form, fitted one beside the other with everything open."""
    laws, beside = list[Refit](), parent
    for key in form.keys:
        row = next((row for row in scan(beside.around) if row.atom.key == key), None)
        one = None if row is None else refit(beside, row, start)
        if one is None:
            return None
        laws.append(one)
        beside = beside.beside(one)
    return Tried.of(parent, laws, beside)
