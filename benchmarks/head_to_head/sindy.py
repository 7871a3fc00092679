"""Laws by PySINDy on the residual of the rates: weak form, ensemble of thresholded least squares."""

from __future__ import annotations

import warnings

import numpy as np
import sympy as sp

from benchmarks.head_to_head.method import Model
from benchmarks.head_to_head.residual import Residual, best_law
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.study import Study
from unmodelled.systems.model import Port

#: Largest length of a segment and of all segments, samples.
LONGEST, TOGETHER = 4000, 40_000
#: Half the width of a test function: samples at least, share of the horizon, share of a segment at most.
LEAST, SHARE, MOST = 12, 0.25, 0.2
#: Test functions of a segment at most, and how many of them overlap at a sample, about.
FUNCTIONS, OVERLAP = 400, 3
#: Members of the ensemble, ridge penalty, and thresholds of normalised coefficients that are tried.
MEMBERS, RIDGE, THRESHOLDS = 20, 1e-3, (0.01, 0.03, 0.1, 0.2, 0.4, 0.8)
#: Speed at which the term of dry friction has risen, in root mean squares of the speed.
CREEP = 0.02


class WeakSindy:
    """Weak SINDy with bagging. Terms at every port: polynomials of position and speed up to degree three,
    dry friction, quadratic drag, sine and cosine of an angle, and the inputs.

    The residual is taken twice, of the physics as given and with re-identified parameters, and every
    threshold is tried. Of all models, that with the smallest gap on the training experiments is kept.
    """

    name, needs = "PySINDy", ("pysindy",)

    def fit(self, study: Study) -> Model:
        return best_law(study, _regressed)


def _terms(residual: Residual, port: Port) -> list[sp.Expr]:
    at = residual.coordinates(port)
    terms: list[sp.Expr] = [sp.S.One]
    q, v = at.get("q"), at.get("v")
    pair = [x for x in (q, v) if x is not None]
    for degree in (1, 2, 3):
        for split in range(degree + 1) if len(pair) == 2 else [0]:
            terms.append(pair[0] ** (degree - split) * pair[-1] ** split)
    if v is not None:
        rms = float(np.sqrt(np.mean(residual.values([v]) ** 2))) or 1.0
        terms += [sp.tanh(v / (CREEP * rms)), v * sp.Abs(v)]
    units = {s.name: s.unit for s in residual.base.system.states}
    if q is not None and port.position in units and units[port.position] == "rad":
        terms += [sp.sin(q), sp.cos(q)]
    inputs = [at[f"in_{item.name}"] for item in residual.base.system.inputs]
    return [*terms, *inputs]


def _regressed(residual: Residual, study: Study) -> list[Model]:
    """Models of all thresholds."""
    import pysindy as ps

    logs = residual.logs
    terms = [(p.name, term) for p in residual.ports for term in _terms(residual, p)]
    names = [p.name for p in residual.ports]
    shapes = residual.values([term for _, term in terms])
    at = [names.index(name) for name, _ in terms]
    columns = residual.influence[:, :, at] * shapes[:, None, :]  # (samples, rates, terms)
    lengths = np.diff(logs.offsets)[list(study.learned)]
    length = int(min(lengths.min(), LONGEST))
    each = zip(study.learned, lengths.tolist(), strict=True)
    starts = [logs.offsets[i] + k * length for i, whole in each for k in range(whole // length)]
    starts = starts[:: max(1, -(-len(starts) * length // TOGETHER))]
    half = min(max(LEAST, round(SHARE * study.horizon / logs.period)), int(MOST * length))
    np.random.seed(study.seed)  # noqa: NPY002  (pysindy draws its test functions so)
    t = logs.period * np.arange(length)
    count = int(min(FUNCTIONS, max(20, OVERLAP * length // half)))
    width = half * logs.period
    weak = ps.WeakPDELibrary(ps.IdentityLibrary(), spatiotemporal_grid=t, K=count, H_xt=width, p=4)
    matrix, target = [], []
    scale = np.std(residual.measured, axis=0)
    for start in starts:
        rows = slice(start, start + length)
        for s, k in enumerate(residual.rates):
            x = np.column_stack([columns[rows, s], residual.known[rows, s]])
            integrals = _integrals(weak, x)
            slope = np.asarray(weak.convert_u_dot_integral(logs.x[rows, k, None]))[:, 0]  # by parts
            matrix.append(integrals[:, :-1] / scale[s])
            target.append((slope - integrals[:, -1]) / scale[s])
    theta, rest = np.vstack(matrix), np.concatenate(target)
    size, unit = np.sqrt(np.mean(theta**2, axis=0)), float(np.sqrt(np.mean(rest**2))) or 1.0
    used = size > 1e-12 * max(size.max(), 1e-300)
    theta, rest = theta[:, used] / size[used], rest / unit
    found = []
    for threshold in THRESHOLDS:
        numbers = np.zeros(len(terms))
        numbers[used] = _ensemble(theta, rest, threshold, study.seed) * unit / size[used]
        laws = {
            port: sp.Add(
                *(float(c) * term for (at, term), c in zip(terms, numbers, strict=True) if at == port)
            )
            for port in names
        }
        budget = f"{len(rest)} integrals, {len(terms)} terms, threshold {threshold:g}, {MEMBERS} members"
        found.append(residual.model(laws, budget))
    return found


def _integrals(weak, x: Array) -> Array:  # type: ignore[no-untyped-def]
    """Integrals of columns (samples, columns) with every test function, shape (functions, columns)."""
    each = zip(weak.fullweights0, weak.inds_k, strict=True)
    return np.stack([np.tensordot(w, x[k[0]], axes=(0, 0)) for w, k in each])


def _ensemble(theta: Array, rest: Array, threshold: float, seed: int) -> Array:
    import pysindy as ps

    np.random.seed(seed)  # noqa: NPY002
    steps = ps.STLSQ(threshold=threshold, alpha=RIDGE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fitted = ps.EnsembleOptimizer(steps, bagging=True, n_models=MEMBERS).fit(theta, rest[:, None])
    return np.median(np.array(fitted.coef_list), axis=0).reshape(-1)
