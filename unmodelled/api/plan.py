"""Planned experiments, as a user meets them: which effects they could show before any log exists."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing, replacing_folder, write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.base.progress import say
from unmodelled.design.allowed import Watched
from unmodelled.design.limits import Limits, read_limits
from unmodelled.design.plan_content import effects_table, plan_content, plan_lines
from unmodelled.design.planned import Inputs, default_inputs, read_inputs, simulated_logs
from unmodelled.design.visible import Alike, Visible, alike, visible
from unmodelled.design.written import DIGITS, ends_notes, frame, rest_notes, write_experiment
from unmodelled.diagnosis.fitting.checks import check_seed
from unmodelled.systems.given import SystemGiven, system_of
from unmodelled.systems.model import System


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """Planned experiments with the effects that they could show; made by `plan`.

    Attributes:
        system: known physics.
        limits: limits, start, operating point and noise.
        inputs: inputs by name of the experiment, shape (samples, inputs), SI.
        effects: effects along the experiments.
        alike: pairs of effects that would look alike.
        seed: seed of the experiments and of the noise.
        sources: system file and limits, by name; "" for what was in memory only.
        notes: inputs that do not begin and end at rest, and what the travel is sure of; default none.
    """

    system: System
    limits: Limits
    inputs: Inputs
    effects: tuple[Visible, ...]
    alike: tuple[Alike, ...]
    seed: int
    sources: Mapping[str, str]
    notes: tuple[str, ...] = ()

    @cached_property
    def content(self) -> dict[str, Any]:
        """Return the content of plan.json."""
        about = plan_content(self.system, self.limits, self.inputs, self.effects, self.alike, self.seed)
        return about | {"notes": list(self.notes)}

    def table(self) -> pd.DataFrame:
        """Return a row per effect.

        Columns: effect (in words), number, size (smallest one that shows with 95 %, nan if no plausible size
        does) and unit (of the logs), share (of the plausible size), looks_like (effects in words).
        """
        return effects_table(self.content)

    def experiments(self) -> dict[str, pd.DataFrame]:
        """Return the experiments by name: t (s), and every input in the unit of its column in the logs."""
        return {name: frame(u, self.system, self.limits) for name, u in self.inputs.items()}

    def save(self, folder: Path | str) -> None:
        """Write plan.json, effects.csv, and the experiments as CSV files into the folder `experiments`.

        Every experiment is read back, simulated and compared with the limits before anything is kept.

        Args:
            folder: folder that is new, empty or holds an older plan; replaced as a whole.

        Raises:
            BadInput: when the folder may not be replaced or cannot be written, or an experiment leaves the
                limits.
        """
        with writing("plan", Path(folder), self.sources), replacing_folder(Path(folder)) as new:
            write_json(new / "plan.json", self.content)
            with replacing(new / "effects.csv") as temporary:
                self.table().to_csv(temporary, index=False, float_format=DIGITS)
            watch, chosen = Watched(self.system, self.limits), not self.sources["inputs"]
            for name, u in self.inputs.items():
                file = new / "experiments" / f"{name}.csv"
                write_experiment(u, self.system, self.limits, file, watch, chosen)

    def __repr__(self) -> str:
        return "\n".join(plan_lines(self.content))

    def _repr_html_(self) -> str:
        return shown("What the experiments could show", [], {"Effects": self.table()})


def plan(system: SystemGiven, limits: Path | str, inputs: Path | str | None = None, seed: int = 0) -> Plan:
    """Tell which effects of the library planned experiments could show, and which would look alike.

    No log is needed: the known physics is simulated with the noise of the sensors. An effect changes the
    outputs in proportion to its size; the part of the change that the uncertain parameters, the timing of the
    inputs and the initial states cannot explain counts. A size shows if it is told from none with 95 %.

    Args:
        system: known physics, or the path of its file; parameters marked `identify` are re-fitted.
        limits: YAML file with `duration` and `period` (s), `inputs` (`low`, `high`, `rate` per second),
            `noise` (standard deviation of every output) and, as needed, `travel` (`low`, `high`, `speed` of
            states, outputs or signals), `start` and `operating_point`; all in the units of the columns in
            the system file (mA, degC, %), rates per second.
        inputs: CSV file with t (s) and the columns of the inputs, or a folder with such files, which must
            keep the limits; default: two experiments of each of five families of signals within the limits.
        seed: seed of the experiments and of the noise; the same seed gives the same files on one kind of
            processor; default 0.

    Returns:
        The effects with the sizes from which they show, and the pairs that would look alike.

    Raises:
        BadInput: when the limits or the inputs cannot be used, or no experiment keeps the limits.

    Examples:
        >>> import tempfile, unmodelled as um
        >>> system, _ = um.example("pendulum")
        >>> limits = Path(tempfile.mkdtemp()) / "limits.yaml"
        >>> _ = limits.write_text(
        ...     "duration: 2\\n"
        ...     "period: 0.01\\n"
        ...     "inputs: {torque: {low: -0.5, high: 0.5, rate: 5}}\\n"
        ...     "travel: {theta: {low: -1.0, high: 1.0}}\\n"
        ...     "noise: {theta: 0.0005}\\n"
        ... )
        >>> table = um.plan(system, limits).table().set_index("effect")
        >>> bool(0.0 < table.loc["Coulomb friction at joint", "share"] < 0.05)
        True
    """
    check_seed(seed)
    system = system_of(system)
    if not system.inputs:
        raise BadInput(
            f"{system.place}: has no inputs, so that there is no experiment to plan: log the machine"
        )
    bounds = read_limits(Path(limits), system)
    say("choose the experiments")
    given = None if inputs is None else read_inputs(Path(inputs), system, bounds)
    chosen = given or default_inputs(system, bounds, seed)
    logs = simulated_logs(chosen, system, bounds, seed)
    say("compute what every effect changes")
    found = visible(system, logs, np.array([bounds.noise[output.name] for output in system.outputs]))
    sources = {"system": system.source, "limits": str(limits), "inputs": str(inputs or "")}
    tables = [(name, frame(u, system, bounds)) for name, u in (given or {}).items()]
    notes = ends_notes(tables, system, bounds) if given else rest_notes(system, bounds)
    notes += Watched(system, bounds).notes
    return Plan(system, bounds, chosen, tuple(found), tuple(alike(found)), seed, sources, tuple(notes))
