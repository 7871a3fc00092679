"""The text of a system file with changed entries: comments, order and numbers of the rest stay as written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import yaml

#: Content of a section: an expression, or the keys of an entry with what stands behind them.
Entries = Mapping[str, str | Mapping[str, str]]
Sections = Mapping[str, Entries]


@dataclass(frozen=True)
class _Edit:
    start: int
    end: int
    text: str


def edited(
    text: str, head: Mapping[str, str], new: Mapping[str, str], before: Sections, after: Sections
) -> str | None:
    """Return the text of a file that says `head` and `before`, changed to say `new` and `after`, or None.

    Values are those of `after` where they differ from those of `before`. Nothing is removed from a file.

    Examples:
        >>> text = "parameters:  # of a pendulum\\n  J: {value: 2e-2, unit: kg m^2}  # from the drawing\\n"
        >>> given = {"parameters": {"J": {"value": "0.02", "unit": "kg m^2"}}}
        >>> grown = {"parameters": {"J": {"value": "0.03", "unit": "kg m^2"}, "k": {"value": "1.0"}}}
        >>> print(edited(text, {}, {}, given, grown), end="")
        parameters:  # of a pendulum
          J: {value: 0.03, unit: kg m^2}  # from the drawing
          k: {value: 1.0}
    """
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    if root is None:
        return None
    try:
        edits = [*_entry(text, root, head, new), *_edits(text, root, before, after)]
    except (LookupError, TypeError):  # another structure, such as an entry that is shortened
        return None
    for edit in sorted(edits, key=lambda edit: edit.start, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def braces(entries: str | Mapping[str, str]) -> str:
    """Return an entry as it stands behind its name."""
    if isinstance(entries, str):
        return entries
    return "{" + ", ".join(f"{key}: {value}" for key, value in entries.items()) + "}"


def _edits(text: str, root: yaml.Node, before: Sections, after: Sections) -> Iterator[_Edit]:
    sections = _children(root)
    new = {name: entries for name, entries in after.items() if entries and name not in sections}
    for name, entries in after.items():
        if name in sections:
            yield from _section(text, sections[name], before[name], entries)
    if new:
        lines = [
            line
            for section, entries in new.items()
            for line in (f"{section}:", *(f"  {name}: {braces(each)}" for name, each in entries.items()))
        ]
        end = "" if text.endswith("\n") else "\n"
        yield _Edit(len(text), len(text), end + "\n".join(lines) + "\n")


def _section(text: str, node: yaml.Node, before: Entries, after: Entries) -> Iterator[_Edit]:
    if before.keys() - after.keys():
        raise LookupError
    entries = _children(node)
    for name, content in after.items():
        old = before.get(name)
        if old is None or (name not in entries and content != old):
            continue  # added below; a number that the file leaves to be filled in is no entry of it
        if isinstance(content, str) or isinstance(old, str):
            if content != old:
                yield _replaced(entries[name], braces(content))
        elif content != old:
            yield from _entry(text, entries[name], old, content)
    missing = {name: content for name, content in after.items() if name not in entries}
    added = {name: braces(content) for name, content in missing.items() if content != before.get(name)}
    yield from _added(text, node, added)


def _entry(
    text: str, node: yaml.Node, before: Mapping[str, str], after: Mapping[str, str]
) -> Iterator[_Edit]:
    if before.keys() - after.keys():
        raise LookupError
    keys = _children(node)
    changed = {key: value for key, value in after.items() if before.get(key) != value}
    for key, value in changed.items():
        if key in keys:
            yield _replaced(keys[key], value)
    yield from _added(text, node, {key: value for key, value in changed.items() if key not in keys})


def _replaced(node: yaml.Node, value: str) -> _Edit:
    if not isinstance(node, yaml.ScalarNode) or node.style in ("|", ">"):
        raise TypeError
    return _Edit(node.start_mark.index, node.end_mark.index, value)


def _added(text: str, node: yaml.Node, entries: Mapping[str, str]) -> Iterator[_Edit]:
    """New entries behind the last one, in braces or a line each as the mapping is written."""
    if not entries:
        return
    if not isinstance(node, yaml.MappingNode) or not node.value:
        raise TypeError
    end = _end(node.value[-1][1])
    if node.flow_style:
        yield _Edit(end, end, "".join(f", {name}: {value}" for name, value in entries.items()))
        return
    indent = " " * node.value[0][0].start_mark.column
    line = text.find("\n", end)
    at, start = (len(text), "\n") if line < 0 else (line + 1, "")
    yield _Edit(at, at, start + "".join(f"{indent}{name}: {value}\n" for name, value in entries.items()))


def _end(node: yaml.Node) -> int:
    """Index behind the last character of a node; that of a block mapping is where the next token begins."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    if isinstance(node, yaml.ScalarNode) and node.style in ("|", ">"):
        raise TypeError
    return int(node.end_mark.index)


def _children(node: yaml.Node) -> dict[str, yaml.Node]:
    if not isinstance(node, yaml.MappingNode):
        raise TypeError
    return {str(key.value): value for key, value in node.value}
