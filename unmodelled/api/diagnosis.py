"""The answer of a diagnosis, as a user meets it: named effects, tables, figures and pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from unmodelled.base.errors import BadInput, closest
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.diagnosis.answer.findings import Findings
from unmodelled.diagnosis.answer.saved_findings import SavedFindings
from unmodelled.diagnosis.gates.refusal import Refusal
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.report.diagnosis_page import PAGE, write_page
from unmodelled.report.figures.files import figures_of, write_figures
from unmodelled.report.figures.style import verbatim
from unmodelled.report.headline import as_said, effect_name, headline
from unmodelled.systems.given import SystemGiven
from unmodelled.systems.model import System

MODELS = ("known", "reidentified", "augmented", "neural", "floor", "persistence")


@dataclass(frozen=True)
class NamedEffect:
    """Effect that the model leaves out, as an answer names it.

    Attributes:
        family: kind of the effect, coulomb_friction for instance.
        port: place of the effect: a port, actuator:<input>, sensor:<output> or parameter:<name>.
        law: formula of the effect, in names of the augmented system.
        parameters: numbers of the law by name, each with value, unit and interval (95 %), SI.
        confidence: calibrated probability that it is this effect or one of `indistinguishable`, 0 to 1.
        shrink: share of the squared gap above the noise floor that the effect explains, 0 to 1.
        indistinguishable: effects that these data cannot tell from this one, in words.
    """

    family: str
    port: str
    law: str
    parameters: Mapping[str, Mapping[str, Any]]
    confidence: float
    shrink: float
    indistinguishable: tuple[str, ...]

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> NamedEffect:
        """Return the effect that an entry of diagnosis.json describes.

        Args:
            content: entry of the list `effects` in diagnosis.json.
        """
        names = ("family", "port", "law", "parameters", "confidence", "shrink")
        alike = tuple(effect_name(other) for other in content["indistinguishable"])
        return cls(**{name: content[name] for name in names}, indistinguishable=alike)


@dataclass(frozen=True, eq=False)
class GapLocation:
    """Location of the gap, as tables with the largest shares first.

    Attributes:
        channels: port, share of the squared gap above the noise floor.
        regions: signal, low, high (SI), share.
        factors: factor and level of the operating point, share.
        experiments: id, known, augmented: gap as given and with the effects found, standard deviations.
    """

    channels: pd.DataFrame
    regions: pd.DataFrame
    factors: pd.DataFrame
    experiments: pd.DataFrame

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> GapLocation:
        """Return the tables that the entry `where` of diagnosis.json describes.

        Args:
            content: entry `where` of diagnosis.json.
        """
        columns = {
            "channels": ["port", "share"],
            "regions": ["signal", "low", "high", "share"],
            "factors": ["factor", "level", "share"],
            "experiments": ["id", "known", "augmented"],
        }
        return cls(**{name: pd.DataFrame(content[name], columns=each) for name, each in columns.items()})

    def __repr__(self) -> str:
        filled = {name: table for name, table in vars(self).items() if len(table)}
        return "\n\n".join(f"{name}\n{table.to_string(index=False)}" for name, table in filled.items())

    def _repr_html_(self) -> str:
        return shown("Where the gap lies", [], vars(self))


@dataclass(frozen=True, eq=False, repr=False)
class Answer:
    """Answer of a diagnosis; made by `diagnose`.

    Attributes:
        findings: results of the diagnosis: with the fitted models, or as a folder holds them.
    """

    findings: Findings | SavedFindings

    @property
    def verdict(self) -> str:
        """Return effect, main_effect, no_gap, unknown or check_logs."""
        return str(self.findings.content["verdict"])

    @property
    def confidence(self) -> float:
        """Return the calibrated probability that the verdict and its effects are right, 0 to 1."""
        return float(self.findings.content["confidence"])

    @cached_property
    def effects(self) -> tuple[NamedEffect, ...]:
        """Return the effects that the model leaves out, the strongest first."""
        return tuple(NamedEffect.of(entry) for entry in self.findings.content["effects"])

    @cached_property
    def where(self) -> GapLocation:
        """Return the place of the gap: channels, regions, factors, experiments."""
        return GapLocation.of(self.findings.content["where"])

    @property
    def system(self) -> System:
        """Return the system with the diagnosed effects and all identified numbers.

        It is the system as given where the augmented one is not offered (see `refused`), and with the verdict
        check_logs.
        """
        return self.findings.system

    @property
    def refused(self) -> tuple[str, ...]:
        """Return the files that are not offered, a sentence each with the reason and the file to keep."""
        entries = self.findings.content.get("refused", ())
        return tuple(str(Refusal(entry["file"], entry["reason"], entry["keep"])) for entry in entries)

    @property
    def shrink(self) -> float:
        """Return the share of the squared gap above the noise floor that the effects explain, 0 to 1."""
        return float(self.findings.content["gap"]["shrink"])

    @property
    def notes(self) -> tuple[str, ...]:
        """Return remarks on logs, models and integration, a sentence each."""
        return tuple(self.findings.content["notes"])

    @property
    def gaps(self) -> pd.DataFrame:
        """Return model and gap on the held-out experiments, in standard deviations of the outputs.

        The models are the system as given (known), with refitted parameters (reidentified), with the effects
        found (augmented), with a network in every port (neural), the noise floor (floor), and the prediction
        that every output keeps its value or its speed (persistence).
        """
        gap = self.findings.content["gap"]
        return pd.DataFrame([(name, gap[name]) for name in MODELS], columns=["model", "gap"])

    @property
    def units(self) -> pd.DataFrame:
        """Return the errors on the held-out experiments in units of the outputs' columns, a row per output.

        Columns: output, unit, known and augmented (at the end of the free-run windows), known_whole_run and
        augmented_whole_run; nan where the simulation diverges.
        """
        errors = self.findings.content["gap"]["units"]
        rows = [{"output": name, **as_said(entry)} for name, entry in errors.items()]
        numbers = ["known", "augmented", "known_whole_run", "augmented_whole_run"]
        table = pd.DataFrame(rows, columns=["output", "unit", *numbers])
        return table.astype(dict.fromkeys(numbers, float))

    @property
    def parameters(self) -> pd.DataFrame:
        """Return the refitted parameters: name, unit, known, identified, low, high (95 % interval), SI."""
        rows = [
            (name, e["unit"], e["known"], e["identified"], *e["interval"])
            for name, e in self.findings.content["parameters"].items()
        ]
        return pd.DataFrame(rows, columns=["name", "unit", "known", "identified", "low", "high"])

    def table(self) -> pd.DataFrame:
        """Return the numbers of the effects, a row each.

        Columns: effect (in words), law, parameter, value, low, high (95 % interval), unit (SI), confidence
        and shrink (both of the effect, 0 to 1).
        """
        rows = [
            (
                *(effect_name(entry), entry["law"], name, number["value"], *number["interval"]),
                *(number["unit"], entry["confidence"], entry["shrink"]),
            )
            for entry in self.findings.content["effects"]
            for name, number in entry["parameters"].items()
        ]
        columns = ["effect", "law", "parameter", "value", "low", "high", "unit", "confidence", "shrink"]
        return pd.DataFrame(rows, columns=columns)

    def plot(self, figure: str | None = None) -> Figure:
        """Draw a figure of the answer.

        Args:
            figure: name of the figure: gap (default; the gap of every model), lacking (missing effort of the
                known physics), left_over (that of the augmented model), experiments, before_and_after or
                candidates. With the verdict check_logs, only experiments (then the default) and
                before_and_after exist.

        Raises:
            BadInput: when the answer has no such figure.
        """
        with TemporaryDirectory() as place:
            folder = Path(place)
            self.findings.write_tables(folder)
            figures = figures_of(folder)
            name = next(iter(figures)) if figure is None else figure
            if name not in figures:
                raise BadInput(f"figure: there is no {name!r}{closest(str(name), figures)}")
            with verbatim():
                return figures[name](folder)

    def save(self, folder: Path | str, pages: bool = True) -> tuple[str, ...]:
        """Write the answer, the augmented system and the tables; then figures and a page.

        The folder gets diagnosis.json, augmented_system.yaml (a system file; none where the logs are to be
        checked, or where it is not offered, see `refused`), tables, figures and index.html, a page with
        all of it. Into a new folder the answer is written first; an older one is replaced in the end. A
        picture that cannot be drawn is a note.

        Args:
            folder: folder that is new, empty or holds an older diagnosis; replaced as a whole.
            pages: whether figures and the page are made; default: yes.

        Returns:
            Notes on what could not be made; none where everything was.

        Raises:
            BadInput: when the folder may not be replaced, or the answer cannot be written.
        """
        sources = self.findings.sources
        drawn = {"figures": write_figures, PAGE: lambda into: write_page(into, self._command)}
        with writing("diagnose", Path(folder), sources):
            saved = self.findings.save(Path(folder), drawn if pages else None)
        return tuple(saved.content["notes"][len(self.notes) :])

    def __repr__(self) -> str:
        return str(self.findings)

    def _repr_html_(self) -> str:
        tables = {
            "Numbers of the effects": self.table().drop(columns=["law", "confidence", "shrink"]),
            "Errors on held-out experiments, in units of the outputs": self.units,
            "Gap on held-out experiments, in standard deviations of the outputs": self.gaps,
            "Refitted parameters": self.parameters,
            "Channels by which the gap enters": self.where.channels,
        }
        return shown(headline(self.findings.content), repr(self).splitlines(), tables)

    @property
    def _command(self) -> str:
        """The command line that gives this answer; none where system or logs are no files."""
        content, sources = self.findings.content, self.findings.sources
        system, logs = sources.get("system"), sources.get("logs")
        horizon, seed = content["gap"]["horizon"], content["seed"]
        command = f"unmodelled diagnose {system=!s} {logs=!s} {horizon=} {seed=}"
        return command if system and logs else ""


def diagnose(
    system: SystemGiven,
    logs: LogsGiven,
    horizon: float | None = None,
    seed: int = 0,
    workers: int | None = None,
) -> Answer:
    """Diagnose the gap: say which unmodelled effects cause it, where it lies, and how far it shrinks.

    A quarter of the experiments takes no part in fitting or choosing; all gaps are theirs. Where a fault of
    the logs, such as a unit or a sign, explains most of the gap, that is the answer (verdict check_logs).

    Args:
        system: known physics, or the path of its file; parameters marked `identify` are refitted.
        logs: measured experiments, the path of their folder, or data frames (by id, in a list, or one with
            the column `experiment`); a record that is alone is cut into several.
        horizon: length of the free-run windows, s; default: from the logs, see
            `unmodelled.diagnosis.data.persistence.default_horizon`.
        seed: seed of the random generators; the same seed gives the same answer; default 0.
        workers: number of threads; default: one per core.

    Returns:
        Verdict, effects with their numbers, where the gap lies, and the augmented system.

    Raises:
        BadInput: when the system, the logs, the horizon or the seed cannot be used.

    Examples:
        The logs of the example have dry friction in the joint, which its system file leaves out:

        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> answer = um.diagnose(system, logs)
        >>> answer.verdict
        'effect'
        >>> answer.effects[0].family, answer.effects[0].port, answer.effects[0].law
        ('coulomb_friction', 'joint', 'F_c*sign(omega)')
        >>> answer.table()[["parameter", "value", "unit"]].round(3)
          parameter  value unit
        0       F_c   0.06  N m

        The augmented system is simulated like any other:

        >>> before, after = um.simulate(system, logs), um.simulate(answer.system, logs)
        >>> bool(after.value < 0.1 * before.value)
        True
    """
    return Answer(findings(*read_inputs(system, logs), horizon, seed, workers).with_paths())


def read_answer(folder: Path | str) -> Answer:
    """Read the answer that `Answer.save` or the verb `diagnose` wrote.

    Args:
        folder: folder of the answer, with diagnosis.json.

    Returns:
        The answer as it was written: verdict, effects, tables, figures and the augmented system.

    Raises:
        BadInput: when the folder holds no answer of this version.

    Examples:
        >>> import tempfile, unmodelled as um
        >>> folder = f"{tempfile.mkdtemp()}/answer"
        >>> um.diagnose(*um.example("pendulum")).save(folder)
        ()
        >>> answer = um.read_answer(folder)
        >>> answer.verdict, answer.effects[0].law
        ('effect', 'F_c*sign(omega)')
        >>> answer.system.port("joint").law
        F_c*tanh(omega/v_c)
    """
    return Answer(SavedFindings.read(Path(folder)))
