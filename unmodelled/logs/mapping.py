"""The mapping file (mapping/1): which columns of a recorder's files are the signals of a system."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.base.search import Search
from unmodelled.logs.cells import LARGEST
from unmodelled.logs.time_units import seconds_of
from unmodelled.systems.document import Node, flag, load_yaml
from unmodelled.systems.grammar import parse
from unmodelled.systems.scope import Scope
from unmodelled.systems.syntax import shown
from unmodelled.systems.units import SECOND, parse_logged

SCHEMA = "mapping/1"
#: Name of a mapping that stands in a log folder in place of experiments.csv.
MAPPING = "mapping.yaml"
_ENDINGS = (".yaml", ".yml")
_WITH_UNIT = re.compile(r"\s*(?P<number>[-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?P<unit>[A-Za-zµμ]+)\s*", re.ASCII)
_HERTZ = tuple(-exponent for exponent in SECOND)


@dataclass(frozen=True)
class Column:
    """A column that a mapping names."""

    name: str
    node: Node  # place in the mapping, for messages
    hold: bool = False  # it is written when it changes: a value holds until the next row
    given: bool = False  # whether the mapping says if it holds


@dataclass(frozen=True)
class ByFile:
    """A constant that follows from the path of a file."""

    values: Mapping[str, str]  # by pattern of paths relative to the mapping; the first that matches counts
    node: Node  # place in the mapping, for messages

    def of(self, path: Path) -> str:
        """Return the value of an experiment."""
        name = Path(os.path.relpath(path, self.node.file.parent)).as_posix()
        for pattern, value in self.values.items():
            if fnmatchcase(name, pattern):
                return value
        raise self.node.wrong(f"no pattern matches {shown(name)}: add one, or '*' as the last one")


@dataclass(frozen=True)
class Signal:
    """A signal: (factor * column + offset) in `unit`."""

    column: Column
    unit: str | None = None  # as written; None: that of the file, otherwise that of the system file
    factor: float = 1.0  # scale with sign
    offset: float = 0.0  # in unit


@dataclass(frozen=True)
class Time:
    """The clock of all tables."""

    column: Column | None = None
    seconds: float | None = None  # in a unit of the column; None: as the file says, otherwise 1
    period: float | None = None  # of files without a clock, s


@dataclass(frozen=True)
class LogMapping:
    """Content of a mapping file."""

    path: Path
    files: tuple[str, ...]  # patterns relative to the folder of the mapping
    groups: tuple[str, ...]  # patterns of experiments inside a file; (): a file is one
    signals: Mapping[str, Signal]  # by column of the system file
    time: Time | None  # None: that of the format
    split_by: Column | None  # its runs of equal values are the experiments
    cut: float | None  # length of the parts of every experiment, s
    constants: Mapping[str, Column | ByFile | str]  # of the operating point, and other descriptions
    cure: bool  # whether faults of single channels are cured, not told only
    node: Node  # top of the file, for messages

    def paths(self) -> dict[str, Path]:
        """Return the files and folders that the patterns match, by the id of their experiment, in order."""
        found = (path for k, pattern in enumerate(self.files) for path in self._matches(k, pattern))
        return _named(list(dict.fromkeys(found)))

    def _matches(self, k: int, pattern: str) -> list[Path]:
        """Paths that one of the patterns matches, in order."""
        node, place = self.node.entries()["files"], f"files[{k}]: {shown(pattern)}"
        search = Search(lambda why: node.wrong(f"{place} {why}: name the folders"))
        named = map(os.path.normpath, search.matches(self.path.parent, pattern))
        paths = sorted(path for path in map(Path, named) if path.name != MAPPING)
        if not paths:
            raise node.wrong(f"{place} matches no file beside the mapping: correct the pattern")
        return paths


def _named(paths: list[Path]) -> dict[str, Path]:
    """Files by their names without endings; by their paths where two names are equal."""
    names = [path.stem if path.is_file() else path.resolve().name for path in paths]
    long = ["-".join(path.with_suffix("").parts[-3:]) for path in paths]
    return {
        name if names.count(name) == 1 else other: path
        for name, other, path in zip(names, long, paths, strict=True)
    }


def mapping_of(place: Path) -> Path | None:
    """Return the path of the mapping that a user names as logs; None if it is another kind of logs."""
    if place.suffix.lower() in _ENDINGS and not place.is_dir():
        return place
    if not (place / MAPPING).exists():
        return None
    if (place / "experiments.csv").exists():
        raise BadInput(
            f"{place}: has experiments.csv and {MAPPING}: remove one of them, or give logs={place / MAPPING}"
        )
    return place / MAPPING


def read_mapping(path: Path) -> LogMapping:
    """Read a mapping file."""
    root = load_yaml(path, "mapping")
    schema = root.entries().get("schema")
    if schema is None or schema.content != SCHEMA:
        raise (schema or root).wrong(f"must start with 'schema: {SCHEMA}'")
    keys = root.fields(
        ("schema", "files", "signals"), ("groups", "time", "split_by", "cut", "constants", "cure")
    )
    signals = {name: _signal(node) for name, node in keys["signals"].entries().items()}
    if not signals:
        raise keys["signals"].wrong("is empty: name a column for every input and output of the system file")
    return LogMapping(
        path=path,
        files=_patterns(keys["files"], '["*.csv"]'),
        groups=_patterns(keys["groups"], '["run*"]') if "groups" in keys else (),
        signals=signals,
        time=_time(keys["time"]) if "time" in keys else None,
        split_by=Column(keys["split_by"].text(), keys["split_by"]) if "split_by" in keys else None,
        cut=_quantity(keys["cut"], "2 s", "time") if "cut" in keys else None,
        constants={
            name: _constant(node)
            for name, node in (keys["constants"].entries() if "constants" in keys else {}).items()
        },
        cure=flag(keys, "cure", True),
        node=root,
    )


def _patterns(node: Node, example: str) -> tuple[str, ...]:
    items = node.content if isinstance(node.content, list) else [node]
    found = tuple(item.text() for item in items)
    if not found:
        raise node.wrong(f"is empty: write patterns such as {example}")
    return found


def _signal(node: Node) -> Signal:
    if isinstance(node.content, str):
        return Signal(Column(node.content, node))
    keys = node.fields(("column",), ("unit", "sign", "scale", "offset", "hold"))
    unit = keys["unit"].text() if "unit" in keys else None
    if unit is not None:
        try:
            parse_logged(unit)
        except ValueError as error:
            raise keys["unit"].wrong(str(error)) from None
    sign = _number(keys["sign"]) if "sign" in keys else 1.0
    if abs(sign) != 1.0:
        raise keys["sign"].wrong(f"must be 1 or -1, got {sign:g}: write another factor as scale")
    scale = _number(keys["scale"]) if "scale" in keys else 1.0
    if scale == 0.0:
        raise keys["scale"].wrong("must not be 0: the signal would be lost")
    offset = _number(keys["offset"]) if "offset" in keys else 0.0
    return Signal(_column(keys), unit, sign * scale, offset)


def _column(keys: Mapping[str, Node]) -> Column:
    """A column by its entries `column` and `hold`."""
    return Column(keys["column"].text(), keys["column"], flag(keys, "hold"), "hold" in keys)


def _number(node: Node) -> float:
    """A number, or an expression of numbers such as 360/2000, below any measurement."""
    try:
        value = node.number() if node.is_number else float(parse(node.text(), Scope({}), node.where))
    except (BadInput, TypeError):  # a name is left in it
        got = shown(node.content) if isinstance(node.content, str) else "none"
        raise node.wrong(
            f"must be a number, or an expression of numbers such as 360/2000, got {got}"
        ) from None
    if not abs(value) < LARGEST:
        raise node.wrong(f"must be below {LARGEST:g}, got {value:g}")
    return value


def _time(node: Node) -> Time:
    if isinstance(node.content, str):
        return Time(Column(node.content, node))
    keys = node.fields((), ("column", "unit", "rate"))
    if ("column" in keys) == ("rate" in keys):
        raise node.wrong("must have either 'column' or 'rate'")
    if "rate" in keys:
        if "unit" in keys:
            raise keys["unit"].wrong("belongs to 'column': write the unit of the rate beside its number")
        return Time(period=1.0 / _quantity(keys["rate"], "100 Hz", "frequency"))
    seconds = seconds_of(keys["unit"].text()) if "unit" in keys else None
    if "unit" in keys and seconds is None:
        raise keys["unit"].wrong("must be a unit of time, such as s, ms, us or ns")
    return Time(Column(keys["column"].text(), keys["column"]), seconds)


def _quantity(node: Node, example: str, kind: str) -> float:
    """A positive number with a unit of time or frequency, in SI units."""
    found, wanted = _WITH_UNIT.fullmatch(node.text()), SECOND if kind == "time" else _HERTZ
    try:
        si, logged = parse_logged(found["unit"]) if found else (None, None)
        number = float(found["number"]) if found else 0.0
    except ValueError:
        si, logged, number = None, None, 0.0
    value = number * (logged.factor if logged else 1.0)
    if si is None or si.dimension != wanted or not value > 0.0:
        raise node.wrong(f"must be a positive number with a unit of {kind}, such as {example}")
    return value


def _constant(node: Node) -> Column | ByFile | str:
    if not isinstance(node.content, dict):
        return node.text()
    keys = node.fields((), ("column", "files", "hold"))
    if ("column" in keys) == ("files" in keys):
        raise node.wrong("must have either 'column' or 'files'")
    if "column" in keys:
        return _column(keys)
    if "hold" in keys:
        raise keys["hold"].wrong("belongs to 'column': remove it")
    values = {pattern: value.text() for pattern, value in keys["files"].entries().items()}
    if not values:
        raise keys["files"].wrong("is empty: write a value for every pattern, such as {'*load*': 1, '*': 0}")
    return ByFile(values, keys["files"])
