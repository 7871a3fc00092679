"""The page on system files."""

from __future__ import annotations

import re
from pathlib import Path

from docs.reference.docstrings import ROOT
from docs.reference.markdown import code, table
from unmodelled.systems.operations import FUNCTIONS, Operation
from unmodelled.systems.reader import read_system

HEAD = """# Systems

How to write one: [your own data](../own_data/README.md). These come with the project:

"""
LANGUAGE = """
## What an expression may hold

Numbers, names, `+ - * / **`, comparisons, parentheses and functions; nothing else is read, and nothing is
executed. Names are states, inputs, parameters, the operating point, signals, efforts, `t` (s since the start
of the experiment), `pi` and tables. Functions: {plain}, and

"""
#: What does not go without saying.
MEANINGS = {
    "where": "`b` where `a` holds, else `c`",
    "clip": "`a`, but at least `b` and at most `c`",
    "heaviside": "0 below zero, 1/2 at zero, 1 above",
    "mod": "remainder of `a` by `b`, with the sign of `b`",
    "atan2": "angle of the point (`b`, `a`)",
    "sign": "-1, 0 or 1",
    "log": "natural logarithm",
    "floor": "largest whole number not above `a`",
    "min": "of two or more",
    "max": "of two or more",
}


def page() -> str:
    """A table of all files, and the language."""
    files = sorted((ROOT / "systems").rglob("*.yaml"), key=lambda path: (len(path.parts), path))
    head = ("file", "what it is", "states", "inputs", "outputs", "ports", "uncertain")
    plain = ", ".join(code(name) for name in FUNCTIONS if name not in MEANINGS)
    calls = [(code(f"{n}({_arguments(f)})"), MEANINGS[n]) for n, f in FUNCTIONS.items() if n in MEANINGS]
    calls.append((code("diff(expression, state)"), "partial derivative"))
    body = HEAD + table(head, [_row(path) for path in files])
    return body + LANGUAGE.format(plain=plain) + table(("function", "value"), calls)


def _row(path: Path) -> tuple[str, ...]:
    system = read_system(path)
    groups = (system.states, system.inputs, system.outputs)
    names = [", ".join(f"{code(item.name)} ({item.unit})" for item in group) for group in groups]
    ports = ", ".join(f"{code(port.name)} ({port.unit})" for port in system.ports)
    uncertain = ", ".join(map(code, system.uncertain))
    place = path.relative_to(ROOT).as_posix()
    return f"[{place}](../../{place})", _comment(path), *names, ports, uncertain


def _comment(path: Path) -> str:
    found = re.match(r"((?:#.*\n)+)", path.read_text())
    return " ".join(line.lstrip("# ").rstrip() for line in found[1].splitlines()) if found else ""


def _arguments(function: Operation) -> str:
    letters = [*"abc"][: function.least]
    return ", ".join(letters if function.most == function.least else [*letters, "..."])
