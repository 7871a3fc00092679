"""The answer of a diagnosis, as a user meets it: named effects, tables, figures and pages."""

from __future__ import annotations

import os
import shutil
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from unmodelled.api.intervals import interval_table
from unmodelled.api.named_effect import FitSummary, GapLocation, NamedEffect
from unmodelled.base.errors import BadInput, closest, printable
from unmodelled.base.files import copy_results, replacing_folder
from unmodelled.base.markers import links_in
from unmodelled.base.next_step import next_step
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.diagnosis.answer.augmented import FILE
from unmodelled.diagnosis.answer.findings import SUMMARY, TABLES, Findings, with_parts
from unmodelled.diagnosis.answer.live import LIVE
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.gates.refusal import Refusal
from unmodelled.logs.inputs import read_inputs
from unmodelled.logs.logs import Logs
from unmodelled.report.answer_tables import (
    comparison_table,
    evidence_table,
    gap_table,
    number_table,
    parameter_table,
    unit_table,
)
from unmodelled.report.diagnosis_page import PAGE, command_of, write_page
from unmodelled.report.figures.files import figures_of, write_figures
from unmodelled.report.figures.style import verbatim
from unmodelled.report.headline import headline, outcome
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system


@dataclass(frozen=True, eq=False, repr=False)
class Answer:
    """Answer of a diagnosis; made by `diagnose`, or read by `read_answer`.

    Attributes:
        folder: folder with the files of the answer; of one that is not saved, a temporary one.
        content: content of diagnosis.json.
        given: system and logs, where they are known; default: they are read from where `content` says.
    """

    folder: Path
    content: Mapping[str, Any]
    given: tuple[System, Logs] | None = None

    @classmethod
    def of(cls, found: Findings, laws: str = "") -> Answer:
        """Write what a diagnosis has found into a temporary folder, which goes with the answer.

        Args:
            found: results of a diagnosis.
            laws: path of the file of the laws that were tried, too; default "": none.
        """
        folder = Path(mkdtemp(prefix="unmodelled-"))
        system, logs = given = found.diagnosis.system, found.diagnosis.logs
        files = {"system": system.source, "logs": logs.source, "laws": laws}
        try:
            sources = {name: str(Path(path).absolute()) for name, path in files.items() if path}
            sources["made"] = datetime.now(UTC).isoformat(timespec="minutes")
            content = found.write(folder, sources=sources)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        answer = cls(folder, content, given)
        weakref.finalize(answer, _remove, folder, os.getpid())
        return answer

    @property
    def verdict(self) -> str:
        """Return effect, main_effect, no_gap, unknown or check_logs."""
        return str(self.content["verdict"])

    @property
    def confidence(self) -> float:
        """Return the calibrated probability that the verdict and its effects are right, 0 to 1."""
        return float(self.content["confidence"])

    @cached_property
    def effects(self) -> tuple[NamedEffect, ...]:
        """Return the effects that the model leaves out, those with the largest shares first."""
        return tuple(NamedEffect.of(entry, self.content) for entry in self.content["effects"])

    def law(self, name: str) -> NamedEffect:
        """Return the named effect of a family.

        Args:
            name: family of the effect, such as "coulomb_friction", or its name in words.

        Raises:
            BadInput: when the answer names no such effect.
        """
        for effect in self.effects:
            if name in (effect.family, effect.name):
                return effect
        known = [effect.family for effect in self.effects]
        raise BadInput(f"law: the answer does not name {name!r}: it names {', '.join(known) or 'no law'}")

    def summary(self) -> str:
        """Return the answer in three lines: what it ranks first, what that explains, and what to do next."""
        lines = [headline(self.content), outcome(self.content), f"Next: {next_step(self.content)}."]
        return "\n".join(dict.fromkeys(lines)).replace("\u00a0", " ").replace("\u202f", " ")

    @cached_property
    def where(self) -> GapLocation:
        """Return the place of the gap: channels, regions, factors, experiments."""
        return GapLocation.of(self.content["where"])

    @cached_property
    def system(self) -> System:
        """Return the system with the diagnosed effects and all identified numbers.

        It is the system as given where the augmented one is not offered (see `refused`), and with the verdict
        check_logs.

        Raises:
            BadInput: when the given system is no longer where it was.
        """
        if (self.folder / FILE).exists():
            return read_system(self.folder / FILE)
        return self.given[0] if self.given else read_system(self._place("system", None))

    def inputs(self, system: Path | None = None, logs: Path | None = None) -> tuple[System, Logs]:
        """Return the diagnosed system and its logs.

        Args:
            system: path of the system file; default: where the answer found it.
            logs: path of the logs; default: where the answer found them.

        Raises:
            BadInput: when one of them is no longer where it was, or cannot be read.
        """
        if self.given and system is None and logs is None:
            return self.given
        return read_inputs(self._place("system", system), self._place("logs", logs))

    def _place(self, name: str, given: Path | None) -> Path:
        if given is not None:
            return given
        file, place = self.folder / SUMMARY, self._sources.get(name)
        if not isinstance(place, str):
            raise BadInput(f"{file}: does not say where its {name} is: add {name}=<path>")
        if not os.path.exists(place):  # noqa: PTH110 - a damaged path is none
            raise BadInput(f"{file}: {name}: no longer at {place!r}: add {name}=<path>")
        return Path(place)

    @property
    def _sources(self) -> Mapping[str, Any]:
        kept = self.content.get("sources")
        return kept if isinstance(kept, dict) else {}

    @property
    def refused(self) -> tuple[str, ...]:
        """Return the files that are not offered, a sentence each with the reason and the file to keep."""
        entries = self.content.get("refused", ())
        return tuple(str(Refusal(entry["file"], entry["reason"], entry["keep"])) for entry in entries)

    @property
    def fit(self) -> FitSummary | None:
        """Return how the fit of the numbers ended: converged, evaluations, seconds; None if none was made."""
        fit = self.content.get("fit")
        return None if fit is None else FitSummary(fit["converged"], fit["evaluations"], fit.get("seconds"))

    @property
    def shrink(self) -> float:
        """Return the share of the squared gap above the noise floor that the effects explain, 0 to 1."""
        return float(self.content["gap"]["shrink"])

    @property
    def notes(self) -> tuple[str, ...]:
        """Return remarks on logs, models and integration, a sentence each."""
        return tuple(self.content["notes"])

    @property
    def chain(self) -> tuple[str, ...]:
        """Return how the logs were made, a sentence each: delays, lags, gains and zeros, in units of columns.

        It is empty where nothing of the measurement chain pays, or where it was not compared.
        """
        return tuple(part["sentence"] for part in self.content.get("chain", ()))

    @property
    def evidence(self) -> pd.DataFrame:
        """Return the evidence of every refitted law: law, horizon, nats, removed.

        The horizon is the length of the windows in s, nats are the log evidence over the fit without the law,
        removed is the share of the squared residual that the law removes, 0 to 1. It is empty where laws were
        not compared by evidence.
        """
        return evidence_table(self.content)

    @property
    def strangers(self) -> tuple[str, ...]:
        """Return the ids of experiments that the named effects do not predict better: look at them."""
        return tuple(self.content.get("strangers", ()))

    @property
    def gaps(self) -> pd.DataFrame:
        """Return model and gap of experiments left out, in standard deviations of the outputs.

        The models are the system as given (known), with refitted parameters (reidentified), with the effects
        found (augmented), with a network in every port (neural), the noise floor (floor), and the prediction
        that every output keeps its value or its speed (persistence).
        """
        return gap_table(self.content)

    @property
    def units(self) -> pd.DataFrame:
        """Return the errors of experiments left out in units of the outputs' columns, a row per output.

        Columns: output, unit, known and augmented (at the end of the free-run windows), known_whole_run and
        augmented_whole_run; nan where the simulation diverges.
        """
        return unit_table(self.content)

    @property
    def parameters(self) -> pd.DataFrame:
        """Return the refitted parameters: name, unit, known, identified, low, high (95 % interval), SI."""
        return parameter_table(self.content)

    def conf_int(self, alpha: float = 0.05) -> pd.DataFrame:
        """Return confidence intervals of all fitted numbers, a row each by name; SI.

        The wider one of two counts: by the curvature of the error, and by fits without one experiment each
        (jackknife, Student's t). It is cut at the bounds of the number.

        Args:
            alpha: probability that a number lies outside, between 0 and 1; default 0.05.

        Returns:
            Columns low, high and unit; first the refitted parameters, then the numbers of the effects. A
            number that every experiment has for itself has the range of its values.

        Raises:
            BadInput: when alpha is not between 0 and 1.
        """
        if isinstance(alpha, bool) or not isinstance(alpha, int | float) or not 0.0 < alpha < 1.0:
            raise BadInput(f"alpha: must be between 0 and 1, got {alpha!r}")
        return interval_table(self.content, 1.0 - alpha)

    @property
    def comparison(self) -> pd.DataFrame:
        """Return the compared hypotheses, the best predicting first, as az.compare lists models.

        Columns: rank, hypothesis (its effects in words), score (mean logarithm of the squared error of
        left-out experiments over the noise, plus one; nats), difference from the named one and its standard
        error over experiments, named, and probability (0 to 1, of the last effect beside those before it, as
        titles tell it; nan where another form of the law stands for it). The named one is the simplest that
        none beats by more than chance and by a material amount, so that others may stand above it
        (Vehtari, Gelman and Gabry 2017).
        """
        return comparison_table(self.content)

    def table(self) -> pd.DataFrame:
        """Return the numbers of the effects, a row each.

        Columns: effect (in words), law, parameter, value, low, high (95 % interval), unit (SI), confidence
        and shrink (both of the effect, 0 to 1).
        """
        return number_table(self.content)

    def plot(self, figure: str | None = None) -> Figure:
        """Draw a figure of the answer.

        Args:
            figure: name of the figure: gap (default; the gap of every model), lacking (missing effort of the
                known physics), left_over (that of the augmented model), experiments, before_and_after,
                spectrum (of the errors), correlations (of the fitted numbers, where there are two), evidence
                (of laws, where they were compared by it) or candidates. With the verdict check_logs, only
                experiments (then the default) and before_and_after exist; without a gap, there is no missing
                effort.

        Raises:
            BadInput: when the answer has no such figure.
        """
        if not (self.folder / TABLES).is_dir():
            raise BadInput(f"{self.folder / TABLES}: no such folder: diagnose again to draw its figures")
        figures = figures_of(self.folder)
        name = next(iter(figures)) if figure is None else figure
        if name not in figures:
            raise BadInput(f"figure: there is no {name!r}{closest(str(name), figures)}")
        with verbatim():
            return figures[name](self.folder)

    def save(self, folder: Path | str, pages: bool = True) -> tuple[str, ...]:
        """Write the answer, the augmented system and the tables; then figures and a page.

        The folder gets diagnosis.json, augmented_system.yaml (a system file; none where the logs are to be
        checked, or where it is not offered, see `refused`), compensation_<output>.csv (of a sensor whose
        error a table compensates), tables, figures and index.html, a page with all of it. Into a new folder
        the answer is written first; an older one is replaced in the end. A picture that cannot be drawn is a
        note.

        Args:
            folder: folder that is new, empty or holds an older diagnosis; replaced as a whole.
            pages: whether figures and the page are made; default: yes.

        Returns:
            Notes on what could not be made; none where everything was.

        Raises:
            BadInput: when the folder may not be replaced, or the answer cannot be written.
        """
        out, page = Path(folder), lambda into: write_page(into, command_of(self.content, out))
        files = {name: self._sources[name] for name in ("system", "logs") if name in self._sources}
        sources = {"answer": str(self.folder), **files}
        with writing("diagnose", out, sources), replacing_folder(out) as new:
            copy_results(self.folder, new, () if pages else (LIVE,))
            if not (new / SUMMARY).exists():
                raise BadInput(f"{self.folder / SUMMARY}: is a link: put the file there to which it points")
            if not (out / SUMMARY).exists():  # an older answer stays whole until this one is
                with replacing_folder(out) as bare:
                    shutil.copytree(new, bare, dirs_exist_ok=True)
            shown = pages and (new / TABLES).is_dir()  # figures and page are made from the tables
            parts = {"figures": write_figures, PAGE: page} if shown else {}
            drawn = {name: write for name, write in parts.items() if not (new / name).exists()}
            notes = with_parts(new, self.content, drawn)["notes"]
        links = map(printable, links_in(self.folder))
        left = (f"{name} is a link and was not copied: copy it by hand" for name in links)
        return *left, *notes[len(self.notes) :]

    def __repr__(self) -> str:
        return "\n".join(sentences(self.content))

    def _repr_html_(self) -> str:
        tables = {
            "Numbers of the effects": self.table().drop(columns=["law", "confidence", "shrink"]),
            "Errors of experiments left out, in units of the outputs": self.units,
            "Gap of experiments left out, in standard deviations of the outputs": self.gaps,
            "Refitted parameters": self.parameters,
            "Channels by which the gap enters": self.where.channels,
        }
        return shown(headline(self.content), repr(self).splitlines(), tables)


def _remove(folder: Path, owner: int) -> None:
    if os.getpid() == owner:  # a fork that ends leaves the folder to its parent
        shutil.rmtree(folder, ignore_errors=True)
