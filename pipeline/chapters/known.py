"""What is known of measured machines from elsewhere: known.yaml beside the system files of every machine."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from unmodelled.base.errors import BadInput
from unmodelled.base.shapes import check_shape

FILE = "known.yaml"
#: Of system files and folders of answers; the part before it is the physics that the system file leaves out.
SUFFIX = "_withheld"
#: Owner of a parameter that belongs to the system file and not to an effect.
KNOWN_PHYSICS = "known physics"

_NUMBER = {"of": str, "parameter": str, "value": (float, [float]), "unit": str, "source": str}
_CASE = {
    "known": str,
    "verdicts": [frozenset({"effect", "main_effect", "no_gap", "unknown", "check_logs"})],
    "effects": [[str]],
    "beside": [str],
    "numbers": [_NUMBER],
}
_MACHINE = {
    **dict.fromkeys(("title", "variable", "published", "licence", "about"), str),
    "cases": {"*": _CASE},
}


@dataclass(frozen=True)
class Reference:
    """A reference value, or a range of values, of one parameter."""

    of: str  # name of an effect, or `KNOWN_PHYSICS`
    parameter: str  # name in the law or the system file
    low: float
    high: float
    unit: str  # SI
    source: str

    @classmethod
    def read(cls, row: Mapping[str, Any]) -> "Reference":
        """Read a row of `numbers`; a value that is a list is a range."""
        values = row["value"] if isinstance(row["value"], list) else [row["value"]]
        return cls(row["of"], row["parameter"], min(values), max(values), row["unit"], row["source"])


@dataclass(frozen=True)
class KnownCase:
    """The right answer for one system file."""

    known: str  # in words
    verdicts: frozenset[str]  # that are right
    #: Right names of every withheld effect, such as "coulomb_friction at rail"
    effects: tuple[frozenset[str], ...]
    beside: frozenset[str]  # names of effects that may be said besides
    numbers: tuple[Reference, ...]

    @classmethod
    def read(cls, case: Mapping[str, Any]) -> "KnownCase":
        """Read an entry of `cases`."""
        return cls(
            str(case["known"]),
            frozenset(case["verdicts"]),
            tuple(frozenset(names) for names in case["effects"]),
            frozenset(case["beside"]),
            tuple(Reference.read(row) for row in case["numbers"]),
        )

    @property
    def right(self) -> frozenset[str]:
        """Names of all effects that may be said."""
        return self.beside.union(*self.effects)


@dataclass(frozen=True)
class Machine:
    """A published machine and the right answers for its system files."""

    name: str  # of the folder of its system files
    title: str
    variable: str  # variable of make, or of the environment, that gives the path of the data
    published: str  # address of the data
    licence: str  # of the data
    about: str  # data and known physics
    cases: Mapping[str, KnownCase]  # right answers by withheld physics


def read_machine(folder: Path) -> Machine:
    """Read `folder`/known.yaml."""
    path = folder / FILE
    try:
        content = yaml.safe_load(path.read_bytes())
    except (OSError, yaml.YAMLError, UnicodeError, RecursionError) as error:
        raise BadInput(f"{path}: cannot be read ({str(error).splitlines()[0]})") from None
    check_shape(path, content, _MACHINE)
    for name, case in content["cases"].items():
        for k, row in enumerate(case["numbers"]):
            if isinstance(row["value"], list) and len(row["value"]) != 2:
                raise BadInput(f"{path}: cases.{name}.numbers[{k}].value: must be a number or two numbers")
    cases = {str(name): KnownCase.read(case) for name, case in content["cases"].items()}
    texts = {key: content[key] for key in ("title", "variable", "published", "licence", "about")}
    return Machine(folder.name, cases=cases, **texts)


def read_machines(systems: Path) -> list[Machine]:
    """Read all machines in `systems`/<machine>/known.yaml, by name."""
    found = [read_machine(path.parent) for path in sorted(systems.glob(f"[!.]*/{FILE}"))]
    if not found:
        raise BadInput(f"{systems}: holds no machine, a folder with {FILE}")
    return found


def system_files(folder: Path) -> list[Path]:
    """Return the system files in the folder of a machine, by name."""
    return sorted(path for path in folder.glob("*.yaml") if path.name != FILE)
