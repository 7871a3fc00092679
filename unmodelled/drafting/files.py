"""Which files of a folder are the experiments: those with equal columns, or folders with equal files."""

from __future__ import annotations

import glob
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from unmodelled.base.errors import BadInput, Faults
from unmodelled.base.limits import check_file
from unmodelled.base.search import Search
from unmodelled.drafting.names import Role, meaning_of
from unmodelled.logs.mapping import MAPPING
from unmodelled.logs.readers.known import read_files, reader_of
from unmodelled.logs.readers.reader import Table
from unmodelled.logs.record import in_groups, parts_of_name

#: Endings of files that lie beside logs and are none.
_OTHERS = "yaml yml md xml urdf pdf png jpg svg py m mp4 stl"
#: JSON files that describe a data set.
DESCRIPTIONS = ("info.json", "stats.json", "tasks.json", "provenance.json", "package.json")
#: Files that are looked into, and files or folders below a folder that are looked at.
MOST, SEEN = 40, 2000


#: Names of a column whose file says what it is.
_NAMELESS = frozenset(["value", "val", "state", "reading", "wert"])


@dataclass(frozen=True)
class Survey:
    """The experiments that were found."""

    folder: Path  # to which the patterns are relative
    patterns: tuple[str, ...]  # of the paths of the experiments
    read: dict[Path, list[Table]]  # tables by path
    left_out: dict[Path, str]  # reasons, by path of what is no such experiment
    groups: tuple[str, ...] = ()  # patterns inside a file; (): files are the experiments
    unread: tuple[Path, ...] = ()  # not looked into, because there are many

    def only(self, read: dict[Path, list[Table]], left_out: dict[Path, str]) -> Survey:
        """Return the survey of some of the experiments."""
        if self.groups:
            groups = tuple(str(place).rsplit(":/", 1)[1] for place in read)
            return replace(self, read=read, left_out=left_out, groups=groups)
        patterns = patterns_of(self.folder, [*read, *self.unread])
        return replace(self, read=read, left_out=left_out, patterns=patterns)


def survey(logs: Path) -> Survey:
    """Find the experiments in a folder, or take one file as one."""
    if not logs.exists():
        raise BadInput(f"{logs}: no such file or folder: check the path")
    if logs.is_file():
        faults = Faults()
        read = read_files([logs], None, faults)
        faults.check()
        return _of_groups(Survey(logs.parent, (logs.name,), read, {}))
    places = _places(logs)
    if not places:
        raise BadInput(f"{logs}: holds no files: give the folder with the logs")
    read, left_out = dict[Path, list[Table]](), dict[Path, str]()
    for place in places[:MOST]:
        faults = Faults()
        read |= read_files([place], None, faults)
        try:
            faults.check()
        except BadInput as error:
            left_out[place] = str(error).removeprefix(f"{place}: ")
    if not read:
        raise BadInput(f"{logs}: no file in it can be read; the first one: {next(iter(left_out.values()))}")
    folders = {place.parent for place in read}
    if len(read) > 1 and (_differ(read) or _of_sensors(read)) and len(folders) == 1:
        return Survey(logs, patterns_of(logs, [*folders]), read_files([*folders], None, Faults()), left_out)
    kept = _largest(read)
    left_out |= {place: "other columns" for place in read if place not in kept}
    # what was not looked into is of the experiments, if it has the ending of one
    rest = [place for place in places[MOST:] if place.suffix in {kept_place.suffix for kept_place in kept}]
    patterns, tables = patterns_of(logs, [*kept, *rest]), {place: read[place] for place in kept}
    found = Survey(logs, patterns, tables, left_out, unread=tuple(rest))
    return _of_groups(found) if len(kept) == 1 and not rest else found


def _of_groups(found: Survey) -> Survey:
    """The survey of a single file: of its groups, if these are the experiments."""
    ((path, tables),) = found.read.items()
    pattern = _groups(tables)
    if pattern is None:
        return found
    runs = {Path(f"{path}:/{group}"): inside for group, inside in in_groups(tables, [pattern]).items()}
    return replace(found, read=runs, groups=(pattern,))


