"""States that no output shows, integrated along the experiments with the others imposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.systems.model import System

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Integration steps per sampling period; the next number is taken where one is unstable.
SUBSTEPS = (4, 32)


@dataclass(frozen=True, eq=False)
class Observer:
    """Integration of hidden states, driven by the inputs and then by the other states in their order.

    Attributes:
        program: program of the register machine whose outputs are the hidden states.
        initial: program whose outputs are the hidden states at the start of every experiment.
        columns: inputs and other states, by number, that the two programs depend on.
        hold: course of these between samples, see `Integration`.
    """

    program: Program
    initial: Program
    columns: tuple[int, ...]
    hold: tuple[float, ...]

    @classmethod
    def of(cls, system: System, hidden: Sequence[int]) -> Observer:
        """Return the observer of some states of a system.

        Args:
            system: system with the known laws of its ports.
            hidden: indices of the states that no output shows.

        Raises:
            BadInput: when the initial values of hidden states depend on each other in a circle.
        """
        shown = [system.x[k] for k in hidden]
        starts = [system.states[k].initial for k in hidden]
        for _ in hidden:
            starts = [start.xreplace(dict(zip(shown, starts, strict=True))) for start in starts]
        for name, start in zip(shown, starts, strict=True):
            if start.free_symbols & set(shown):
                unknown = " and ".join(sorted(map(str, start.free_symbols & set(shown))))
                raise BadInput(
                    f"{system.place}: states.{name}.initial: depends on {unknown}, which no output shows, in "
                    "a circle: give one of them as a number"
                )
        imposed = [x for x in system.x if x not in shown]
        rates = [system.dynamics[k] for k in hidden]
        equations = Equations.of(system, shown)
        needed = set[object]().union(*(e.free_symbols for e in (*rates, *starts, *equations.laws.values())))
        driving = [*system.u, *imposed]
        columns = tuple(k for k, name in enumerate(driving) if name in needed)
        equations = replace(equations, states=shown, inputs=[driving[k] for k in columns], rates=rates)
        hold = [*(item.course for item in system.inputs), *(1.0 for _ in imposed)]
        held = tuple(hold[k] for k in columns)
        return cls(assembled(equations), assembled(replace(equations, observed=starts)), columns, held)

    @property
    def parameters(self) -> Indices:
        """Indices of the parameters that the hidden states depend on, shape (such parameters,)."""
        return np.union1d(self.program.parameters, self.initial.parameters)

    def states(
        self,
        windows: Windows,
        at: tuple[Indices, Indices],
        p: Array,
        c: Array,
        period: float,
        substeps: int = SUBSTEPS[0],
    ) -> Array:
        """Integrate from the initial values by the Runge-Kutta method of order four.

        Inputs and imposed states run straight between samples; efforts are those of the known laws.

        Args:
            windows: whole experiments; columns of `windows.u` are the inputs, then the imposed states.
            at: rows of interest: their windows, and their samples since the start, shape (rows,) each.
            p: parameters, shape (experiments, sets, parameters), SI.
            c: constants of the operating points, shape (experiments, constants), SI.
            period: sampling period, s.
            substeps: integration steps per sampling period, default 4; more where these are unstable.

        Returns:
            States, shape (rows, sets, hidden states), SI; not finite where the integration diverges.
        """
        windows = windows._replace(u=windows.u[:, self.columns])
        owner, rows = windows.owner, windows.start[:, None] + windows.shift
        unknown = np.zeros(self.initial.sizes.states)
        x0 = self.initial.evaluate(
            windows.t[windows.start][:, None], unknown, windows.u[rows], p[owner], c[owner][:, None]
        )
        for steps in (substeps, *(more for more in SUBSTEPS if more > substeps)):
            how = Integration(period, "rk4", steps, self.hold)
            z = free_run(self.program, windows, p, c, x0, how)[at[0], :, at[1]]
            if np.isfinite(z).all():
                break
        return np.asarray(z)
