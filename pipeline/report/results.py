"""Results that the report shows."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from unmodelled.report.drawn import Figure
from unmodelled.report.tables import Table


@dataclass(frozen=True)
class Diagnosis:
    """A diagnosis with its figures.

    Attributes:
        name: path relative to the folder of all diagnoses.
        headline: verdict in one sentence.
        data: kind of the data.
        folder: folder of the diagnosis.
    """

    name: str
    headline: str
    data: str
    folder: Path

    @property
    def id(self) -> str:
        """Name of the folder of its page."""
        return "_".join(self._parts)

    @property
    def label(self) -> str:
        """Machine and system file in words."""
        return ": ".join(self._parts).replace("_", " ")

    @property
    def _parts(self) -> list[str]:
        """Machine and system file; the folder around them says of which kind the data are."""
        return self.name.removeprefix("real/").removeprefix("virtual/").split("/")

    @property
    def file(self) -> str:
        """Address relative to the folder of the site."""
        return f"diagnoses/{self.id}/index.html"

    @property
    def picture(self) -> str:
        """Address of the figure that shows how far the gap shrinks."""
        return f"diagnoses/{self.id}/figures/gap.svg"


@dataclass(frozen=True)
class Results:
    """All results of the report.

    Attributes:
        claims: claims with their verdicts.
        figures: drawn figures.
        tables: CSV tables.
        metrics: content of the metrics files by name.
        campaigns: provenance of the campaigns by name.
        runs: content of fit.json by path of the fit.
        equations: chapter and rows of every file of equations.
        diagnoses: diagnoses with figures.
        executions: records of executed stages.
        full: claims of the committed run with the full profile, by id.
    """

    claims: list[dict[str, Any]] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    metrics: dict[str, dict[str, Any]] = field(default_factory=dict)
    campaigns: dict[str, dict[str, Any]] = field(default_factory=dict)
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)
    equations: list[dict[str, Any]] = field(default_factory=list)
    diagnoses: list[Diagnosis] = field(default_factory=list)
    executions: list[Mapping[str, Any]] = field(default_factory=list)
    full: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def chapter_of(self, topic: str) -> int | None:
        """Return the chapter of a metrics file, from its content or its name."""
        match = re.fullmatch(r"chapter(\d+)", topic)
        chapter: int | None = self.metrics[topic].get("chapter", int(match[1]) if match else None)
        return chapter
