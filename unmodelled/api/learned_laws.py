"""What the networks of a hybrid model have learned, written down as formulas."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from unmodelled.api.learned_law import LearnedLaw, law_of, with_formula
from unmodelled.api.simulation import Simulation, simulate
from unmodelled.base.errors import BadInput, closest
from unmodelled.base.files import extending_folder, write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.diagnosis.answer.column_units import axis_unit
from unmodelled.diagnosis.answer.live_machine import about_machine, simulated
from unmodelled.diagnosis.data.gap import Off
from unmodelled.effects.place import Place, site
from unmodelled.effects.scales import Scales
from unmodelled.learning.fit import Fit
from unmodelled.learning.held_out import learned_efforts
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.units import LoggedUnit
from unmodelled.systems.writer import write_system

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUMMARY, SYSTEM = "learned.json", "learned_system.yaml"
#: Samples of a network that a formula is fitted to, at most.
MOST_SAMPLES = 4000


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
            system = with_formula(system, law)
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
        from unmodelled.report.figures.results import learned_law  # loads matplotlib
        from unmodelled.report.figures.tables import printed

        self._check()
        names = [law.network for law in self.laws]
        if network is not None and network not in names:
            raise BadInput(f"network: {network!r} has no law{closest(network, names)}")
        law = self.laws[0 if network is None else names.index(network)]
        named = {"position": law.port.position, "velocity": law.port.velocity}
        samples, axes = law.samples.copy(), dict[str, str]()
        for column, si in law.units.items():
            unit = axis_unit(self.fit.system, str(named[column])) or LoggedUnit(si, 1.0, 0.0)
            samples[column] = unit.from_si(samples[column].to_numpy(float))
            axes[column] = f"{named[column]} ({printed(unit.text)})"
        return learned_law(samples, axes, law.port.unit)

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
        from unmodelled.report.figures.results import losses
        from unmodelled.report.figures.style import svg
        from unmodelled.report.result_pages import write_training_page

        sources = {"system": self.fit.system.source, "logs": self.logs.source}
        with writing("train", Path(folder), sources), extending_folder(Path(folder)) as new:
            write_system(self.system, new / SYSTEM)
            write_json(new / SUMMARY, content := self._content())
            found = self.simulation
            write_training_page(
                new,
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
            "units": {name: _errors(known.gap.units[name], off) for name, off in found.gap.units.items()},
            "notes": list(self.notes),
        }


def _errors(known: Off, formulas: Off) -> dict[str, Any]:
    """Errors of an output, and beside them those in the unit of its column where that is another one."""
    found = {"unit": known.unit, "known": known.at_horizon}
    found |= {"formulas": formulas.at_horizon, "formulas_whole_run": formulas.whole_run}
    shown = known.as_logged
    return found if shown.unit == known.unit else {**found, "shown": _errors(shown, formulas.as_logged)}


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
            at = site(fit.system, Place("port", port.name), scales)
            laws.append(law_of(fit.system, logs, name, at, efforts))
        else:
            notes.append(f"{name}: not written down, its inputs are not those of the port {port.name}")
    return LearnedLaws(fit, logs, tuple(laws), tuple(notes))
