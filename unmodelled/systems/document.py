"""Reader of the YAML subset of system and mapping files: mappings, lists and texts with line numbers."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from unmodelled.base.errors import BadInput, Faults, closest, nearest
from unmodelled.base.limits import check_file
from unmodelled.systems.syntax import shown

_LARGEST = 1_000_000
_DEEPEST = 6
# What a file may declare; deeper down there can be a value for every experiment.
_MOST_KEYS, _MOST_VALUES, _DECLARING = 1000, 100_000, 2
_EMPTY = ("", "~", "null", "Null", "NULL")
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f\x80-\x9f\u2028\u2029\ufffe\uffff]")
_TAB = re.compile(r"^[ ]*\t", re.MULTILINE)
# libyaml's parser where PyYAML was built with it; both make the same events.
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class Node:
    """Part of a system file with its place."""

    file: Path
    line: int  # counted from 1; 0 where the place alone is known, as in JSON
    place: str  # dotted path of keys, such as parameters.J.value
    content: str | dict[str, Node] | list[Node] | None

    @property
    def where(self) -> str:
        """File, line and place: the start of every error message."""
        line = f": line {self.line}" if self.line else ""
        return f"{self.file}{line}" + (f": {self.place}" if self.place else "")

    def wrong(self, problem: str) -> BadInput:
        """Return the error of a problem at this place."""
        return BadInput(f"{self.where}: {problem}")

    def entries(self) -> dict[str, Node]:
        """Return the entries of a mapping with any keys; none if nothing is written."""
        if self.content is None:
            return {}
        if not isinstance(self.content, dict):
            raise self.wrong(f"must be a mapping (key: value), got {self._kind()}")
        return self.content

    def fields(self, required: tuple[str, ...], optional: tuple[str, ...] = ()) -> dict[str, Node]:
        """Return the entries of a mapping with known keys."""
        entries, faults = self.entries(), Faults()
        known = (*required, *optional)
        unknown = {key: node for key, node in entries.items() if key not in known}
        for key, node in unknown.items():
            faults.add(str(node.wrong(f"unknown key {shown(key)}{closest(key, known)}")))
        misspelt = {nearest(key, known) for key in unknown}
        for key in required:
            if key not in entries and key not in misspelt:
                advice = "; of a number without a unit write unit: 1" if key == "unit" else ""
                faults.add(str(self.wrong(f"the key {key!r} is missing: add it{advice}")))
        faults.check()
        return entries

    def items(self) -> list[Node]:
        """Return the items of a list; none if nothing is written."""
        if self.content is None:
            return []
        if not isinstance(self.content, list):
            raise self.wrong(f"must be a list, got {self._kind()}")
        return self.content

    def text(self) -> str:
        """Return the content as a text."""
        if not isinstance(self.content, str):
            raise self.wrong(f"must be a text, got {self._kind()}")
        return self.content

    @property
    def is_number(self) -> bool:
        """Whether the content is written as a number."""
        return isinstance(self.content, str) and _NUMBER.fullmatch(self.content) is not None

    def number(self) -> float:
        """Return the content as a finite number."""
        if not isinstance(self.content, str) or not self.is_number:
            raise self.wrong(f"must be a number, got {self._kind()}")
        value = float(self.content)
        if not math.isfinite(value):
            raise self.wrong(f"must be a finite number, got {shown(self.content)}")
        return value

    def boolean(self) -> bool:
        """Return the content as true or false."""
        if self.content not in ("true", "True", "false", "False"):
            raise self.wrong(f"must be true or false, got {self._kind()}")
        return self.content in ("true", "True")

    def pair(self) -> tuple[float, float]:
        """Return the content as two increasing numbers."""
        if not isinstance(self.content, list) or len(self.content) != 2:
            raise self.wrong(f"must be two numbers [low, high], got {self._kind()}")
        low, high = (node.number() for node in self.content)
        if not low < high:
            raise self.wrong(f"must increase, got [{low:g}, {high:g}]")
        return low, high

    def _kind(self) -> str:
        match self.content:
            case None:
                return "nothing"
            case dict():
                return "a mapping"
            case list():
                return f"a list of {len(self.content)}"
        return shown(self.content)


def flag(entries: Mapping[str, Node], key: str, default: bool = False) -> bool:
    """Return an entry as true or false, or the default without one."""
    return entries[key].boolean() if key in entries else default


def as_node(content: Any, file: Path, place: str, depth: int = 0) -> Node:
    """Return plain values, as those of a JSON file, as a part of a file that is read like YAML."""
    bare = Node(file, 0, place, None)
    if depth > _DEEPEST:
        raise bare.wrong(f"nested too deeply: at most {_DEEPEST} levels")
    match content:
        case None:
            return bare
        case dict():
            entries = {key: as_node(v, file, f"{place}.{key}", depth + 1) for key, v in content.items()}
            return Node(file, 0, place, entries)
        case list():
            items = [as_node(v, file, f"{place}[{k}]", depth + 1) for k, v in enumerate(content)]
            return Node(file, 0, place, items)
    return Node(file, 0, place, content if isinstance(content, str) else json.dumps(content))


def load_yaml(path: Path, kind: str = "system") -> Node:
    """Read a YAML file whose top level is a mapping."""
    text = _text(path, kind)
    try:
        return _Events(path, kind, iter(yaml.parse(text, Loader=_LOADER))).document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f" line {mark.line + 1}:" if mark else ""
        problem = " ".join(f"{error.problem or error.context}".split())
        raise BadInput(f"{path}:{line} not a YAML file: {problem}") from None
    except yaml.YAMLError as error:
        raise BadInput(f"{path}: not a YAML file: {shown(' '.join(str(error).split()))}") from None


def file_beside(node: Node, largest: int) -> Path:
    """Return the path of a file of at most `largest` bytes that a system file names."""
    folder = node.file.parent.resolve()
    written = Path(node.text())
    try:
        path = (folder / written).resolve()
        if written.is_absolute() or ".." in written.parts or not path.is_relative_to(folder):
            raise node.wrong(f"{shown(node.text())} must lie in the folder of the system file: copy it there")
        check_file(path)
        if not path.is_file():
            raise node.wrong(f"{shown(node.text())}: no such file beside the system file: check the name")
        if path.stat().st_size > largest:
            raise node.wrong(f"{shown(node.text())}: has more than {largest} bytes: keep less of it")
    except (OSError, ValueError, RuntimeError):
        raise node.wrong(
            f"{shown(node.text())}: no such file beside the system file: check the name"
        ) from None
    return path


def _text(path: Path, kind: str) -> str:
    check_file(path)
    try:
        if not path.is_file():
            raise BadInput(f"{path}: no such file: check the path")
        if path.stat().st_size > _LARGEST:
            raise BadInput(
                f"{path}: a {kind} file has at most {_LARGEST} bytes, got {path.stat().st_size}: "
                "move tables to CSV files"
            )
        raw = path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}: check its permissions") from None
    except ValueError as error:
        raise BadInput(f"{path}: cannot be read: {error}: check the path") from None
    try:
        text = raw.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise BadInput(f"{path}: line {line}: not UTF-8 text: save the file in UTF-8") from None
    for pattern, problem in (
        (_CONTROL, "a control character; remove it"),
        (_TAB, "a tab; indent with spaces"),
    ):
        if found := pattern.search(text):
            raise BadInput(f"{path}: line {text.count(chr(10), 0, found.end() - 1) + 1}: {problem}")
    return text


@dataclass(frozen=True)
class _Events:
    path: Path
    kind: str
    events: Iterator[Any]

    def document(self) -> Node:
        next(self.events)
        first = next(self.events)
        if isinstance(first, yaml.StreamEndEvent):
            raise BadInput(f"{self.path}: line 1: the file is empty: start with 'schema: {self.kind}/1'")
        event = next(self.events)
        root = self._node(event, event.start_mark.line + 1, "", 0)
        if not isinstance(root.content, dict):
            raise root.wrong(f"a {self.kind} file is a mapping (key: value)")
        next(self.events)
        after = next(self.events)
        if not isinstance(after, yaml.StreamEndEvent):
            raise BadInput(
                f"{self.path}: line {after.start_mark.line + 1}: only one document is allowed: "
                "remove the line ---"
            )
        return root

    def _node(self, event: Any, line: int, place: str, depth: int) -> Node:
        bare = Node(self.path, line, place, None)
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            raise bare.wrong("anchors (&) and aliases (*) are not allowed; quote a text that starts so")
        if event.tag is not None:
            raise bare.wrong(f"the tag {shown(event.tag)} is not allowed: remove it")
        if depth > _DEEPEST:
            raise bare.wrong(f"nested too deeply: a {self.kind} file has at most 6 levels")
        if isinstance(event, yaml.MappingStartEvent):
            return Node(self.path, line, place, self._mapping(place, depth))
        if isinstance(event, yaml.SequenceStartEvent):
            return Node(self.path, line, place, self._items(place, depth))
        empty = event.implicit[0] and event.value in _EMPTY
        return Node(self.path, line, place, None if empty else event.value)

    def _items(self, place: str, depth: int) -> list[Node]:
        items: list[Node] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self._node(event, event.start_mark.line + 1, f"{place}[{len(items)}]", depth + 1))
        return items

    def _mapping(self, place: str, depth: int) -> dict[str, Node]:
        entries: dict[str, Node] = {}
        most = _MOST_KEYS if depth <= _DECLARING else _MOST_VALUES
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            line = event.start_mark.line + 1
            if not isinstance(event, yaml.ScalarEvent):
                raise Node(self.path, line, place, None).wrong("a key must be a word: quote it")
            key = self._node(event, line, place, depth)
            name = event.value
            if name in entries:
                raise key.wrong(
                    f"the key {shown(name)} is written twice, first in line {entries[name].line}: remove one"
                )
            word = name if re.fullmatch(r"\w{1,60}", name) else shown(name)
            inner = f"{place}.{word}" if place else word
            entries[name] = self._node(next(self.events), line, inner, depth + 1)
            if len(entries) > most:
                raise key.wrong(f"too many entries, at most {most}: split the file")
        return entries
