"""Syntax of expressions: allowed characters, words and sizes, and the tree that Python's parser makes."""

from __future__ import annotations

import ast
import keyword
import re
import threading
import warnings

from unmodelled.base.errors import BadInput

LONGEST = 8000
MOST_NODES = 3000

#: One thread parses at a time: CPython 3.11 counts the depth of a tree, and keeps warning filters, for all.
_PARSING = threading.Lock()

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![\w.])"
    r"|(?P<name>[A-Za-z]\w*)"
    r"|\*\*|[<>=!]=|[<>](?![<>])|/(?!/)|[-+*(),]",
    re.ASCII,
)
_OFFENDER = re.compile(r"//|<<|>>|:=|[\w.]+|\W\w*")
_HINTS = {
    "^": "write ** for a power",
    "and": "multiply the conditions instead",
    "or": "use max(a, b) instead",
    "not": "use 1 - condition instead",
    "if": "use where(condition, a, b) instead",
    "=": "write == to compare",
    "//": "use floor(a/b) instead",
    "%": "use mod(a, b) instead",
}


def shown(text: str) -> str:
    """Return a text in quotes on one line, cut after 60 characters."""
    return repr(text if len(text) <= 60 else text[:57] + "...")


def names(text: str) -> list[str]:
    """Return the words of a text in order, whether or not the text is an expression."""
    return re.findall(r"(?<![\w.])[A-Za-z_]\w*", text, re.ASCII)


def tree(text: str, where: str) -> tuple[str, ast.expr]:
    """Return an expression on one line with its syntax tree; nothing is executed."""
    if len(text) > LONGEST:
        raise BadInput(
            f"{where}: an expression has at most {LONGEST} characters, got {len(text)}: name parts "
            "of it in signals"
        )
    line = " ".join(text.split())
    if not line:
        raise BadInput(f"{where}: the expression is empty: write one, such as 0")
    _check_tokens(line, where)
    try:
        with _PARSING, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            body = ast.parse(line, mode="eval").body
    except SyntaxError as error:
        rest = line[max((error.offset or 1) - 1, 0) :] or "the end"
        raise BadInput(f"{where}: not an expression: syntax error at {shown(rest)}") from None
    except (MemoryError, RecursionError, ValueError):
        raise BadInput(f"{where}: the expression is nested too deeply: name parts of it in signals") from None
    if sum(isinstance(node, ast.expr) for node in ast.walk(body)) > MOST_NODES:
        raise BadInput(
            f"{where}: the expression is too long: more than {MOST_NODES} parts: name parts of it in signals"
        )
    return line, body


def _check_tokens(line: str, where: str) -> None:
    position = 0
    while position < len(line):
        if line[position] == " ":
            position += 1
            continue
        found = _TOKEN.match(line, position)
        if found is None or keyword.iskeyword(found.group()):
            offender = found or _OFFENDER.match(line, position)
            token = offender.group() if offender else line[position]
            hint = _HINTS.get(token) or _HINTS.get(token[0])
            raise BadInput(f"{where}: {shown(token)} is not allowed" + (f"; {hint}" if hint else ""))
        position = found.end()


def out_of_order(name: str, used: str, uses: dict[str, list[str]]) -> str:
    """Return the reason why a signal cannot use another one: a cycle, or a later definition."""
    paths, seen = [[name, used]], {used}
    while paths:
        path = paths.pop()
        if path[-1] == name:
            return f"cycle in signals: {' -> '.join(path)}: remove one of these references"
        for following in uses[path[-1]]:
            if following not in seen:
                seen.add(following)
                paths.append([*path, following])
    return f"signals must be in order: {name!r} uses {used!r}, which is defined later: move {used!r} up"
