"""Free runs of a system along measured experiments, and the gap between the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from unmodelled.base.errors import BadInput, closest
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.base.tables import write_table
from unmodelled.diagnosis.answer.live_machine import about_machine, simulated
from unmodelled.diagnosis.data.gap import Gap, Off, steps_of
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.own_numbers import with_own_numbers
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.logs.logs import Logs, as_logged
from unmodelled.logs.preparation import prepared_for
from unmodelled.logs.time_units import in_clock
from unmodelled.systems.given import SystemGiven
from unmodelled.systems.model import System

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE, SUMMARY = "simulation", "simulation.json"


@dataclass(frozen=True, eq=False, repr=False)
class Simulation:
    """Free runs of a system beside the measured outputs; made by `simulate`.

    Attributes:
        system: simulated system.
        logs: measured experiments.
        horizon: length of the free-run windows, s, as given or chosen from the logs.
        runs: numbers of the simulated experiments, in the order of `logs`.
        gap: errors of the free runs, in standard deviations of the outputs and in their units.
    """

    system: System
    logs: Logs
    horizon: float
    runs: tuple[int, ...]
    gap: Gap

    @property
    def value(self) -> float:
        """Return the gap: the root mean square error over windows and outputs, in standard deviations."""
        return self.gap.value

    @property
    def floor(self) -> float:
        """Return the noise floor: the gap that sensor noise alone causes."""
        return self.gap.floor

    @property
    def persistence(self) -> float:
        """Return the error of the prediction that every output keeps its value or its speed."""
        return self.gap.persistence

    @property
    def seconds(self) -> float:
        """Return the length of the windows, s: the horizon, rounded to samples."""
        return steps_of(self.horizon, self.logs) * self.logs.period

    @property
    def units(self) -> pd.DataFrame:
        """Return the errors in units of the outputs' columns, a row per output.

        Columns: output, unit, at_horizon (root mean square error at the last sample of the windows) and
        whole_run (over experiments that are simulated from their first state on); nan where the simulation
        diverges.
        """
        shown = {name: off.as_logged for name, off in self.gap.units.items()}
        rows = [(name, off.unit, off.at_horizon, off.whole_run) for name, off in shown.items()]
        table = pd.DataFrame(rows, columns=["output", "unit", "at_horizon", "whole_run"])
        return table.astype({"at_horizon": float, "whole_run": float})

    @property
    def experiments(self) -> pd.DataFrame:
        """Return the gap and the noise floor of every experiment: id, gap, floor (standard deviations)."""
        rows = [(name, gap, self.gap.floors[name]) for name, gap in self.gap.per_experiment.items()]
        return pd.DataFrame(rows, columns=["id", "gap", "floor"])

    @property
    def worst(self) -> str:
        """Return the id of the experiment with the largest gap."""
        each = self.gap.per_experiment
        return max(each, key=lambda name: each[name])

    def table(self) -> pd.DataFrame:
        """Return a row per sample of the simulated experiments.

        Columns: experiment, t (s), window (number of the free run, from 0 in every experiment), and for every
        output `<name>_measured` and `<name>_simulated` in its unit. A value is nan where nothing is
        simulated; a simulated value that diverged is cut ten standard deviations from the measured one.
        """
        logs, run = self.logs, self.gap.run
        columns: dict[str, Any] = {"experiment": np.array(logs.ids, object)[logs.owner], "t": logs.t}
        columns["window"] = run.window
        for j, name in enumerate(logs.outputs):
            columns |= {f"{name}_measured": logs.y[:, j], f"{name}_simulated": run.y[:, j]}
        chosen = np.isin(logs.owner, self.runs)
        return pd.DataFrame(columns)[chosen].reset_index(drop=True)

    def plot(self, experiment: str | None = None) -> Figure:
        """Draw measured and simulated outputs of one experiment, and the difference between the two.

        Args:
            experiment: id of the experiment; default: the one with the largest gap.

        Raises:
            BadInput: when the experiment was not simulated.
        """
        # load matplotlib
        from unmodelled.report.figures.results import measured_and_simulated
        from unmodelled.report.figures.style import verbatim

        name = self.worst if experiment is None else experiment
        if name not in (ids := list(self.gap.per_experiment)):
            raise BadInput(f"experiment: {name!r} was not simulated{closest(str(name), ids)}")
        rows = self.table()
        for output in self.system.outputs:
            for column in (f"{output.name}_measured", f"{output.name}_simulated"):
                rows[column] = as_logged(output, rows[column].to_numpy(float))
        units = {o.name: (o.column_unit, o.as_difference.text) for o in self.system.outputs}
        with verbatim():
            return measured_and_simulated(rows[rows["experiment"] == name], units, name)

    def save(self, folder: Path | str) -> None:
        """Write the table (simulation.parquet, .csv without pyarrow), simulation.json (the gap) and a page.

        The clock of the table is in the unit of the logs' clock, which its name tells unless it is s. The
        page, index.html, simulates the machine itself: its parameters can be moved.

        Args:
            folder: folder that is new, empty or holds an older simulation; replaced as a whole.

        Raises:
            BadInput: when the folder may not be replaced or cannot be written.
        """
        # load matplotlib and the templates
        from unmodelled.report.figures.style import svg, verbatim
        from unmodelled.report.result_pages import write_simulation_page

        sources = {"system": self.system.source, "logs": self.logs.source}
        with verbatim(), writing("simulate", Path(folder), sources), replacing_folder(Path(folder)) as new:
            write_table(in_clock(self.table(), self.logs.clock), new / TABLE)
            write_json(new / SUMMARY, content := self._content())
            live = simulated(self.system, self.logs, self.runs, self.horizon, self.gap)
            write_simulation_page(new, content, live, about_machine(self.system), svg(self.plot()))

    def __repr__(self) -> str:
        name, each, over = self.worst, self.gap.per_experiment, f"{self.seconds:.3g} s"
        lines = [
            *(f"{output}: {off.says(self.seconds)}" for output, off in self.gap.units.items()),
            f"gap: {self.value:.3g} standard deviations over {over}, {len(each)} experiments",
            f"noise floor: {self.floor:.3g}, the gap that sensor noise alone causes",
            f"persistence: {self.persistence:.3g}, the error if every output kept its value or its speed",
            f"worst experiment: {name}, {each[name]:.3g}",
            *(f"note: {note}" for note in dict.fromkeys([*self.logs.notes, *self.gap.notes])),
        ]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        tables = {
            f"Errors in units of the outputs, after {self.seconds:.3g} s and over whole runs": self.units,
            "Gap of every experiment, in standard deviations of the outputs": self.experiments,
        }
        return shown(f"Free runs of {self.system.name}", repr(self).splitlines(), tables)

    def _content(self) -> dict[str, Any]:
        """Return the content of simulation.json."""
        found = self.gap
        return {
            "schema": "simulation/1",
            "system": self.system.name,
            "horizon": float(self.horizon),
            "gap": {
                "known": found.value,
                "floor": found.floor,
                "persistence": found.persistence,
                "units": {name: _errors(off) for name, off in found.units.items()},
            },
            "outputs": {
                output.name: {
                    "gap": found.per_output[output.name],
                    "unit": output.unit,
                    "rmse": found.per_output[output.name] * found.scale[output.name],
                    "std": found.scale[output.name],
                }
                for output in self.system.outputs
            },
            "experiments": [{"id": name, "known": value} for name, value in found.per_experiment.items()],
            "integration": {"method": "rk4", "substeps": found.substeps},
            "notes": [*self.logs.notes, *found.notes],
        }


def _errors(off: Off) -> dict[str, Any]:
    """Errors of an output, and beside them those in the unit of its column where that is another one."""
    found = {"unit": off.unit, "known": off.at_horizon, "known_whole_run": off.whole_run}
    return found if off.as_logged.unit == off.unit else {**found, "shown": _errors(off.as_logged)}


def simulate(
    system: SystemGiven,
    logs: LogsGiven,
    horizon: float | None = None,
    only: Sequence[str] | str | None = None,
) -> Simulation:
    """Simulate a system along measured experiments and return the gap between the two.

    Free runs of `horizon` seconds, back to back, start at the measured states and see the inputs only. Every
    error is in standard deviations of its output within the experiments, and in the output's unit.

    Args:
        system: known physics, with laws in its ports where it has any; the path of its file; or a result with
            a system, such as an answer.
        logs: measured experiments with the inputs and outputs of the system, the path of their folder, or
            data frames (by id, in a list, or one with the column `experiment`).
        horizon: length of the free-run windows, s; default: from the logs, see
            `unmodelled.diagnosis.data.persistence.default_horizon`.
        only: ids of the experiments to simulate, or one id; default: all. The scale of the outputs is that of
            all experiments in any case.

    Returns:
        The gap, its noise floor, and what was simulated.

    Raises:
        BadInput: when the horizon, a delay or an id cannot be used.

    Examples:
        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> gap = um.simulate(system, logs)
        >>> print(gap)
        theta: 52 mrad off after 0.2 s, 0.2 rad over whole runs
        gap: 0.0467 standard deviations over 0.2 s, 4 experiments
        noise floor: 0.00141, the gap that sensor noise alone causes
        persistence: 0.506, the error if every output kept its value or its speed
        worst experiment: run2, 0.05
        note: omega was estimated from theta by smoothing differentiation over 21 samples
        >>> gap.units.round(3)
          output unit  at_horizon  whole_run
        0  theta  rad       0.052      0.201
        >>> list(gap.table().columns)
        ['experiment', 't', 'window', 'theta_measured', 'theta_simulated']
    """
    known, measured = read_inputs(system, logs)
    runs, own = _chosen(only, measured), prepared_for(known, measured)
    sensors = Sensors(own)
    seconds = horizon_of(own, horizon, sensors)
    own = with_own_numbers(known, own, seconds, runs, sensors)
    return Simulation(known, own, seconds, tuple(runs), free_runs(known, own, seconds, runs, sensors))


def _chosen(only: Sequence[str] | str | None, logs: Logs) -> list[int]:
    """Numbers of the experiments, in their order."""
    if only is None:
        return list(range(len(logs)))
    ids = [str(name) for name in ([only] if isinstance(only, str | int | float) else only)]
    for name in ids:
        if name not in logs.ids:
            raise BadInput(f"only: there is no experiment {name!r}")
    if not ids:
        raise BadInput("only: names no experiment")
    return sorted({logs.ids.index(name) for name in ids})
