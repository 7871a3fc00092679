"""Laws by symbolic regression (pyoperon) on the effort that the known physics lacks at a port."""

from __future__ import annotations

import numpy as np
import sympy as sp

from benchmarks.head_to_head.method import Model
from benchmarks.head_to_head.residual import Residual, best_law
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.study import Study
from unmodelled.systems.model import Port

#: Samples that are regressed, about.
SAMPLES = 2000
#: Individuals and generations of one regression, and its seconds at most.
POPULATION, GENERATIONS, SECONDS = 500, 50, 120
#: Nodes of an expression at most. With scale and intercept, the expression of at most each of these lengths
#: that has the largest coefficient of determination is a candidate.
LENGTH = 20
LENGTHS = (5, 8, 10, 14, 18, 24)
SYMBOLS = "add,sub,mul,aq,tanh,sin,cos,abs,square,constant,variable"
#: Of the largest influence of the effort on a rate: samples with less do not show the effort.
VISIBLE = 0.2


class SymbolicRegression:
    """Genetic programming over expressions of position and speed of the port, inputs and constants.

    The search trades the coefficient of determination off against length. Where several ports act on one
    rate, the law is sought at each of them alone. Residuals are taken of the physics as given and with
    re-identified parameters. Of all laws, that with the smallest gap on the training experiments is kept.
    """

    name, needs = "pyoperon", ("pyoperon",)

    def fit(self, study: Study) -> Model:
        return best_law(study, _regressed)


def _regressed(residual: Residual, study: Study) -> list[Model]:
    ports = list(range(len(residual.ports)))
    groups = [ports] if len(ports) <= len(residual.rates) else [[p] for p in ports]
    return [model for group in groups for model in _of_group(residual, study, group)]


def _of_group(residual: Residual, study: Study, group: list[int]) -> list[Model]:
    """Models of all lengths."""
    logs = residual.logs
    rows = np.flatnonzero(np.isin(logs.owner, study.learned))
    rows = rows[:: -(-len(rows) // SAMPLES)]
    acts = residual.influence[rows][:, :, group]
    rest = (residual.measured - residual.known)[rows]
    size = np.abs(np.linalg.det(acts.swapaxes(1, 2) @ acts)) ** 0.5
    seen = size > VISIBLE * size.max()
    effort = (np.linalg.pinv(acts[seen]) @ rest[seen][:, :, None])[:, :, 0]
    each = {
        residual.ports[p].name: _laws(residual, residual.ports[p], rows[seen], effort[:, j], study.seed)
        for j, p in enumerate(group)
    }
    budget = f"{seen.sum()} samples, {POPULATION} individuals, {GENERATIONS} generations"
    lengths = [n for n in LENGTHS if all(n in laws for laws in each.values())]
    return [
        residual.model({name: laws[n] for name, laws in each.items()}, f"{budget}, at most {n} nodes")
        for n in lengths
    ]


def _laws(residual: Residual, port: Port, rows: Array, effort: Array, seed: int) -> dict[int, sp.Expr]:
    """The best law of every length."""
    from pyoperon.sklearn import SymbolicRegressor

    at = residual.coordinates(port)
    x = residual.values(list(at.values()))[rows]
    scale, unit = np.sqrt(np.mean(x**2, axis=0)), float(np.std(effort))
    if not unit > 0.0:
        return {}
    used = [k for k in range(x.shape[1]) if scale[k] > 0.0 and np.ptp(x[:, k]) > 0.0]
    search = SymbolicRegressor(
        allowed_symbols=SYMBOLS,
        max_length=LENGTH,
        objectives=["r2", "length"],
        population_size=POPULATION,
        generations=GENERATIONS,
        max_time=SECONDS,
        optimizer_iterations=5,
        n_threads=1,
        random_state=seed + 1,
    )
    search.fit(x[:, used] / scale[used], effort / unit)
    names = [f"x_{k}" for k in used]
    variables = {f"x_{k}": sp.Symbol(f"x_{k}", real=True) for k in used}
    each = list(at.values())
    known = {variables[f"x_{k}"]: each[k] / scale[k] for k in used}
    found = {}
    for length in LENGTHS:
        short = [one for one in search.pareto_front_ if one["length"] <= length]
        if short:
            scores = [_explained(search, one["tree"], x[:, used] / scale[used], effort) for one in short]
            best = short[int(np.argmax(scores))]
            text = search.get_model_string(best["tree"], 6, names).replace("^", "**")
            law = sp.sympify(text, locals={**variables, "aq": _analytic_quotient})
            found[length] = (unit * law).xreplace(known)
    return found


def _explained(search, tree, x: Array, effort: Array) -> float:  # type: ignore[no-untyped-def]
    """Squared correlation of a law with the effort."""
    values = np.nan_to_num(np.asarray(search.evaluate_model(tree, x)).ravel())
    return float(np.corrcoef(values, effort)[0, 1] ** 2) if np.ptp(values) > 0.0 else 0.0


def _analytic_quotient(a: sp.Expr, b: sp.Expr) -> sp.Expr:
    """Division without a pole, as operon defines it."""
    return a / sp.sqrt(1 + b**2)
