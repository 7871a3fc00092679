"""A law that a network has learned: its formula, and the formula in the port of a system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pandas as pd
import sympy as sp

from unmodelled.effects.formula_candidates import Motion, Term
from unmodelled.effects.place import Site
from unmodelled.effects.substitution import with_law
from unmodelled.learning.closed_form import ClosedForm, closed_form
from unmodelled.logs.logs import Logs
from unmodelled.systems import units
from unmodelled.systems.grammar import evaluate
from unmodelled.systems.model import Parameter, Port, System, symbol
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.scope import Value, scope_of
from unmodelled.systems.units import parse_unit

#: Powers of the velocity in terms.
_SPEEDS = {Motion.VISCOUS: 1, Motion.QUADRATIC: 2, Motion.CUBIC: 3}


@dataclass(frozen=True, eq=False)
class LearnedLaw:
    """Effort of a network, and the formula that reproduces it.

    Attributes:
        network: name of the network: its label, or that of its port.
        port: port of the network.
        units: units of position and velocity, as far as the port has them.
        samples: measured states of the training experiments: columns id, position, velocity (nan where the
            port has none), effort (mean over the models) and formula, in SI units.
        form: shortest formula that reproduces the effort.
        explains: share of the effort's variance that the formula reproduces.
    """

    network: str
    port: Port
    units: Mapping[str, str]
    samples: pd.DataFrame
    form: ClosedForm
    explains: float


def law_of(system: System, logs: Logs, name: str, at: Site, efforts: pd.DataFrame) -> LearnedLaw:
    """Write down the effort of a network.

    Args:
        system: physics that the network is added to.
        logs: measured experiments.
        name: name of the network, a column of `efforts`.
        at: port of the network.
        efforts: efforts at some samples, by number of the sample, with the column id.
    """
    rows, port = efforts.index.to_numpy(), system.port(at.place.name)
    expressions = [system.expression(name) for name in port.coordinates]
    values = numpy_system_function(system, expressions, efforts_zero=True)
    here = logs.t[rows], logs.x[rows], logs.u[rows], np.empty(0)
    found = values(*here, np.array(system.values), logs.c[logs.owner[rows]])
    columns = dict(zip(port.coordinates, found.T, strict=True))
    nothing = np.zeros(len(rows))
    x, v = (columns.get(n or "", nothing) for n in (port.position, port.velocity))
    angle = port.position in {state.name for state in system.states if state.unit == "rad"}
    effort = efforts[name].to_numpy(np.float64)
    names = port.position or "x", port.velocity or "v"
    form = closed_form(x, v, effort, logs.owner[rows], names, angle=angle)
    formula = form(x, v)
    samples = pd.DataFrame(
        {
            "id": efforts["id"],
            "position": x if port.position else np.nan,
            "velocity": v if port.velocity else np.nan,
            "effort": effort,
            "formula": formula,
        }
    )
    spread = float(np.var(effort))
    explains = 1.0 - float(np.mean((effort - formula) ** 2)) / spread if spread > 0.0 else 1.0
    own = {"position": "x", "velocity": "v"}
    named = {column: at.quantities[local].unit for column, local in own.items() if local in at}
    return LearnedLaw(name, port, named, samples, form, explains)


def with_formula(system: System, law: LearnedLaw) -> System:
    """Return the system with a formula in a port; its coefficients and velocity scales are parameters.

    Args:
        system: system with the port.
        law: law of a network in this port.
    """
    port, names = system.port(law.port.name), {*scope_of(system).values}
    added: list[Parameter] = []

    def number(suffix: str, unit: str, value: float) -> str:
        name = f"{port.name}_{suffix}"
        while name in names:
            name += "_"
        names.add(name)
        added.append(Parameter(name, unit, value))
        return name

    sizes = {kind: max((getattr(t, kind) for t in law.form.terms), default=0.0) for kind in ("jump", "fade")}
    scales = {kind: number(kind, law.units["velocity"], size) for kind, size in sizes.items() if size}
    scope, total, written = scope_of(system), sp.S.Zero, []
    for k, (term, value) in enumerate(zip(law.form.terms, law.form.coefficients.values(), strict=True), 1):
        name = number(f"c{k}", _unit(term, law), value)
        text = term.text(port.position or "x", port.velocity or "v", **scales)
        own = {n: Value(symbol(n)) for n in scales.values()}
        known = replace(scope, values={**scope.values, **own})
        total += symbol(name) * evaluate(text, known, name).expression
        written.append(name if text == "1" else f"{name}*{text}")
    if not added:
        return system
    grown = replace(system, parameters=(*system.parameters, *added))
    return with_law(grown, port, total, " + ".join(written))


def _unit(term: Term, law: LearnedLaw) -> str:
    """Unit of the coefficient of a term."""
    powers = {"position": term.power, "velocity": _SPEEDS.get(term.motion, 0)}
    found = parse_unit(law.port.unit).dimension
    for coordinate, power in powers.items():
        if power:
            divisor = units.power(parse_unit(law.units[coordinate]).dimension, Fraction(-power))
            found = units.times(found, divisor)
    return units.describe(found)
