"""Write the page on system files."""

from __future__ import annotations

from pathlib import Path

from docs.reference.docstrings import ROOT
from docs.reference.markdown import code, comment, table
from pipeline.chapters.known import FILE
from unmodelled.systems.operations import FUNCTIONS, Operation
from unmodelled.systems.reader import read_system

HEAD = """# Systems

To write a system file, see [your own data](../own_data/README.md). This repository holds the following files:

"""
LANGUAGE = """
## What an expression may contain

An expression may contain numbers, names, `+ - * / **`, comparisons, parentheses and functions; everything
else is refused, and nothing is executed. Names are states, inputs, parameters, the operating point, signals,
efforts, `t` (time in s since the start of the experiment), `pi` and tables. Functions are {plain}, and:

"""
#: Functions whose name does not define them.
MEANINGS = {
    "where": "`b` if the condition `a` is true, else `c`",
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
    """Return a table of all system files, and the language of expressions."""
    found = (path for path in (ROOT / "systems").rglob("*.yaml") if path.name != FILE)
    files = sorted(found, key=lambda path: (len(path.parts), path))
    head = ("file", "description", "states", "inputs", "outputs", "ports", "uncertain")
    plain = ", ".join(code(name) for name in FUNCTIONS if name not in MEANINGS)
    calls = [(code(f"{n}({_arguments(f)})"), MEANINGS[n]) for n, f in FUNCTIONS.items() if n in MEANINGS]
    calls.append((code("diff(expression, state)"), "partial derivative"))
    calls.append((code("acceleration_joint(...)"), "acceleration of the joint of a robot, see your own data"))
    calls.append((code("mobility_joint(...)"), "its derivative by the torque of the joint"))
    body = HEAD + table(head, [_row(path) for path in files])
    return body + LANGUAGE.format(plain=plain) + table(("function", "value"), calls)


def _row(path: Path) -> tuple[str, ...]:
    system = read_system(path)
    groups = (system.states, system.inputs, system.outputs)
    names = [", ".join(f"{code(item.name)} ({item.unit})" for item in group) for group in groups]
    ports = ", ".join(f"{code(port.name)} ({port.unit})" for port in system.ports)
    uncertain = ", ".join(map(code, system.uncertain))
    place = path.relative_to(ROOT).as_posix()
    return f"[{place}](../../{place})", comment(path), *names, ports, uncertain


def _arguments(function: Operation) -> str:
    letters = [*"abc"][: function.least]
    return ", ".join(letters if function.most == function.least else [*letters, "..."])
