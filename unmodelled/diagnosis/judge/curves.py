"""Free curves in the arguments of a law: what its form alone could do, which a second law must beat."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from unmodelled.diagnosis.columns.columns import Atom
from unmodelled.diagnosis.judge.refit import Parent, Refit, refit
from unmodelled.diagnosis.judge.scan import Row, row_of
from unmodelled.effects.effect import LawEffect
from unmodelled.effects.law import Fixed, Law, signed
from unmodelled.effects.place import Place, Site, site
from unmodelled.systems.model import System

#: Knots of a free curve, and quantiles of its argument between which they lie.
KNOTS, INSIDE = 5, (0.05, 0.95)


class _FreeCurve(LawEffect):
    """A linear spline in one local signal of a place."""

    kind = "curve"
    family = "free_curve"

    def __init__(self, local: str, knots: Sequence[float]) -> None:
        self._local, self._knots, self.variant = local, tuple(knots), local

    def places(self, system: System) -> tuple[Place, ...]:
        ports = (Place("port", port.name) for port in system.ports)
        return (*ports, *(Place("actuator", item.name) for item in system.inputs))

    def law(self, at: Site) -> Law:
        s, last = self._local, len(self._knots) - 1
        rise = [f"({s} - q_{k})/(q_{k + 1} - q_{k})" for k in range(last)]
        hats = [f"clip(1 - {rise[0]}, 0, 1)"]
        hats += [f"max(min({rise[k - 1]}, 1 - {rise[k]}), 0)" for k in range(1, last)]
        hats += [f"clip({rise[-1]}, 0, 1)"]
        amplitudes = {f"c_{k}": signed(hat, 0.3 * at.effort) for k, hat in enumerate(hats)}
        fixed = {f"q_{k}": Fixed(s, value) for k, value in enumerate(self._knots)}
        return Law(" + ".join(f"c_{k}*{hat}" for k, hat in enumerate(hats)), amplitudes, fixed=fixed)


def free_curves(parent: Parent) -> Iterator[Refit]:
    """Yield a fit with a free curve more in each argument of each of its laws, where the law acts."""
    hypothesis = parent.fitted.hypothesis
    for added, effect in zip(hypothesis.effects, hypothesis.laws, strict=True):
        if not isinstance(effect, LawEffect) or added.usual or added.place.kind not in ("port", "actuator"):
            continue
        at = site(hypothesis.study.system, added.place, hypothesis.study.scales)
        for local in sorted(_arguments(effect.law(at), at)):
            row = _curve(parent, local, added.place.everywhere)
            if row is not None:
                yield from _fitted(parent, row)


def _fitted(parent: Parent, row: Row) -> list[Refit]:
    """The better of two fits: from its linear step, and from no curve at all where that step is too large."""
    found = [refit(parent, replace(row, amount=share * row.amount)) for share in (1.0, 0.0)]
    return sorted((one for one in found if one is not None), key=lambda one: -one.nats)[:1]


def arguments(one: Refit) -> frozenset[str]:
    """Return the local names of what a fitted law is a function of: speed, position and command."""
    study, effect = one.fitted.hypothesis.study, one.row.atom.effect
    if not isinstance(effect, LawEffect):
        return frozenset()
    at = site(study.system, one.row.atom.place, study.scales)
    return _arguments(effect.law(at), at)


def _arguments(law: Law, at: Site) -> frozenset[str]:
    """Local names of speed, position and command in a law."""
    text = " ".join([*(a.adds for a in law.amplitudes.values()), *(m.rate for m in law.memory.values())])
    return frozenset(
        local for local in ("v", "x", "u") if re.search(rf"\b{local}\b", text) and local in at.quantities
    )


def _curve(parent: Parent, local: str, place: Place) -> Row | None:
    """The curve as a row; None where the argument hardly moves."""
    columns = parent.around.columns
    names, values = columns.laws.signals(place)
    along = values[..., names.index(local)]
    knots = np.unique(np.quantile(along, np.linspace(*INSIDE, KNOTS)))
    if len(knots) < 3:
        return None
    effect = _FreeCurve(local, knots.tolist())
    law = effect.law(columns.sites[place])
    scale = np.array([a.scale for a in law.amplitudes.values()])
    atom = Atom(effect, place, {}, scale, np.zeros(len(scale), np.bool_), len(scale))
    return row_of(parent.around, atom, columns.of_law(law, place))
