"""What a diagnosis has found, as the files of an answer: diagnosis.json, the augmented system and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.diagnosis.answer.augmented import write_augmented, write_changes
from unmodelled.diagnosis.answer.compensation import write_compensations
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.answer.live import LIVE, write_live
from unmodelled.diagnosis.answer.robot_file import RobotFile
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS, Options
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.gates.refusal import Refusal
from unmodelled.diagnosis.where.where import Where
from unmodelled.effects.own_law import Law

SUMMARY, TABLES = "diagnosis.json", "tables"
#: What augmented_system.yaml changes, in the folder of the tables.
CHANGES = "augmented_system.diff"

#: Writes a part of the answer into its folder, and returns the exceptions of files that could not be made, by
#: name of the file.
Part = Callable[[Path], Mapping[str, Exception] | None]


@dataclass(frozen=True, eq=False)
class Findings:
    """A diagnosis with the place of the gap, ready to be written."""

    diagnosis: Diagnosis
    where: Where
    exported: bool  # whether the augmented system is offered as a system file
    robot: RobotFile | None = None  # None for a system without robot, or if it is not offered
    refused: tuple[Refusal, ...] = ()  # files that are not offered, with the reasons
    laws: tuple[Law, ...] = ()  # of the user that were tried, too
    options: Options = DEFAULT_OPTIONS
    without: tuple[str, ...] = ()  # families of the library that were not tried
    seconds: float | None = None  # that the diagnosis took, where they are told

    @property
    def content(self) -> dict[str, Any]:
        """Return the content of diagnosis.json."""
        own: dict[str, Any] = {"laws": [law.definition for law in self.laws]} if self.laws else {}
        own |= {"without": list(self.without)} if self.without else {}
        own |= {"options": self.options.changed} if self.options.changed else {}
        found = summary(self.diagnosis, self.where, self.robot, self.refused) | own
        took = "fit" in found and self.seconds is not None
        return found | ({"fit": found["fit"] | {"seconds": self.seconds}} if took else {})

    def with_notes(self, *notes: str) -> Findings:
        """Return the same findings with further notes."""
        return replace(self, diagnosis=replace(self.diagnosis, notes=(*self.diagnosis.notes, *notes)))

    def write(self, folder: Path, *, sources: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Write diagnosis.json, augmented_system.yaml, robot file and compensations, then the tables."""
        if self.exported:
            made = str((sources or {}).get("made", "")).partition("T")[0]
            write_augmented(self.diagnosis, folder, made)
        if self.robot is not None:
            self.robot.write(folder)
        write_compensations(self.diagnosis, folder)
        content = self.content | ({"sources": dict(sources)} if sources else {})
        write_json(folder / SUMMARY, content)
        live: Part = lambda into: write_live(self.diagnosis, into)  # noqa: E731
        shown = self.diagnosis.verdict != "check_logs"
        return with_parts(folder, content, {TABLES: self._write_tables, **({LIVE: live} if shown else {})})

    def _write_tables(self, folder: Path) -> None:
        write_tables(self.diagnosis, self.where, folder)
        if self.exported:
            write_changes(self.diagnosis, folder, folder / TABLES / CHANGES)


def with_parts(folder: Path, content: Mapping[str, Any], parts: Mapping[str, Part]) -> dict[str, Any]:
    """Write further parts of an answer, each from those before it; one that cannot be made becomes a note."""
    content = dict(content)
    for name, write in parts.items():
        try:
            faults = write(folder) or {}
        except Exception as fault:
            faults = {name: fault}
        if faults:
            notes = [note_on(f"{part} could not be made", fault) for part, fault in faults.items()]
            content["notes"] = [*content["notes"], *notes]
            with suppress(BadInput):  # a full disk: the answer stays as it was, the caller has the notes
                write_json(folder / SUMMARY, content)
        # the other parts are made from this one; the page shows without the machine what it can
        if name in faults and name != LIVE:
            break
    return content


def note_on(what: str, fault: Exception) -> str:
    """Return a note on what could not be made."""
    return f"{what} ({reason_of(fault)}); {SUMMARY} has all numbers. Please report this line"


def reason_of(fault: Exception) -> str:
    """Return an exception in one line without control characters."""
    reason = str(fault) if isinstance(fault, BadInput) else f"{type(fault).__name__}: {fault}"
    return str(BadInput(reason))  # without control characters
