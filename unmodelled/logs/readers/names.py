"""Elements of lists by the names that stand beside them, in every row anew: `position[knee]`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.logs.readers.reader import Table, among_rows
from unmodelled.logs.recognition import NUMBER

#: Names of the elements of lists in one row, by place of the list.
Labels = tuple[tuple[str, tuple[str, ...]], ...]

#: Keys of lists of texts that name things. Other texts, such as modes, say nothing about the order of things.
NAMING = re.compile(
    r".*(names?|(^|_)(ids|labels))|joints?|motors?|servos?|axis|axes|actuators?|channels?|dofs?|ids?|labels?",
    re.IGNORECASE | re.DOTALL,
)
#: A column that is an element of a list: `position[0]`, `position_0`, or `field.position0` of rostopic.
ELEMENT = re.compile(
    r"(?P<place>.*?)(\[(?P<inside>\d{1,3})\]|[_.]?(?P<behind>\d{1,3}))", re.ASCII | re.DOTALL
)
#: What stands between the names of a topic and of a publisher, and most publishers that are told apart.
PUBLISHER, PUBLISHERS = "@", 16
#: Most names that the elements of the lists of a table have: what has more is a text that changes.
MOST = 256


def labels_of(texts: Mapping[str, Sequence[str]], lengths: Mapping[str, int]) -> Labels:
    """Return the names of the elements of lists in a row, by the texts that stand beside lists as long."""
    known: dict[tuple[str, int], tuple[str, ...]] = {}
    for place in sorted(texts, key=lambda each: "name" not in each.rpartition(".")[2].lower()):
        parent, _, key = place.rpartition(".")
        names = tuple(texts[place])
        if all(names) and len(set(names)) == len(names) and NAMING.fullmatch(key):
            known.setdefault((parent, len(names)), names)
    beside = {place: known.get((place.rpartition(".")[0], length)) for place, length in lengths.items()}
    return tuple((place, names) for place, names in beside.items() if names)


@dataclass
class Beside:
    """Names and lengths of the lists in the rows of a table."""

    #: (rows,), words of the lists of names, by place.
    names: dict[str, Sequence[tuple[str, ...]]] = field(default_factory=dict)
    #: (rows,) of lists whose length changes, by place.
    lengths: dict[str, Sequence[int]] = field(default_factory=dict)

    def labels(self, table: Table) -> tuple[list[Labels], Mask]:
        """Return the names of the elements of lists in every row, and (rows,) whether they fit no list."""
        names = {
            place: rows for place, rows in self.names.items() if NAMING.fullmatch(place.rpartition(".")[2])
        }
        if not names:
            return [()] * len(table), np.zeros(len(table), bool)
        fixed = {place: len(parts) for place, parts in elements(table.columns).items()}
        found: dict[Any, Labels] = {}
        labels, wrong = list[Labels](), list[bool]()
        words, lengths = zip(*names.values(), strict=True), zip(*self.lengths.values(), strict=True)
        for row in zip(words, lengths if self.lengths else repeat(()), strict=False):
            if row not in found:
                fine = {
                    p: cells
                    for p, cells in zip(names, row[0], strict=True)
                    if not any(map(NUMBER.fullmatch, cells))
                }
                found[row] = labels_of(fine, {**fixed, **dict(zip(self.lengths, row[1], strict=True))})
            labels.append(found[row])
            wrong.append(not found[row] and any(map(any, row[0])))
        return labels, np.array(wrong, bool)


def elements(columns: Iterable[str]) -> dict[str, list[str]]:
    """Return the columns that are elements of lists, in order, by place: `q[0]`, `tau_1`, `field.name0`."""
    found: dict[str, dict[int, str]] = {}
    for name in columns:
        if (match := ELEMENT.fullmatch(name)) and match["place"]:
            number = int(match["inside"] or match["behind"])
            found.setdefault(match["place"], {}).setdefault(number, name)
    # counted from 0 or from 1, without a gap
    whole = {place: each for place, each in found.items() if max(each) - min(each) == len(each) - 1}
    return {place: [each[k] for k in sorted(each)] for place, each in whole.items() if min(each) < 2}


def by_cells(table: Table, beside: Beside) -> list[Table]:
    """Return the tables of a file by the names in its cells, see `by_name`."""
    for place, parts in elements(table.texts).items():
        beside.names.setdefault(place, list(zip(*(table.texts[part] for part in parts), strict=True)))
    labels, wrong = beside.labels(table)
    if not any(labels):
        return [table]
    places = elements(table.columns)
    inside = {part: f"{place}[{k}]" for place, parts in places.items() for k, part in enumerate(parts)}
    # rows whose names fit no list, as of text with fewer cells than the header, hold numbers of other columns
    columns = {k: np.where(wrong, np.nan, v) if k in inside else v for k, v in table.columns.items()}
    found = by_name(_respelled(replace(table, columns=columns), inside), labels)
    return [_respelled(each, {place: part for part, place in inside.items()}) for each in found]


def _respelled(table: Table, names: Mapping[str, str]) -> Table:
    """The table with other names of some columns."""
    columns = {names.get(name, name): values for name, values in table.columns.items()}
    units = {names.get(name, name): unit for name, unit in table.units.items()}
    aliases = {names.get(new, new): names.get(old, old) for new, old in table.aliases.items()}
    return replace(table, columns=columns, units=units, aliases=aliases)


def by_publisher(table: Table, labels: Sequence[Labels], publishers: Sequence[str]) -> list[Table]:
    """Return the tables of a topic by name, with those of publishers that name the same things apart.

    Publishers that follow each other, such as a node that is started again, are one.
    """
    rows: dict[str, list[int]] = {}
    for k, (publisher, names) in enumerate(zip(publishers, labels, strict=True)):
        if names:
            rows.setdefault(publisher, []).append(k)
    things = {each: _things([labels[k] for k in own]) for each, own in rows.items()}
    beside = len(rows) <= PUBLISHERS and any(
        rows[a][0] < rows[b][-1] and rows[b][0] < rows[a][-1] and things[a] & things[b]
        for a, b in combinations(rows, 2)
    )
    if not beside:
        return by_name(table, labels)
    found = []
    for publisher in dict.fromkeys(publishers):
        own = np.array([k for k, each in enumerate(publishers) if each == publisher])
        part = _of_group(table, own, np.full(len(table), -1), ())
        found += by_name(replace(part, name=f"{table.name}{PUBLISHER}{publisher}"), [labels[k] for k in own])
    return found


def by_name(table: Table, labels: Sequence[Labels]) -> list[Table]:
    """Return a table in which every column is one thing, whatever its place in the lists.

    If the names never change, elements keep their columns and get the names as further names. If the order of
    the names changes, there is a column for every name. Rows of different things, as of two publishers on one
    topic, become tables of their own.
    """
    named = [each for each in dict.fromkeys(labels) if each]
    groups = _sharing(named)
    if not named or any(len(_things(group)) > MOST for group in groups):
        return [table]
    if len(named) == 1:
        return [replace(table, aliases={**table.aliases, **_aliases(table, named[0])})]
    number = {each: k for k, group in enumerate(groups) for each in group}
    of = np.array([number.get(each, -1) for each in labels])
    codes = {each: k for k, each in enumerate(named)}
    code = np.array([codes.get(each, -1) for each in labels])
    found = [_of_group(table, np.flatnonzero(of == k), code, named) for k in range(-1, len(groups))]
    kept = [each for each in found if each.columns or each.texts]
    return [_with_places(kept[0], table, named)] if len(kept) == 1 else kept


def _things(group: Sequence[Labels]) -> set[tuple[str, str]]:
    return {(place, name) for labels in group for place, names in labels for name in names}


def _sharing(named: Sequence[Labels]) -> list[list[Labels]]:
    """Groups of rows' names that share a name at a place, directly or through others."""
    first: dict[tuple[str, str], int] = {}
    parent = list(range(len(named)))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = k = parent[parent[k]]
        return k

    for k, labels in enumerate(named):
        for thing in _things([labels]):
            parent[root(k)] = root(first.setdefault(thing, k))
    groups: dict[int, list[Labels]] = {}
    for k, labels in enumerate(named):
        groups.setdefault(root(k), []).append(labels)
    return list(groups.values())


