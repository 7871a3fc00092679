"""Checks of the structure of JSON files before their content is used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json

#: A type (float: any number), a set of words, a list of one shape for all items, a mapping with the keys that
#: must be there ("*": for every key; "name?": may be missing), or a tuple of alternatives.
Shape = Any

#: Of a provenance.json.
ORIGIN = {"data": frozenset({"measured", "virtual"})}

_NAMES: dict[Any, str] = {
    **{str: "a text", float: "a number", int: "a whole number", bool: "true or false"},
    **{None: "null", dict: "an object", list: "a list"},
}


def read_shaped(path: Path, shape: Shape) -> Any:
    """Read a JSON file and check its structure."""
    content = read_json(path)
    check_shape(path, content, shape)
    return content


def check_shape(path: Path, content: Any, shape: Shape, place: str = "") -> None:
    """Refuse the content of a JSON file, at a place in it, if its structure differs from the expected one."""
    if not _fits(content, shape):
        raise BadInput(f"{path}:{place and f' {place}:'} must be {_expected(shape)}, got {in_words(content)}")
    if isinstance(shape, tuple):
        shape = next(s for s in shape if _fits(content, s))
    match shape:
        case dict():
            known = {key.removesuffix("?"): inner for key, inner in shape.items()}
            for key in dict.fromkeys([*known, *(content if "*" in shape else ())]):
                if key not in content and key != "*" and key in shape:
                    raise BadInput(f"{path}:{place and f' {place}:'} {key} is missing")
                if key in content:
                    name = key if key.isprintable() and len(key) < 60 else "..."
                    inner = known.get(key, known.get("*"))
                    check_shape(path, content[key], inner, f"{place}.{name}" if place else name)
        case [each]:
            for k, inner in enumerate(content):
                check_shape(path, inner, each, f"{place}[{k}]")


def _fits(content: Any, shape: Shape) -> bool:
    """Return whether the outermost level of `content` has the structure."""
    match shape:
        case tuple():
            return any(_fits(content, alternative) for alternative in shape)
        case frozenset():
            return isinstance(content, str) and content in shape
        case dict() | list():
            return isinstance(content, type(shape))
        case None:
            return content is None
    return isinstance(content, int | float if shape is float else shape) and (
        shape is bool or not isinstance(content, bool)
    )


def _expected(shape: Shape) -> str:
    match shape:
        case tuple():
            return " or ".join(map(_expected, shape))
        case frozenset():
            return f"one of {', '.join(sorted(shape))}"
        case dict() | list():
            return _NAMES[type(shape)]
    return _NAMES[shape]


def in_words(content: Any) -> str:
    """Return a value in words for an error message."""
    if isinstance(content, dict | list) or content is None:
        return _NAMES[None if content is None else type(content)]
    return ascii(content)[:60]
