"""The next experiment, as a user meets it: inputs within limits that tell models apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from unmodelled.api.answer import Answer
from unmodelled.base.files import replacing, replacing_folder, write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.base.progress import say
from unmodelled.base.tables import write_table
from unmodelled.design.content import content, drawn_limits, experiment, predictions, sentences
from unmodelled.design.design import Design, design
from unmodelled.design.written import write_experiment
from unmodelled.diagnosis.fitting.checks import check_seed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EXPERIMENT, SUMMARY, PREDICTIONS, FIGURE = "experiment.csv", "next.json", "predictions", "next_experiment.svg"


@dataclass(frozen=True, eq=False, repr=False)
class NextExperiment:
    """The experiment to measure next; made by `next_experiment`.

    Attributes:
        design: experiment, models and criterion.
        sources: system file, logs and limits, by name; "" for what was in memory only.
    """

    design: Design
    sources: Mapping[str, str]

    @cached_property
    def content(self) -> dict[str, Any]:
        """Return the content of next.json."""
        return content(self.design)

    @property
    def odds(self) -> pd.DataFrame:
        """Return the probabilities that an experiment tells the named effects from each alternative.

        Columns: alternative, proposed, chirp, random (0.5 is chance; means over draws of the numbers from
        their intervals; nan where a reference experiment keeps the limits at no amplitude).
        """
        rows = [{"alternative": each["label"], **each["odds"]} for each in self.content["alternatives"]]
        numbers = ["proposed", "chirp", "random"]
        table = pd.DataFrame(rows, columns=["alternative", *numbers])
        return table.astype(dict.fromkeys(numbers, float))

    def table(self) -> pd.DataFrame:
        """Return the experiment: clock (`t`, s; `t_ms` where the logs count ms) and inputs as logged."""
        return experiment(self.design)

    def predictions(self) -> pd.DataFrame:
        """Return inputs and predicted outputs: kind, signal, unit, label of the model, t (s), value.

        The kinds lowest and highest are the ends of the predictions with all draws of the numbers.
        """
        return predictions(self.design)

    def plot(self) -> Figure:
        """Draw the inputs and the outputs that every model predicts, with limits and all draws of numbers."""
        from unmodelled.report.figures.results import next_experiment as drawn  # loads matplotlib
        from unmodelled.report.figures.style import verbatim

        with verbatim():
            return drawn(self.predictions(), drawn_limits(self.content))

    def save(self, folder: Path | str) -> None:
        """Write experiment.csv, next.json, the table predictions and the figure next_experiment.svg.

        The experiment is read back, simulated with every model and compared with the limits before anything
        is kept.

        Args:
            folder: folder that is new, empty or holds an older proposal; replaced as a whole.

        Raises:
            BadInput: when the folder may not be replaced or cannot be written, or the experiment leaves the
                limits.
        """
        from unmodelled.report.figures.style import save, verbatim

        with writing("next", Path(folder), self.sources), replacing_folder(Path(folder)) as new:
            u, system, criterion = self.design.found.u, self.design.system, self.design.criterion
            write_experiment(u, system, criterion.limits, new / EXPERIMENT, criterion.runs)
            write_json(new / SUMMARY, self.content)
            write_table(self.predictions(), new / PREDICTIONS)
            with verbatim(), replacing(new / FIGURE) as temporary:
                save(self.plot(), temporary)

    def __repr__(self) -> str:
        return "\n".join(sentences(self.content))

    def _repr_html_(self) -> str:
        return shown("What to measure next", repr(self).splitlines(), {"Odds": self.odds})


def next_experiment(answer: Answer, limits: Path | str, seed: int = 0) -> NextExperiment:
    """Design the experiment that tells the effects of an answer from their alternatives.

    Every alternative is fitted to the logs in place of the effect that it may stand for. Then inputs of
    five families (steps and holds, ramps, slow reversals, multisines, chirps) are searched for the largest
    distance of the models' free runs, relative to sensor noise, to the uncertainty of all numbers, and to
    the error of the named model over whole runs. If the answer lists no alternatives, the experiment
    narrows the intervals of the named effects' numbers.

    The experiment begins and ends at rest. It keeps the limits, with 5 % of the travel to spare, for 20 draws
    of all models' numbers from their intervals, and promises the mean over these draws.

    Args:
        answer: answer of a diagnosis, also one that `read_answer` has read.
        limits: YAML file with `duration` (s), `inputs` (`low`, `high`, `rate` per second) and, as needed,
            `travel` (`low`, `high`, `speed` of states, outputs or signals), `start`, `operating_point` and
            `period` (s); all in the units of the columns in the system file (mA, degC, %), rates per second.
        seed: seed of the search; the same seed gives the same experiment on one kind of processor; default 0.

    Returns:
        The experiment, with what every model predicts and a chirp and random levels to compare with.

    Raises:
        BadInput: when the answer is damaged or asks to check the logs, its system file or logs have moved,
            the limits cannot be used, or no experiment keeps them for all numbers of the answer.

    Examples:
        >>> import tempfile, unmodelled as um
        >>> answer = um.diagnose(*um.example("pendulum"))
        >>> limits = Path(tempfile.mkdtemp()) / "limits.yaml"
        >>> _ = limits.write_text(
        ...     "duration: 4\\n"
        ...     "inputs: {torque: {low: -0.5, high: 0.5, rate: 5}}\\n"
        ...     "travel: {theta: {low: -1.0, high: 1.0}}\\n"
        ... )
        >>> found = um.next_experiment(answer, limits)
        >>> found.table().columns.tolist(), bool(found.table()["torque"].abs().max() <= 0.5)
        (['t', 'torque'], True)
    """
    system, logs = answer.inputs()
    check_seed(seed)
    sources = {"system": system.source, "logs": logs.source, "limits": str(limits)}
    return NextExperiment(design(system, logs, answer.content, Path(limits), seed, say), sources)