def _renamed(column: str, names: Mapping[str, Sequence[str]]) -> str:
    """A column by the names of the elements of lists that it is in."""
    at = column.rfind("[")
    while at >= 0:
        place, (index, _, rest) = column[:at], column[at + 1 :].partition("]")
        here = names.get(place, ())
        if len(index) < 5 and index.isdecimal() and int(index) < len(here):
            column = f"{place}[{here[int(index)]}]{rest}"
        at = place.rfind("[")
    return column


def _aliases(table: Table, labels: Labels) -> dict[str, str]:
    names = dict(labels)
    return {new: old for old in (*table.columns, *table.texts) if (new := _renamed(old, names)) != old}


def _of_group(table: Table, rows: Indices, code: NDArray[Any], named: Sequence[Labels]) -> Table:
    """Some rows of a table with their elements by name, without columns that they leave empty."""
    columns: dict[str, Array] = {}
    texts: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    cells = {name: np.array(column, object) for name, column in table.texts.items()}
    order = np.argsort(code[rows], kind="stable")
    for here in np.split(order, np.flatnonzero(np.diff(code[rows][order])) + 1):
        k = int(code[rows[here[0]]]) if len(here) else -1
        names = dict(named[k]) if k >= 0 else {}
        for old, values in table.columns.items():
            new = _renamed(old, names)
            columns.setdefault(new, np.full(len(rows), np.nan))[here] = values[rows[here]]
            units |= {new: table.units[old]} if old in table.units else {}
        for old, words in cells.items():
            texts.setdefault(_renamed(old, names), np.full(len(rows), "", object))[here] = words[rows[here]]
    columns = {name: column for name, column in columns.items() if not np.isnan(column).all()}
    filled = {name: words.tolist() for name, words in texts.items() if words.any()}
    return replace(
        table,
        columns=columns,
        texts=filled,
        units={name: unit for name, unit in units.items() if name in {*columns, *filled}},
        aliases={new: old for new, old in table.aliases.items() if old in {*columns, *filled}},
        clock=None if table.clock is None else table.clock[rows],
        rows=table.numbered(rows),
        origins={name: zero for name, zero in table.origins.items() if name in columns},
        words={name: among_rows(own, rows) for name, own in table.words.items() if name in columns},
    )


def _with_places(found: Table, table: Table, named: Sequence[Labels]) -> Table:
    """The table with `position[0]` for the element that is first in the first row, if every row has it."""
    alike = {
        place: names
        for place, names in named[0]
        if all(set(dict(labels).get(place, ())) == set(names) for labels in named)
    }
    places = {old: _renamed(old, alike) for old in table.columns}
    known = {old: new for old, new in places.items() if new in found.columns and old not in found.columns}
    return replace(found, aliases={**found.aliases, **known})
