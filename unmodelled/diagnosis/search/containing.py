"""A law in place of a simpler one that it contains, from the numbers of the simpler one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.search.screen import Point, Screened
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.place import Place
from unmodelled.engine.machine.program import Program

Array = NDArray[np.float64]

#: Share of the squared effort of the simpler law that a law must be able to say to contain it.
CONTAINED = 0.99
#: Measured samples at which the efforts of two laws are compared: a budget.
COMPARED = 2000


@dataclass(frozen=True, eq=False)
class Containing:
    """A fitted hypothesis in which a law takes the place of a simpler one.

    Alone, the law begins from few starts in a model whose other numbers stand in for it. On top of the
    simpler law, a linear screen tells where it should begin.

    Attributes:
        screened: the law on top of a hypothesis with the simpler law.
        simpler: effect of this hypothesis.
    """

    screened: Screened
    simpler: Added

    @property
    def base(self) -> FittedHypothesis:
        """Return the fitted hypothesis with the simpler law."""
        return self.screened.base

    @property
    def effect(self) -> Effect:
        """Return the law."""
        return self.screened.effect

    @property
    def place(self) -> Place:
        """Return the place of both laws."""
        return self.screened.place

    @property
    def gain(self) -> float:
        """Return the predicted fall of the cross-validated loss."""
        return self.screened.gain

    @property
    def is_delay(self) -> bool:
        """Return whether the law is a delay: it is not."""
        return False

    @cached_property
    def hypothesis(self) -> Hypothesis:
        """Return the hypothesis with the law in place of the simpler one."""
        return self.base.hypothesis.without(self.simpler).plus(self.effect, self.place)

    @property
    def key(self) -> frozenset[tuple[str, str, Place]]:
        """Return the key of `hypothesis`."""
        return self.hypothesis.key

    @cached_property
    def starts(self) -> tuple[Start, ...]:
        """Return values to start a fit from, the best first; none if the law does not contain the other."""
        found = [self._start(*one) for one in self.screened.tries]
        return tuple(start for start in found if start is not None)

    def _start(self, point: Point, amounts: Array) -> Start | None:
        """The effort of the simpler law, and what the screen adds."""
        alone, law = self.screened.hypothesis.effects[-1], self.hypothesis.effects[-1]
        fit = self.base.fit
        names = dict(zip((*alone.amplitudes, *alone.shapes), (*law.amplitudes, *law.shapes), strict=True))
        # what smooths a corner of both laws is that of the simpler one
        corners = [
            n for n, grid in alone.shapes.items() if len(grid) == 1 and names[n] in self.simpler.shapes
        ]
        values = point.start(alone, amounts) | {n: fit.values[names[n]] for n in corners}
        said = self._said(values)
        if said is None:
            return None
        for name, amount in zip(alone.amplitudes, said.tolist(), strict=True):
            values[name] = float(np.clip(values[name] + amount, *alone.bounds[name]))
        return {**fit.every, **{names[n]: v for n, v in values.items()}}

    def _said(self, values: Mapping[str, float]) -> Array | None:
        """Amplitudes (amplitudes,) at which the law says the effort of the simpler one; None if it cannot."""
        hypothesis, fit = self.screened.hypothesis, self.base.fit
        law, logs = hypothesis.effects[-1], hypothesis.study.logs
        known = {p.name for p in hypothesis.system.parameters}
        numbers = {n: v for n, v in {**fit.values, **values}.items() if n in known}
        system = hypothesis.system.with_values(numbers)
        rows = np.linspace(0, len(logs.t) - 1, min(COMPARED, len(logs.t))).astype(int)
        x = np.zeros((len(rows), len(system.states)))
        x[:, : logs.x.shape[1]] = logs.x[rows]
        at = logs.t[rows], x, logs.u[rows], np.array(system.values), hypothesis.c[logs.owner[rows]]
        efforts = Program.of(system, [*self.simpler.regressors, *law.regressors]).evaluate(*at)
        own, others = np.split(efforts, [len(self.simpler.regressors)], axis=1)
        effort = own @ [fit.values[name] for name in self.simpler.amplitudes]
        amplitudes = np.asarray(np.linalg.lstsq(others, effort, rcond=None)[0], np.float64)
        left, power = effort - others @ amplitudes, float(effort @ effort)
        return amplitudes if power > 0.0 and float(left @ left) <= (1.0 - CONTAINED) * power else None


def containing(found: Sequence[Screened]) -> list[Screened | Containing]:
    """Return screened candidates; one that contains a law at its place takes this law's place.

    Args:
        found: screened candidates on top of one hypothesis.
    """
    return [next(_in_place(one), one) for one in found]


def _in_place(one: Screened) -> Iterator[Containing]:
    """The candidate in the place of each effect that it contains."""
    here = [e for e in one.base.hypothesis.effects if e.place == one.place and _is_plain(e)]
    for simpler in here if here and _is_plain(one.hypothesis.effects[-1]) else ():
        larger = Containing(one, simpler)
        if larger.starts:
            yield larger


def _is_plain(law: Added) -> bool:
    """Whether an effort follows from amplitudes and the present states, in all experiments."""
    plain = law.linear and not (law.memory or law.delays or law.shares or law.per_experiment)
    return plain and law.place.kind == "port" and law.place.factor is None