def _groups(tables: Sequence[Table]) -> str | None:
    """A pattern of groups with equal columns, one for each experiment; None if a file has no such groups."""
    if any(table.clock is not None for table in tables):
        return None  # tables of a recorder with a clock for all of them are one recording
    names = [parts_of_name(table.name) for table in tables]
    heads = {tuple(name[:k]) for name in names for k in range(len(name))}
    for head in sorted(heads, key=lambda each: (len(each), each)):
        pattern = "/".join((*map(glob.escape, head), "*"))
        kinds = [_columns(inside) for inside in in_groups(tables, [pattern]).values()]
        if len(kinds) > 1 and len(set(kinds)) == 1:
            return pattern
    return None


def _places(folder: Path) -> list[Path]:
    """The files below a folder that may be experiments, and the folders that stand for one."""
    if _is_bag(folder):
        return [folder]
    search = Search(lambda why: BadInput(f"{folder}: {why}: give the folder of the logs"))
    entries = [path for path in sorted(search.below(folder))[:SEEN] if not _is_hidden(path, folder)]
    for path in entries:
        if not path.is_file() and not path.is_dir():
            check_file(path)  # says what a pipe or a device is
    bags = [path for path in entries if path.is_dir() and _is_bag(path)]
    files = [
        path
        for path in entries
        if path.is_file()
        and path.suffix.lower().removeprefix(".") not in _OTHERS.split()
        and path.name not in (*DESCRIPTIONS, "experiments.csv", MAPPING)
        and not any(bag in path.parents for bag in bags)
    ]
    inside: dict[Path, list[str]] = {}
    for path in files:
        inside.setdefault(path.parent, []).append(path.name)
    alike = [
        place
        for place, names in inside.items()
        if place != folder and len(names) > 1 and list(inside.values()).count(names) > 1
    ]
    return sorted([*bags, *alike, *(path for path in files if path.parent not in alike)])


def _is_hidden(path: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in path.relative_to(folder).parts)


def _is_bag(folder: Path) -> bool:
    return reader_of(folder) is not None


def _of_sensors(read: Mapping[Path, Sequence[Table]]) -> bool:
    """Whether every file has the values of one sensor, which its name tells: a word, not a number."""
    alone = all(len(tables) == 1 and _is_lone(tables[0]) for tables in read.values())
    return alone and len({re.sub(r"\d+", "", path.stem) for path in read}) == len(read)


def _is_lone(table: Table) -> bool:
    """Whether a table has a column of dates or times and one other, which has no name of its own."""
    names = [name for name in table.columns if name not in table.origins]
    others = [name for name in names if meaning_of(name).role is not Role.TIME]
    return len(others) == 1 < len(table.columns) and others[0].lower() in _NAMELESS


def _differ(read: dict[Path, list[Table]]) -> bool:
    """Whether no two files have the same columns: they are tables of one recording."""
    kinds = [_columns(tables) for tables in read.values()]
    return len(set(kinds)) == len(kinds)


def _columns(tables: Sequence[Table]) -> frozenset[str]:
    return frozenset(table.address(name) for table in tables for name in table.columns)


def _largest(read: dict[Path, list[Table]]) -> list[Path]:
    """Of the files with equal columns, those with most rows."""
    rows: dict[frozenset[str], int] = {}
    for tables in read.values():
        kind = _columns(tables)
        rows[kind] = rows.get(kind, 0) + sum(map(len, tables))
    best = max(rows, key=lambda kind: rows[kind])
    return [place for place, tables in read.items() if _columns(tables) == best]


def patterns_of(folder: Path, places: list[Path]) -> tuple[str, ...]:
    """Return patterns that match some files or folders and no others; their names if there are none."""
    if places == [folder]:
        return (".",)
    parents = sorted({place.parent.relative_to(folder).as_posix() for place in places})
    endings = sorted({"/" if place.is_dir() else place.suffix for place in places})
    tried = [f"*{endings[0]}", f"*/*{endings[0]}", *(f"{parent}/*{endings[0]}" for parent in parents)]
    for pattern in tried if len(endings) == 1 and endings[0] else ():
        if set(folder.glob(pattern)) == set(places):
            return (pattern,)
    return tuple(glob.escape(place.relative_to(folder).as_posix()) for place in places)
