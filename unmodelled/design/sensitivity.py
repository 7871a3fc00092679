"""Sensitivity of the derivatives of a system's states to efforts and parameters (appendix 4.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.logs.differentiate import smooth_derivative
from unmodelled.logs.logs import Logs
from unmodelled.systems.functions import gradient
from unmodelled.systems.model import Parameter, System, symbol
from unmodelled.systems.numeric import numpy_system_function

#: Samples that the matrix is made from, about, at most.
SAMPLES = 20_000
#: Share of the gain's rms: where an effort's gain is smaller (dead centres) its estimate fades to zero.
FADING = 0.1
#: Gauss-Newton steps of the estimated efforts; one is enough where efforts enter linearly.
STEPS = 3


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity matrix of appendix 4.7, dimensionless.

    An entry is the change of a state's derivative, in units of its rms, per effort in units of its rms or per
    parameter in units of its value.
    """

    efforts: tuple[str, ...]  # names of the first columns
    parameters: tuple[str, ...]  # names of the other columns
    matrix: Array  # (rows, columns), a row is one state at one sample
    inputs: tuple[Array, ...]  # of each port's network, each (rows, q)
    notes: tuple[str, ...]  # assumptions that were made, a sentence each

    @property
    def norms(self) -> Array:
        """Root mean squares of the columns, shape (columns,): the text's L2 norm for any number of rows."""
        return np.asarray(np.sqrt(np.mean(self.matrix**2, 0)))


@dataclass(frozen=True)
class _Samples:
    """Thinned samples of all experiments: t (k,), x, u, p, c, measured derivatives x' (k, states)."""

    system: System
    t: Array
    x: Array
    u: Array
    c: Array
    rates: Array

    def values(self, expressions: Sequence[sp.Expr], e: Array) -> Array:
        """Return the values (k, expressions) at efforts `e` (k, ports)."""
        function = numpy_system_function(self.system, expressions)
        return function(self.t, self.x, self.u, e, np.array(self.system.values), self.c)


def sensitivity(system: System, logs: Logs, parameters: Sequence[str] | None = None) -> Sensitivity:
    """Compute the sensitivity matrix along measured experiments, by symbolic differentiation.

    Efforts are estimated by inverse dynamics, as those that explain the measured derivatives best, so that no
    trained network is needed. Only states whose derivative depends on an effort or a parameter have rows.
    """
    chosen = _chosen(system, parameters)
    symbols = (*system.e, *(symbol(p.name) for p in chosen))
    parameters_seen = {symbol(p.name) for p in chosen}
    rows = [i for i, f in enumerate(system.closed) if f.free_symbols & {*symbols}]
    if not any(system.closed[i].free_symbols & parameters_seen for i in rows):
        names = ", ".join(p.name for p in chosen) or "any parameter"
        raise BadInput(
            f"system {system.name}: no derivative of a state depends on {names}: choose other parameters"
        )
    samples = _samples(system, logs)
    sizes = _sizes(samples.rates)[rows]
    e, notes = _efforts(samples, [i for i in rows if logs.measured[i]])
    jacobian = samples.values([d for i in rows for d in gradient(system.closed[i], symbols)], e)
    # a network in a port sees its motion, or the whole state if the port has none
    seen = [tuple(map(system.expression, port.coordinates)) or system.x for port in system.ports]
    inputs = [samples.values(each, e) for each in seen]
    keep = np.isfinite(np.concatenate([jacobian, e, *inputs], 1)).all(1)
    if not keep.any():
        raise BadInput(
            f"system {system.name}: its derivatives have no value at any logged sample: check units "
            "and values"
        )
    if not keep.all():
        notes.append(
            f"{np.count_nonzero(~keep)} samples at which a derivative has no value were left out; "
            "check the equations there"
        )
    hidden = [system.states[i].name for i in rows if not logs.measured[i]]
    if hidden:
        notes.append(f"{', '.join(hidden)}: not measured; the result assumes that its derivative is measured")
    matrix = jacobian[keep].reshape(-1, len(rows), len(symbols)) / sizes[:, None]
    matrix = matrix * np.array([*_sizes(e[keep]), *(_nominal(p) for p in chosen)])
    return Sensitivity(
        tuple(p.effort for p in system.ports),
        tuple(p.name for p in chosen),
        matrix.reshape(-1, len(symbols)),
        tuple(np.repeat(q[keep], len(rows), 0) for q in inputs),
        (*logs.notes, *notes),
    )


def _chosen(system: System, names: Sequence[str] | None) -> list[Parameter]:
    known = {p.name: p for p in system.parameters}
    if names is None:
        return list(known.values())
    if not names:
        raise BadInput("parameters: must name at least one parameter")
    for name in names:
        if name not in known:
            raise BadInput(
                f"parameters: {name!r} is not a parameter of {system.name}, must be one of {', '.join(known)}"
            )
        if list(names).count(name) > 1:
            raise BadInput(f"parameters: {name!r} is named twice: name it once")
    return [known[name] for name in names]


def _nominal(parameter: Parameter) -> float:
    """Return the reference change of a parameter, in its unit."""
    if parameter.value != 0.0:
        return abs(parameter.value)
    width = parameter.bounds[1] - parameter.bounds[0] if parameter.bounds is not None else 0.0
    return 0.5 * width or 1.0


def _sizes(columns: Array) -> Array:
    """Return the rms of every column; 1 for a column of zeros."""
    sizes = np.sqrt(np.mean(columns**2, 0))
    return np.where(sizes > 0.0, sizes, 1.0)


def _samples(system: System, logs: Logs) -> _Samples:
    every = max(1, ceil(len(logs.t) / SAMPLES))
    rates = [smooth_derivative(x, logs.offsets, logs.period)[1] for x in logs.x.T]
    thin = (logs.t[::every], logs.x[::every], logs.u[::every])
    return _Samples(system, *thin, logs.c[logs.owner[::every]], np.stack(rates, -1)[::every])


def _efforts(samples: _Samples, measured: list[int]) -> tuple[Array, list[str]]:
    """Efforts (k, ports) that explain the measured derivatives; nan where the equations have no value."""
    system = samples.system
    e = np.zeros((len(samples.t), len(system.ports)))
    rows = [i for i in measured if system.closed[i].free_symbols & {*system.e}]
    if not system.ports or not rows:
        names = ", ".join(p.effort for p in system.ports)
        return e, [f"{names}: acts on no measured state and is assumed to be zero"] if names else []
    dynamics = [system.closed[i] for i in rows]
    gains = [g for f in dynamics for g in gradient(f, system.e)]
    unit = _sizes(samples.rates[:, rows])
    for _ in range(STEPS):
        error = (samples.rates[:, rows] - samples.values(dynamics, e)) / unit
        gain = samples.values(gains, e).reshape(len(e), len(rows), -1) / unit[:, None]
        known = np.isfinite(error).all(1) & np.isfinite(gain).all((1, 2))
        e[~known] = np.nan
        size = _sizes(gain[known].reshape(-1, len(system.ports))) * np.sqrt(len(rows))
        A = gain[known] / size
        target = error[known] + np.einsum("krp,kp->kr", A, e[known] * size)
        normal = np.einsum("krp,krq->kpq", A, A) + FADING**2 * np.eye(len(system.ports))
        right = np.einsum("krp,kr->kp", A, target)[..., None]
        e[known] = np.linalg.solve(normal, right)[..., 0] / size
    return e, []
