"""A diagnosis as its folder holds it, without the fitted models."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, replacing_folder
from unmodelled.diagnosis.answer.augmented import FILE
from unmodelled.diagnosis.answer.findings import SUMMARY, TABLES, Part
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.answer.summary import SCHEMA
from unmodelled.logs.inputs import read_inputs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system


@dataclass(frozen=True, eq=False)
class SavedFindings:
    """A diagnosis that was read from its folder.

    Attributes:
        folder: folder of the answer.
        content: content of diagnosis.json.
    """

    folder: Path
    content: Mapping[str, Any]

    @classmethod
    def read(cls, folder: Path) -> SavedFindings:
        """Read the folder of an answer.

        Args:
            folder: folder with diagnosis.json.

        Raises:
            BadInput: when it holds no answer of this version.
        """
        content = read_json(file := folder / SUMMARY)
        if not isinstance(content, dict) or content.get("schema") != SCHEMA:
            raise BadInput(f"{file}: is no answer of this version (schema {SCHEMA}): diagnose again")
        return cls(folder, content)

    @cached_property
    def system(self) -> System:
        """Return the augmented system, or the given one where the augmented one is not offered; an answer
        that asks to check the logs has none.

        Raises:
            BadInput: when the folder has no augmented system, or the given one is no longer where it was.
        """
        if any(entry["file"] == FILE for entry in self.content.get("refused", ())):
            return read_system(self._place("system", None))
        return read_system(self.folder / FILE)

    @property
    def sources(self) -> dict[str, str]:
        """Return the folder, which must not be written over, as the only source."""
        return {"answer": str(self.folder)}

    def inputs(self, system: Path | None = None, logs: Path | None = None) -> tuple[System, Logs]:
        """Read the diagnosed system and its logs.

        Args:
            system: path of the system file; default: where the answer found it.
            logs: path of the logs; default: where the answer found them.

        Raises:
            BadInput: when one of them is no longer where it was, or cannot be read.
        """
        return read_inputs(self._place("system", system), self._place("logs", logs))

    def _place(self, name: str, given: Path | None) -> Path:
        if given is not None:
            return given
        file, kept = self.folder / SUMMARY, self.content.get("sources")
        place = kept.get(name) if isinstance(kept, dict) else None
        if not isinstance(place, str):
            raise BadInput(f"{file}: does not say where its {name} is: add {name}=<path>")
        if not os.path.exists(place):  # noqa: PTH110 - a damaged path is none
            raise BadInput(f"{file}: {name}: no longer at {place!r}: add {name}=<path>")
        return Path(place)

    def write_tables(self, folder: Path) -> None:
        """Copy the tables of the figures into a folder.

        Args:
            folder: folder that gets the folder of tables.

        Raises:
            BadInput: when the answer was written without tables.
        """
        if not (self.folder / TABLES).is_dir():
            raise BadInput(f"{self.folder / TABLES}: no such folder: diagnose again to draw its figures")
        shutil.copytree(self.folder / TABLES, folder / TABLES)

    def save(self, out: Path, drawn: Mapping[str, Part] | None = None) -> SavedFindings:
        """Copy the answer.

        Args:
            out: folder that is new, empty or holds an older diagnosis; replaced as a whole.
            drawn: further parts, which the folder holds already if the answer was saved with them.

        Returns:
            The copy.

        Raises:
            BadInput: when `out` may not be replaced, or a file cannot be written.
        """
        with replacing_folder(out) as new:
            shutil.copytree(self.folder, new, ignore=shutil.ignore_patterns(".*"), dirs_exist_ok=True)
        return SavedFindings(out, self.content)

    def __str__(self) -> str:
        return "\n".join(sentences(self.content))
