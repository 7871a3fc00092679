"""One version: package, citation and changelog agree."""

import re
import tomllib
from datetime import date
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
RELEASES = re.findall(r"^## \[([\d.]+)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text(), re.M)


def test_the_citation_has_the_fields_of_its_format() -> None:
    assert CITATION["cff-version"] == "1.2.0" and CITATION["type"] == "software"
    assert CITATION["message"] and CITATION["title"].startswith("unmodelled")
    assert all("name" in author or "family-names" in author for author in CITATION["authors"])
    assert all({"type", "title", "authors"} <= set(source) for source in CITATION["references"])
    assert CITATION["license"] == PROJECT["license"]


def test_package_citation_and_changelog_name_one_version() -> None:
    version, day = RELEASES[0]
    assert version == PROJECT["version"] == CITATION["version"]
    assert day == CITATION["date-released"] == date.fromisoformat(day).isoformat()


def test_releases_are_in_order() -> None:
    numbers = [tuple(map(int, version.split("."))) for version, _ in RELEASES]
    assert numbers == sorted(numbers, reverse=True) and len(numbers) == len(set(numbers))
    assert sorted(RELEASES, key=lambda release: release[1], reverse=True) == RELEASES
