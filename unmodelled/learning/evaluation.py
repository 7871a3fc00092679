"""Judge fitted hybrid models by free runs of experiments that took no part in their training."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Indices
from unmodelled.base.errors import BadInput
from unmodelled.base.notebook import shown
from unmodelled.effects.telling import unit_of
from unmodelled.engine.free_run import Integration
from unmodelled.learning.fit import Fit
from unmodelled.learning.held_out import free_runs, learned_efforts, surfaces
from unmodelled.learning.nnap import Nnap
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.units import LoggedUnit

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation:
    """Free runs of held-out experiments by fitted hybrid models.

    Attributes:
        errors: error of every free run: columns fold, repeat, id, state, rmse (unit of the state), diverged;
            one row per measured state.
        examples: trajectories of the first repeat: columns fold, id, t (s), and <state>_measured and <state>
            in the unit of the state.
        efforts: efforts of the networks on the training experiments: columns id, t (s), and one per network,
            the mean over the models that were trained on the experiment.
        surface: networks of two inputs on a grid: columns stage, network, q0, q1 (the inputs) and effort.
        units: unit of every measured state by its name, that of the column which shows it where there is one.
        error_units: the same of errors: K on a scale in degC.
    """

    errors: pd.DataFrame
    examples: pd.DataFrame
    efforts: pd.DataFrame
    surface: pd.DataFrame
    units: Mapping[str, LoggedUnit]
    error_units: Mapping[str, LoggedUnit]

    def table(self) -> pd.DataFrame:
        """Return the errors of the free runs by state, in the units of the log.

        Returns:
            One row per measured state: state, unit, median, low and high (smallest and largest root mean
            square error over the free runs), runs (their number) and diverged (number of diverged free runs).
        """
        size = self.errors["state"].map({name: unit.factor for name, unit in self.error_units.items()})
        errors = self.errors.assign(rmse=self.errors["rmse"] / size)
        groups = errors.groupby("state", sort=False)
        rmse = groups["rmse"]
        columns = {"median": rmse.median(), "low": rmse.min(), "high": rmse.max(), "runs": rmse.size()}
        table = pd.DataFrame({**columns, "diverged": groups["diverged"].sum().astype(int)}).reset_index()
        table.insert(1, "unit", [self.error_units[str(name)].text for name in table["state"]])
        return table

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return all tables by the name of the file in which the verb `evaluate` writes each."""
        return {name: getattr(self, name) for name in ("errors", "examples", "efforts", "surface")}

    def __str__(self) -> str:
        """Median error of the free runs, one line per measured state."""
        return "\n".join(
            f"{row.state}: held-out free-run RMSE {row.median:.3g} {row.unit} "
            f"(median of {row.runs}, {row.diverged} diverged)"
            for row in self.table().itertuples()
        )

    __repr__ = __str__

    def _repr_html_(self) -> str:
        caption = "Root mean square error of free runs of held-out experiments"
        return shown("Held-out free runs", [], {caption: self.table()})

    def plot(self, experiment: str | None = None) -> Figure:
        """Draw the measured and the simulated states of one held-out experiment over time.

        Args:
            experiment: id of the experiment; default: the first held-out experiment.

        Returns:
            A figure with one axis per measured state.

        Raises:
            BadInput: when no free run of this experiment exists.
        """
        from matplotlib.figure import Figure

        ids = list(dict.fromkeys(self.examples["id"]))
        name = ids[0] if experiment is None else experiment
        if name not in ids:
            raise BadInput(f"experiment: {name!r} must be one of the held-out {', '.join(map(str, ids))}")
        shown = self.examples[self.examples["id"] == name]
        shown = shown[shown["fold"] == shown["fold"].iloc[0]]
        states = list(dict.fromkeys(self.errors["state"]))
        figure = Figure(layout="constrained")
        axes = figure.subplots(len(states), sharex=True, squeeze=False)[:, 0]
        for axis, state in zip(axes, states, strict=True):
            unit = self.units[state]
            both = (unit.from_si(shown[name].to_numpy(float)) for name in (f"{state}_measured", state))
            axis.plot(shown["t"], next(both), color="0.6", label="measured")
            axis.plot(shown["t"], next(both), label="simulated")
            axis.set_ylabel(f"{state} [{unit.text}]")
        axes[0].legend()
        axes[0].set_title(f"held-out experiment {name}")
        axes[-1].set_xlabel("t [s]")
        return figure


def evaluate(fit: Fit, logs: LogsGiven) -> Evaluation:
    """Simulate every experiment that a model was not trained on, from its first measured state.

    The models of a fold simulate all experiments of `logs` whose ids are not among the training experiments
    of the fold.

    Args:
        fit: fitted models of a system.
        logs: measured experiments of the same system, those of the training or others; the path of their
            folder, or data frames.

    Returns:
        Errors, trajectories and learned efforts.

    Raises:
        BadInput: when the logs have other states than the system, or every experiment was trained on.

    Examples:
        On held-out experiments, the network lowers the error of the known physics to less than a half:

        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> fit = um.train(system, logs, um.one_per_port(hidden=4))
        >>> errors = um.evaluate(fit, logs).table()
        >>> errors[["state", "unit", "runs", "diverged"]]
           state   unit  runs  diverged
        0  theta    rad     4         0
        1  omega  rad/s     4         0
        >>> bool(errors["median"][0] < 0.5 * um.simulate(system, logs).units["whole_run"][0])
        True
    """
    _, logs = read_inputs(fit, logs)
    seen = fit.seen(logs)
    if all(known.all() for known in seen.values()):
        raise BadInput("logs: every experiment was trained on: give logs of other experiments")
    trained = {name: np.flatnonzero(known) for name, known in seen.items()}
    tests = {name: np.flatnonzero(~known) for name, known in seen.items()}
    how = replace(fit.integration, period=logs.period)
    return judged(fit.model, logs, trained, tests, fit.repeats, how)


def judged(
    model: Nnap,
    logs: Logs,
    trained: Mapping[str, Indices],
    tests: Mapping[str, Indices],
    repeats: int,
    how: Integration,
) -> Evaluation:
    """Simulate the test experiments (k,) of all folds, and evaluate networks on the trained ones (k,)."""
    found = free_runs(model, logs, tests, repeats, how)
    return Evaluation(
        errors=found.errors,
        examples=found.examples,
        efforts=learned_efforts(model, logs, trained, repeats),
        surface=surfaces({"converged": model}, logs),
        units=_units(model.structure.system, level=True),
        error_units=_units(model.structure.system, level=False),
    )


def _units(system: System, *, level: bool) -> dict[str, LoggedUnit]:
    """Units of the states as the log has them, of points on their scales or of differences."""
    return {s.name: unit_of(system, s.name, level) or LoggedUnit(s.unit, 1.0, 0.0) for s in system.states}
