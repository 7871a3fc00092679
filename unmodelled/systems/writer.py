"""Writer of `system/1` files."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import sympy as sp

from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_texts
from unmodelled.systems.edited import Entries, Sections, braces, edited
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import Constant, Event, Input, Output, Parameter, Port, State, System, symbol
from unmodelled.systems.printing import printed
from unmodelled.systems.reader import read_system
from unmodelled.systems.scope import Scope, scope_of
from unmodelled.systems.tables import Table

# What YAML reads as that very text, also between braces.
_PLAIN = re.compile(
    r"(?!(?:null|Null|NULL|true|false)$)[A-Za-z0-9_(.][\w .+*/()^-]*(?<! )|-[\w(][\w .+*/()^-]*(?<! )"
)
# What JSON leaves as it is and a system file must not hold.
_UNPRINTED = re.compile(r"[\x7f-\x9f\u2028\u2029\ufffe\uffff]")


def write_system(system: System, path: Path | str, given: System | None = None, comment: str = "") -> None:
    """Write a system as a file (system/1), and its tables as CSV files and its robot file beside it.

    Reading the file gives the system back. An expression is written as the user wrote it where that still
    says the same.

    Args:
        system: system to write.
        path: YAML file; replaced where it exists.
        given: system of which the file is a changed one: comments, order and unchanged entries of its file
            are kept where that still says the system; default: the file is written anew.
        comment: lines above the file, without #; default none.

    Raises:
        ValueError: when an expression has no form in the grammar, such as the slope of a table.
        BadInput: when a file cannot be written.

    Examples:
        >>> from tempfile import TemporaryDirectory
        >>> import unmodelled as um
        >>> system, _ = um.example("pendulum")
        >>> with TemporaryDirectory() as folder:
        ...     um.write_system(system, f"{folder}/copy.yaml")
        ...     um.read_system(f"{folder}/copy.yaml") == system
        True
    """
    path = Path(path)
    files = {table.name: f"{path.stem}_{table.name}.csv" for table in system.tables}
    beside = f"{path.stem}_{Path(system.robot.file).name}" if system.robot is not None else ""
    text = _lines(*_Text(system, scope_of(system)).document(files, beside))
    texts = {path.with_name(files[table.name]): _table_text(table) for table in system.tables}
    if system.robot is not None:
        texts[path.with_name(beside)] = system.robot.text
    if given is not None and (changed := _changed(given, system, files, beside)):
        text = changed if _says(changed, text, {file.name: own for file, own in texts.items()}) else text
    head = "".join(f"# {line}\n" for line in comment.splitlines())
    write_texts({**texts, path: head + text})


def _changed(given: System, system: System, files: Mapping[str, str], model: str) -> str | None:
    """The file of a given system changed to say another one; None where it cannot be."""
    try:
        text = Path(given.source).read_text(encoding="utf-8") if given.source else ""
        own = {table.name: "" for table in given.tables}
        head, before = _Text(given, scope_of(given)).document(own, "")
    except (OSError, ValueError):
        return None
    new, after = _Text(system, scope_of(system)).document(files, model)
    # the columns of a table are those of a file of its own
    tables = {table.name: {"kind": table.kind} for table in given.tables}
    return edited(text, head, new, {**before, "tables": tables}, after) if text else None


def _says(text: str, other: str, beside: Mapping[str, str]) -> bool:
    """Whether a file says the same system as another one, with files of these names beside it."""
    try:
        with TemporaryDirectory() as folder:
            for name, content in beside.items():
                (Path(folder) / name).write_text(content, encoding="utf-8", newline="")
            path, systems = Path(folder) / "system.yaml", []
            for each in (text, other):
                path.write_text(each, encoding="utf-8")
                systems.append(read_system(path))
    except (BadInput, OSError):
        return False
    return systems[0] == systems[1]


def _lines(head: Mapping[str, str], sections: Sections) -> str:
    lines = [f"{name}: {content}" for name, content in head.items()]
    for section, entries in sections.items():
        if entries:
            lines += [f"{section}:", *(f"  {name}: {braces(each)}" for name, each in entries.items())]
    return "\n".join(lines) + "\n"


def _table_text(table: Table) -> str:
    rows = [("x", "y"), *zip(map(repr, table.x), map(repr, table.y), strict=True)]
    csv.writer(lines := StringIO()).writerows(rows)
    return lines.getvalue()


@dataclass(frozen=True)
class _Text:
    system: System
    scope: Scope

    def document(self, files: Mapping[str, str], model: str) -> tuple[dict[str, str], Sections]:
        """Entries before the sections, and the sections."""
        system = self.system
        sections: dict[str, Entries] = {
            "states": {s.name: self._state(s) for s in system.states},
            "inputs": {u.name: _input(u) for u in system.inputs},
            "outputs": {y.name: self._output(y) for y in system.outputs},
            "operating_point": {c.name: _constant(c) for c in system.operating_point},
            "parameters": {p.name: _parameter(p) for p in system.parameters},
            "signals": {name: self._expression(f"signals.{name}", e) for name, e in system.signals.items()},
            "ports": {p.name: self._port(p) for p in system.ports},
            "tables": {t.name: _table(t, files[t.name]) for t in system.tables},
            "dynamics": self._dynamics(),
            "events": {e.name: self._event(e) for e in system.events},
        }
        head = {"schema": "system/1", "name": _quoted(system.name)}
        if system.robot is not None:
            head["model"] = _quoted(model)
            if system.robot.locked:
                locked = {_quoted(name): repr(float(value)) for name, value in system.robot.locked.items()}
                head["locked"] = braces(locked)
        return head, sections

    def _expression(self, place: str, expression: sp.Expr) -> str:
        """Return an expression as the user wrote it if it still means the same, otherwise printed anew."""
        written = self.system.text.get(place)
        if written is not None and self._means(written, expression):
            return _quoted(written)
        names = [n for n in self.scope.values if n not in self.system.signals]
        tables = [t.name for t in self.system.tables]
        return _quoted(printed(expression, names, tables, self.system.robot))

    def _rates(self, place: str, rates: Mapping[str, sp.Expr]) -> dict[str, str]:
        return {name: self._expression(f"{place}.{name}", rate) for name, rate in rates.items()}

    def _dynamics(self) -> dict[str, str]:
        """Derivatives of the states, without those that the robot file gives."""
        rates = {s.name: rate for s, rate in zip(self.system.states, self.system.dynamics, strict=True)}
        known = {} if self.system.robot is None else self.system.robot.dynamics
        found = self._rates("dynamics", rates)
        return {name: text for name, text in found.items() if text != _quoted(known.get(name, ""))}

    def _means(self, written: str, expression: sp.Expr) -> bool:
        try:
            return bool(parse(written, self.scope, "") == expression)
        except BadInput:
            return False

    def _state(self, state: State) -> dict[str, str]:
        entries = {"unit": _quoted(state.unit)}
        place = f"states.{state.name}.initial"
        if place in self.system.text or not state.initial.is_number:
            return entries | {"initial": self._expression(place, state.initial)}
        return entries | {"initial": repr(float(state.initial))} if state.initial else entries

    def _output(self, output: Output) -> dict[str, str]:
        entries = _signal(output)
        place = f"outputs.{output.name}.expression"
        if place in self.system.text or output.expression != symbol(output.name):
            entries["expression"] = self._expression(place, output.expression)
        return entries

    def _port(self, port: Port) -> dict[str, str]:
        entries = {"effort": port.effort, "unit": _quoted(port.unit)}
        named = {"position": port.position, "velocity": port.velocity, "load": port.load, "kind": port.kind}
        entries |= {key: name for key, name in named.items() if name is not None}
        if port.law is not None:
            entries["law"] = self._expression(f"ports.{port.name}.law", port.law)
        return entries

    def _event(self, event: Event) -> dict[str, str]:
        place = f"events.{event.name}"
        entries = {"expression": self._expression(f"{place}.expression", event.expression)}
        if event.then is None:
            return entries
        names = [s.name for s in self.system.states]
        after, before = (dict(zip(names, rates, strict=True)) for rates in (event.then, self.system.dynamics))
        written = [n for n in names if after[n] != before[n] or f"{place}.then.{n}" in self.system.text]
        then = {name: after[name] for name in written or names}
        return entries | {"then": braces(self._rates(f"{place}.then", then))}


def _quoted(text: str) -> str:
    if _PLAIN.fullmatch(text):
        return text
    return _UNPRINTED.sub(lambda found: f"\\u{ord(found.group()):04x}", json.dumps(text, ensure_ascii=False))


def _signal(item: Input | Output) -> dict[str, str]:
    entries = {"unit": _quoted(item.column_unit), "column": _quoted(item.column)}
    return entries | {"delay": repr(float(item.delay))} if item.delay else entries


def _input(item: Input) -> dict[str, str]:
    entries = _signal(item)
    entries |= {} if item.commanded else {"commanded": "false"}
    return entries | {"hold": "true"} if item.hold else entries


def _constant(constant: Constant) -> dict[str, str]:
    # values of a file are kept in SI, those of a column of experiments.csv stay as they are written
    entries = {"unit": _quoted(constant.column_unit if constant.values is None else constant.unit)}
    if constant.values is not None:
        given = {_quoted(name): repr(float(value)) for name, value in constant.values.items()}
        entries["values"] = braces(given)
    if constant.other is not None:
        entries["other"] = repr(float(constant.other))
    return entries | _fitted(constant)


def _parameter(parameter: Parameter) -> dict[str, str]:
    entries = {"value": repr(float(parameter.value)), "unit": _quoted(parameter.unit)} | _fitted(parameter)
    entries |= {"per_experiment": "true"} if parameter.per_experiment else {}
    return entries | {"guess": "true"} if parameter.guess else entries


def _fitted(number: Parameter | Constant) -> dict[str, str]:
    entries = {"identify": "true"} if number.identify else {}
    if number.bounds is not None:
        low, high = number.bounds
        entries["bounds"] = f"[{float(low)!r}, {float(high)!r}]"
    return entries


def _table(table: Table, file: str) -> dict[str, str]:
    return {"file": _quoted(file), "x": "x", "y": "y", "kind": table.kind}
