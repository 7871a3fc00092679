"""An answer and its files: diagnosis.json, the augmented system and tables for figures."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.diagnosis.answer.augmented import (
    augmented_system,
    write_augmented,
)
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.answer.live import LIVE, write_live
from unmodelled.diagnosis.answer.robot_file import RobotFile
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.gates.refusal import Refusal
from unmodelled.diagnosis.where.where import Where
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

SUMMARY, TABLES = "diagnosis.json", "tables"

#: Writes a part of the answer into a folder, and returns the exceptions of files that could not be made, by
#: name of the file.
Part = Callable[[Path], Mapping[str, Exception] | None]


@dataclass(frozen=True, eq=False)
class Findings:
    """A diagnosis with the place of the gap, ready to be written.

    Attributes:
        diagnosis: verdict, effects and judged models.
        where: place of the gap: channels, regions, factors and experiments.
        exported: whether the augmented system is offered as a system file.
        robot: patched robot file; None (default) for a system without robot, or if it is not offered.
        located: absolute paths of `system` and `logs`, which diagnosis.json keeps for `next`; default none.
        refused: files that are not offered, with the reasons; default none.
    """

    diagnosis: Diagnosis
    where: Where
    exported: bool
    robot: RobotFile | None = None
    located: Mapping[str, str] = field(default_factory=dict)
    refused: tuple[Refusal, ...] = ()

    @cached_property
    def content(self) -> dict[str, Any]:
        """Return the content of diagnosis.json."""
        found = summary(self.diagnosis, self.where, self.robot, self.refused)
        return found | ({"sources": dict(self.located)} if self.located else {})

    @cached_property
    def system(self) -> System:
        """Return the system with the diagnosed effects and identified numbers.

        Where it is not offered, and with the verdict check_logs, it is the system as given.
        """
        return augmented_system(self.diagnosis) if self.exported else self.diagnosis.system

    def __str__(self) -> str:
        return "\n".join(sentences(self.content))

    @property
    def sources(self) -> dict[str, str]:
        """Return the paths of system and logs, empty where they are no files."""
        return {"system": self.diagnosis.system.source, "logs": self.diagnosis.logs.source}

    def with_paths(self) -> Findings:
        """Return the same findings, whose diagnosis.json says where the files of system and logs are."""
        paths = {name: str(Path(source).absolute()) for name, source in self.sources.items() if source}
        return replace(self, located=paths)

    def inputs(self) -> tuple[System, Logs]:
        """Return the diagnosed system and its logs."""
        return self.diagnosis.system, self.diagnosis.logs

    def write_tables(self, folder: Path) -> None:
        """Write the tables of the figures into a folder, see `figure_tables.write_tables`.

        Args:
            folder: folder that gets the folder of tables.
        """
        write_tables(self.diagnosis, self.where, folder)

    def with_notes(self, *notes: str) -> Findings:
        """Return the same findings with further notes.

        Args:
            *notes: notes, a sentence each.
        """
        return replace(self, diagnosis=replace(self.diagnosis, notes=(*self.diagnosis.notes, *notes)))

    def save(self, out: Path, drawn: Mapping[str, Part] | None = None) -> Findings:
        """Write diagnosis.json, augmented_system.yaml and the robot file, then tables and further parts.

        The data of the machine in the page, tables/live.json, are written only where there are further parts.
        diagnosis.json is complete before the first table is written; where `out` has no older answer, it is
        there from then on, even if the process is killed while it draws. An older answer is replaced as a
        whole in the end. A part that cannot be made becomes a note, and the parts after it are left out.

        Args:
            out: folder that is new, empty or holds an older diagnosis; replaced as a whole.
            drawn: further parts by name, such as figures, made in this order from the files in `out`.

        Returns:
            The findings with a note for every part that could not be made.

        Raises:
            BadInput: when `out` may not be replaced, or the answer cannot be written.
        """
        with replacing_folder(out) as folder:
            if self.exported:
                write_augmented(self.diagnosis, folder)
            if self.robot is not None:
                self.robot.write(folder)
            write_json(folder / SUMMARY, self.content)
            if not (out / SUMMARY).exists():  # an older answer stays whole until this one is
                with replacing_folder(out) as bare:
                    shutil.copytree(folder, bare, dirs_exist_ok=True)
            return self._with_parts(folder, drawn or {})

    def _with_parts(self, folder: Path, drawn: Mapping[str, Part]) -> Findings:
        found = self
        machine: Part = lambda into: write_live(self.diagnosis, into)  # noqa: E731
        shown = drawn and self.diagnosis.verdict != "check_logs"
        for name, write in {TABLES: self.write_tables, **({LIVE: machine} if shown else {}), **drawn}.items():
            try:
                faults = write(folder) or {}
            except Exception as fault:
                faults = {name: fault}
            if faults:
                notes = (note_on(f"{part} could not be made", fault) for part, fault in faults.items())
                found = found.with_notes(*notes)
                with suppress(BadInput):  # a full disk: the answer stays as it was, the caller has the notes
                    write_json(folder / SUMMARY, found.content)
            # the other parts are made from this one; the page shows without the machine what it can
            if name in faults and name != LIVE:
                break
        return found


def note_on(what: str, fault: Exception) -> str:
    """Return a note on what could not be made.

    Args:
        what: subject and verb.
        fault: exception that was raised.
    """
    return f"{what} ({reason_of(fault)}); {SUMMARY} has all numbers. Please report this line"


def reason_of(fault: Exception) -> str:
    """Return an exception in one line without control characters.

    Args:
        fault: exception that was raised.
    """
    reason = str(fault) if isinstance(fault, BadInput) else f"{type(fault).__name__}: {fault}"
    return str(BadInput(reason))  # without control characters
