"""Writer of `system/1` files."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import sympy as sp

from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_texts
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import Constant, Event, Input, Output, Parameter, Port, State, System, symbol
from unmodelled.systems.printing import printed
from unmodelled.systems.scope import Scope, scope_of
from unmodelled.systems.tables import Table

# What YAML reads as that very text, also between braces.
_PLAIN = re.compile(
    r"(?!(?:null|Null|NULL|true|false)$)[A-Za-z0-9_(.][\w .+*/()^-]*(?<! )|-[\w(][\w .+*/()^-]*(?<! )"
)
# What JSON leaves as it is and a system file must not hold.
_UNPRINTED = re.compile(r"[\x7f-\x9f\u2028\u2029\ufffe\uffff]")


def write_system(system: System, path: Path | str) -> None:
    """Write a system as a file (system/1), and its tables as CSV files and its robot file beside it.

    Reading the file gives the system back. An expression is written as the user wrote it where that still
    says the same.

    Args:
        system: system to write.
        path: YAML file; replaced where it exists.

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
    text = _Text(system, scope_of(system)).document(files, beside)
    texts = {path.with_name(files[table.name]): _table_text(table) for table in system.tables}
    if system.robot is not None:
        texts[path.with_name(beside)] = system.robot.text
    write_texts({**texts, path: text})


def _table_text(table: Table) -> str:
    rows = [("x", "y"), *zip(map(repr, table.x), map(repr, table.y), strict=True)]
    csv.writer(lines := StringIO()).writerows(rows)
    return lines.getvalue()


@dataclass(frozen=True)
class _Text:
    system: System
    scope: Scope

    def document(self, files: Mapping[str, str], model: str) -> str:
        system = self.system
        sections = {
            "states": {s.name: _braces(self._state(s)) for s in system.states},
            "inputs": {u.name: _braces(_input(u)) for u in system.inputs},
            "outputs": {y.name: _braces(self._output(y)) for y in system.outputs},
            "operating_point": {c.name: _braces(_constant(c)) for c in system.operating_point},
            "parameters": {p.name: _braces(_parameter(p)) for p in system.parameters},
            "signals": {name: self._expression(f"signals.{name}", e) for name, e in system.signals.items()},
            "ports": {p.name: _braces(self._port(p)) for p in system.ports},
            "tables": {t.name: _braces(_table(t, files[t.name])) for t in system.tables},
            "dynamics": self._dynamics(),
            "events": {e.name: _braces(self._event(e)) for e in system.events},
        }
        lines = ["schema: system/1", f"name: {_quoted(system.name)}"]
        if system.robot is not None:
            lines.append(f"model: {_quoted(model)}")
            locked = {_quoted(name): repr(float(value)) for name, value in system.robot.locked.items()}
            lines += [f"locked: {_braces(locked)}"] if locked else []
        for section, entries in sections.items():
            if entries:
                lines += [f"{section}:", *(f"  {name}: {content}" for name, content in entries.items())]
        return "\n".join(lines) + "\n"

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
        return entries | {"then": _braces(self._rates(f"{place}.then", then))}


def _quoted(text: str) -> str:
    if _PLAIN.fullmatch(text):
        return text
    return _UNPRINTED.sub(lambda found: f"\\u{ord(found.group()):04x}", json.dumps(text, ensure_ascii=False))


def _braces(entries: Mapping[str, str]) -> str:
    return "{" + ", ".join(f"{key}: {value}" for key, value in entries.items()) + "}"


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
        entries["values"] = _braces(given)
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
