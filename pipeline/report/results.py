"""Results that the report shows."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from unmodelled.report.drawn import Figure
from unmodelled.report.tables import Table


@dataclass(frozen=True)
class Diagnosis:
    """A diagnosis with its figures."""

    name: str  # path relative to the folder of all diagnoses
    headline: str  # verdict in one sentence
    data: str  # kind of the data
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
    """All results of the report."""

    claims: list[dict[str, Any]] = field(default_factory=list)  # with their verdicts
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    metrics: dict[str, dict[str, Any]] = field(default_factory=dict)  # content of the files by name
    campaigns: dict[str, dict[str, Any]] = field(default_factory=dict)  # provenance by name
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)  # content of fit.json by path of the fit
    #: Chapter and rows of every file of equations
    equations: list[dict[str, Any]] = field(default_factory=list)
    diagnoses: list[Diagnosis] = field(default_factory=list)
    executions: list[Mapping[str, Any]] = field(default_factory=list)  # records of executed stages
    #: Claims of the committed run with the full profile, by id
    full: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def chapter_of(self, topic: str) -> int | None:
        """Return the chapter of a metrics file, from its content or its name."""
        match = re.fullmatch(r"chapter(\d+)", topic)
        chapter: int | None = self.metrics[topic].get("chapter", int(match[1]) if match else None)
        return chapter
