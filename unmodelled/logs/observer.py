"""States that no output shows, integrated along the experiments with the others imposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.logs.readings import Reading, hidden_states, without_beside
from unmodelled.systems.model import System

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Integration steps per sampling period; the next number is taken where one is unstable.
SUBSTEPS = (4, 32)


@dataclass(frozen=True, eq=False)
class Observer:
    """Integration of hidden states, driven by the inputs and then by what outputs show of the other states.

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
    def of(cls, system: System, shown: Sequence[Reading]) -> Observer:
        """Return the observer of the states that no output shows.

        Args:
            system: system with the known laws of its ports.
            shown: readings of all other states.

        Raises:
            BadInput: when the initial values of hidden states depend on each other in a circle.
        """
        hidden, states = hidden_states(system, shown), without_beside(system, shown)
        names = [system.x[k] for k in hidden]
        starts = [system.states[k].initial.xreplace(states) for k in hidden]
        for _ in hidden:
            starts = [start.xreplace(dict(zip(names, starts, strict=True))) for start in starts]
        for name, start in zip(names, starts, strict=True):
            if start.free_symbols & set(names):
                unknown = " and ".join(sorted(map(str, start.free_symbols & set(names))))
                raise BadInput(
                    f"{system.place}: states.{name}.initial: depends on {unknown}, which no output shows, in "
                    "a circle: give one of them as a number"
                )
        imposed = [x for x in system.x if x not in names]
        rates = [system.dynamics[k].xreplace(states) for k in hidden]
        equations = Equations.of(system, names)
        laws = {effort: law.xreplace(states) for effort, law in equations.laws.items()}
        needed = set[object]().union(*(e.free_symbols for e in (*rates, *starts, *laws.values())))
        driving = [*system.u, *imposed]
        columns = tuple(k for k, name in enumerate(driving) if name in needed)
        driven = [driving[k] for k in columns]
        equations = replace(equations, states=names, inputs=driven, rates=rates, laws=laws)
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
