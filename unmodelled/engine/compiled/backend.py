"""Free runs on a generated kernel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.engine.compiled import rollouts
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Backend, Integration, Sizes, Windows
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import numpy_system_function


@dataclass(frozen=True, eq=False)
class Generated(Backend):
    """System with networks, compiled for its structure: a backend of `free_run`."""

    structure: Augmented
    observed: tuple[sp.Expr, ...]  # in the system's symbols, without efforts
    weights: Array  # (structure.size,)
    scale: Array  # (inputs of all networks,), factors on the inputs of the networks
    gain: Array  # (networks,), magnitudes of the efforts, in the units of the efforts

    @classmethod
    def of(cls, system: System, observed: Sequence[sp.Expr]) -> Generated:
        """Return the known physics of a system, the laws of its ports included, without networks."""
        laws = {symbol(port.effort): port.law or sp.S.Zero for port in system.ports}
        seen = tuple(expression.xreplace(laws) for expression in observed)
        return cls(Augmented(system), seen, np.empty(0), np.empty(0), np.empty(0))

    @property
    def sizes(self) -> Sizes:
        """Numbers of states, inputs, parameters and constants of the system."""
        system = self.structure.system
        return Sizes(*(len(group) for group in (system.x, system.u, system.p, system.c)))

    def run(self, windows: Windows, p: Array, c: Array, x0: Array, how: Integration) -> Array:
        # windows of one length are simulated together
        sets, longest = x0.shape[1], int(windows.steps.max(initial=0))
        y = np.full((len(windows.start), sets, longest + 1, len(self.observed)), np.nan)
        same = bool((p == p[:1]).all())
        owners = np.zeros_like(windows.owner) if same else windows.owner
        for own, steps, b in product(np.unique(owners), np.unique(windows.steps), range(sets)):
            mine = np.flatnonzero((owners == own) & (windows.steps == steps))
            if len(mine):
                part = windows._replace(
                    **{name: getattr(windows, name)[mine] for name in ("start", "steps", "owner")}
                )
                x, _ = self.trajectories(part, b, p[own, b], c, x0[mine, b], int(steps), how)
                y[mine, b, : steps + 1] = self._seen(part, b, p[own, b], c, x)
        return y

    def trajectories(
        self, windows: Windows, b: int, p: Array, c: Array, x0: Array, steps: int, how: Integration
    ) -> tuple[Array, Array]:
        """Simulate windows of one length with one set of parameters.

        Takes p (parameters,), c (experiments, constants), x0 (windows, states); gives states (windows, steps
        + 1, states) and efforts (windows, steps, networks), all SI.
        """
        compiled = kernel(self.structure)
        owner = np.zeros(len(windows.t), np.int64)  # of a sample; the loops ask for those of first samples
        owner[windows.start] = windows.owner
        u = np.ascontiguousarray(windows.u[windows.shift[b] : windows.shift[b] + len(windows.t)])
        x, z = rollouts.simulate(
            *(compiled.evaluate, compiled.layout, np.ascontiguousarray(x0[:, None])),
            *(windows.start, owner, u, c, windows.t, steps),
            *(how.substeps, how.period, how.common_hold, how.stages),
            *(np.ascontiguousarray(p), self.weights, self.scale, self.gain),
        )
        return x, z

    def _seen(self, windows: Windows, b: int, p: Array, c: Array, x: Array) -> Array:
        """Observed values (windows, samples, observed) of states (windows, samples, states)."""
        system = self.structure.system
        if self.observed == tuple(system.x):
            return x
        rows = windows.start[:, None] + np.arange(x.shape[1])
        function = numpy_system_function(system, self.observed, efforts_zero=True)
        u = windows.u[windows.shift[b] + rows]
        return function(windows.t[rows], x, u, np.empty(0), p, c[windows.owner][:, None])
