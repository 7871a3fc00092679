"""What the networks of a hybrid model have learned, written down as formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import sympy as sp
from numpy.typing import NDArray

from unmodelled.api.simulation import Simulation, simulate
from unmodelled.base.errors import BadInput, closest
from unmodelled.base.files import write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.diagnosis.answer.live_machine import about_machine, simulated
from unmodelled.effects.place import Place, Site, site
from unmodelled.effects.scales import Scales
from unmodelled.effects.substitution import with_law
from unmodelled.explanation.closed_form import ClosedForm, closed_form
from unmodelled.explanation.formula_candidates import Motion, Term
from unmodelled.learning.fit import Fit
from unmodelled.learning.held_out import learned_efforts
from unmodelled.logs.logs import Logs
from unmodelled.systems import units
from unmodelled.systems.grammar import evaluate
from unmodelled.systems.model import Parameter, Port, System, symbol
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.scope import Value, scope_of
from unmodelled.systems.units import parse_unit
from unmodelled.systems.writer import write_system

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: Powers of the velocity in terms.
_SPEEDS = {Motion.VISCOUS: 1, Motion.QUADRATIC: 2, Motion.CUBIC: 3}

SUMMARY, SYSTEM = "learned.json", "learned_system.yaml"
#: Samples of a network that a formula is fitted to, at most.
MOST_SAMPLES = 4000


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


@dataclass(frozen=True, eq=False, repr=False)
class LearnedLaws:
    """Formulas of the networks of a fit; made by `learned_laws`.

    Attributes:
        fit: fitted hybrid models.
        logs: experiments that they were trained on.
        laws: law of every network whose inputs are the coordinates of its port.
        notes: networks without a law, and why.
    """

    fit: Fit
    logs: Logs
    laws: tuple[LearnedLaw, ...]
    notes: tuple[str, ...]

    @cached_property
    def system(self) -> System:
        """Return the physics with identified parameters (medians) and the formulas in place of the networks.

        Their numbers are parameters: coefficients `<port>_c1` and so on, and velocity scales `<port>_jump`
        (of dry friction) and `<port>_fade` (of a Stribeck peak).
        """
        table = self.fit.table()
        system = self.fit.system.with_values(dict(zip(table["parameter"], table["median"], strict=True)))
        for law in self.laws:
            system = _with_formula(system, law)
        return system

    @cached_property
    def simulation(self) -> Simulation:
        """Return free runs of `system` along all experiments."""
        return simulate(self.system, self.logs)

    @cached_property
    def known(self) -> Simulation:
        """Return free runs of the physics alone, over the same windows."""
        return simulate(self.fit.system, self.logs, horizon=self.simulation.horizon)

    def table(self) -> pd.DataFrame:
        """Return the formulas.

        Returns:
            One row per network: network, port, formula (SI), unit of its value, rmse (difference to the
            network, in this unit) and explains (share of the variance).
        """
        rows = [
            (law.network, law.port.name, law.form.text, law.port.unit, law.form.rmse, law.explains)
            for law in self.laws
        ]
        return pd.DataFrame(rows, columns=["network", "port", "formula", "unit", "rmse", "explains"])

    def plot(self, network: str | None = None) -> Figure:
        """Draw the effort of a network and its formula over the coordinates of its port.

        Args:
            network: name of the network; default: the first one.

        Raises:
            BadInput: when there is no such network, or no law at all.
        """
        from unmodelled.report.figures.learned import learned_law  # loads matplotlib
        from unmodelled.report.figures.tables import printed

        self._check()
        names = [law.network for law in self.laws]
        if network is not None and network not in names:
            raise BadInput(f"network: {network!r} has no law{closest(network, names)}")
        law = self.laws[0 if network is None else names.index(network)]
        named = {"position": law.port.position, "velocity": law.port.velocity}
        axes = {column: f"{named[column]} ({printed(unit)})" for column, unit in law.units.items()}
        return learned_law(law.samples, axes, law.port.unit)

    def save(self, folder: Path | str) -> None:
        """Write a page (index.html), the formulas (learned.json) and learned_system.yaml to the folder of
        the fit.

        The page simulates the machine with the formulas: their coefficients can be moved.

        Args:
            folder: folder that `Fit.save` or the verb `train` wrote.

        Raises:
            BadInput: when there is no law, the folder holds what another verb or a user wrote, or a file
                cannot be written.
        """
        self._check()
        # load matplotlib and the templates
        from unmodelled.report.figures.learned import losses
        from unmodelled.report.figures.style import svg
        from unmodelled.report.training_page import write_training_page

        with writing("train", Path(folder), {"system": self.fit.system.source, "logs": self.logs.source}):
            write_system(self.system, Path(folder) / SYSTEM)
            write_json(Path(folder) / SUMMARY, content := self._content())
            found = self.simulation
            write_training_page(
                Path(folder),
                content,
                simulated(self.system, self.logs, found.runs, found.horizon, found.gap),
                about_machine(self.fit.system),
                {law.network: svg(self.plot(law.network)) for law in self.laws},
                svg(losses(self.fit.history)),
            )

    def _check(self) -> None:
        if not self.laws:
            raise BadInput("; ".join(self.notes) or "the fit has no networks")

    def __repr__(self) -> str:
        rows = self.table().itertuples()
        lines = [
            f"{row.network}: {row.formula} (in {row.unit}; {100.0 * row.explains:.3g} % of its variance)"
            for row in rows
        ]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def _repr_html_(self) -> str:
        return shown("Learned laws", repr(self).splitlines(), {"Formulas of the networks": self.table()})

    def _content(self) -> dict[str, Any]:
        """Return the content of learned.json."""
        found, known, table = self.simulation, self.known, self.fit.table()
        return {
            "schema": "learned/1",
            "system": self.fit.system.name,
            "models": self.fit.model.batch,
            "folds": len(self.fit.folds),
            "seconds": self.fit.seconds,
            "laws": [
                {**row, "largest": float(np.abs(law.samples["effort"]).max())}
                for row, law in zip(self.table().to_dict("records"), self.laws, strict=True)
            ],
            "parameters": table.to_dict("records"),
            "horizon": float(found.horizon),
            "gap": {"known": known.value, "formulas": found.value, "floor": found.floor},
            "units": {
                name: {
                    **{"unit": off.unit, "known": known.gap.units[name].at_horizon},
                    **{"formulas": off.at_horizon, "formulas_whole_run": off.whole_run},
                }
                for name, off in found.gap.units.items()
            },
            "notes": list(self.notes),
        }


def learned_laws(fit: Fit, logs: Logs) -> LearnedLaws:
    """Write down what the networks of a fit have learned.

    Every network is evaluated at the measured states of the experiments that it was trained on, as the mean
    over these models. The formula is a sum of few terms in position and velocity of its port (`closed_form`).

    Args:
        fit: fitted hybrid models.
        logs: experiments that they were trained on.

    Returns:
        Formulas, and the system with them.

    Raises:
        BadInput: when the logs have other states than the system, or lack all training experiments.

    Examples:
        The network of the example has learned the dry friction that the system file leaves out:

        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> found = um.learned_laws(um.train(system, logs, um.one_per_port(hidden=32)), logs)
        >>> "omega" in found.laws[0].form.text and found.laws[0].explains > 0.9
        True
        >>> bool(found.simulation.value < 0.5 * um.simulate(system, logs).value)
        True
    """
    trained = {fold: np.flatnonzero(known) for fold, known in fit.seen(logs).items()}
    if not any(len(runs) for runs in trained.values()):
        raise BadInput("logs: no experiment was trained on: give the logs of the training")
    efforts = learned_efforts(fit.model, logs, trained, fit.repeats)
    efforts = efforts.iloc[:: -(-len(efforts) // MOST_SAMPLES)]
    scales = Scales.measured(fit.system, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
    laws, notes = [], []
    for network in fit.model.structure.networks:
        name, port = network.label or network.port, fit.system.port(network.port)
        if {*network.inputs} <= {fit.system.expression(n) for n in port.coordinates}:
            laws.append(
                _law(fit.system, logs, name, site(fit.system, Place("port", port.name), scales), efforts)
            )
        else:
            notes.append(f"{name}: not written down, its inputs are not those of the port {port.name}")
    return LearnedLaws(fit, logs, tuple(laws), tuple(notes))


def _law(system: System, logs: Logs, name: str, at: Site, efforts: pd.DataFrame) -> LearnedLaw:
    rows, port = efforts.index.to_numpy(), system.port(at.place.name)
    values = numpy_system_function(
        system, [system.expression(n) for n in port.coordinates], efforts_zero=True
    )
    here = logs.t[rows], logs.x[rows], logs.u[rows], np.empty(0)
    columns = dict(
        zip(port.coordinates, values(*here, np.array(system.values), logs.c[logs.owner[rows]]).T, strict=True)
    )
    nothing = np.zeros(len(rows))
    x, v = (columns.get(n or "", nothing) for n in (port.position, port.velocity))
    angle = port.position in {state.name for state in system.states if state.unit == "rad"}
    effort = efforts[name].to_numpy(np.float64)
    form = closed_form(
        x, v, effort, logs.owner[rows], (port.position or "x", port.velocity or "v"), angle=angle
    )
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


def _with_formula(system: System, law: LearnedLaw) -> System:
    """The system with a formula in a port; its coefficients and velocity scales are parameters."""
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
        total += (
            symbol(name) * evaluate(text, replace(scope, values={**scope.values, **own}), name).expression
        )
        written.append(name if text == "1" else f"{name}*{text}")
    if not added:
        return system
    return with_law(
        replace(system, parameters=(*system.parameters, *added)), port, total, " + ".join(written)
    )


def _unit(term: Term, law: LearnedLaw) -> str:
    """Unit of the coefficient of a term."""
    powers = {"position": term.power, "velocity": _SPEEDS.get(term.motion, 0)}
    found = parse_unit(law.port.unit).dimension
    for coordinate, power in powers.items():
        if power:
            divisor = units.power(parse_unit(law.units[coordinate]).dimension, Fraction(-power))
            found = units.times(found, divisor)
    return units.describe(found)
