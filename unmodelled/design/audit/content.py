"""An audit as audit.json has it, and in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from unmodelled.base.wording import amounts, quantity, unit_text
from unmodelled.design.audit.audit import AuditFound
from unmodelled.design.audit.number_sets import FILE
from unmodelled.design.audit.predictions import Errors, Predicted
from unmodelled.design.audit.rows import AuditedNumber
from unmodelled.diagnosis.data.remark import listed

Content = Mapping[str, Any]

SCHEMA = "audit/1"
#: Probability from which a set is called the best.
SURE = 0.95
#: Digits of a number in a sentence, and outputs that the first sentence tells.
DIGITS, MANY = 3, 2


def content(found: AuditFound) -> dict[str, Any]:
    """Return the content of audit.json; errors are in the units of the columns."""
    per = {o.name: o.as_difference for o in found.system.outputs}

    def errors(own: Errors | None) -> dict[str, float] | None:
        return None if own is None else {name: value / per[name].factor for name, value in own.items()}

    def predicted(own: Predicted | None) -> dict[str, Any] | None:
        return None if own is None else {"errors": errors(own.errors), "probability": own.probability}

    return {
        "schema": SCHEMA,
        "system": found.system.name,
        "experiments": list(found.logs.ids),
        "horizon": found.horizon,
        "verdict": found.verdict,
        "laws": list(found.laws),
        "outputs": {name: {"unit": unit.text} for name, unit in per.items()},
        "numbers": [_number(row) for row in found.numbers],
        "sets": [
            {
                "name": row.name,
                "fitted": list(row.fitted),
                "as_given": predicted(row.as_given),
                "with_laws": predicted(row.with_laws),
            }
            for row in found.predictions
        ],
        "refitted": {"as_given": errors(found.refitted), "with_laws": errors(found.refitted_with_laws)},
        "notes": list(found.notes),
    }


def _number(row: AuditedNumber) -> dict[str, Any]:
    found = row.estimate
    return {
        "name": row.name,
        "unit": row.unit,
        "known": row.known,
        "kind": row.kind,
        "value": None if found is None else found.value,
        "interval": None if found is None else list(found.interval),
        "forms": dict(row.forms),
        "moves": [vars(move) | {"interval": list(move.interval)} for move in row.moves],
        "tied": list(row.tied),
        "sentence": row.sentence or _says(row),
        "sets": {name: {"value": row.values[name], "mark": mark} for name, mark in row.marks.items()},
    }


def _says(row: AuditedNumber) -> str:
    """What the logs say about a number that they determine, or that was held."""
    found = row.estimate
    if found is None:
        return "held at the value of the system file"
    value, interval = quantity(found.value, found.interval)
    unit = unit_text(row.unit)
    told = " ".join(filter(None, (row.name, "=", value, unit))) + f" (95 % interval {interval})"
    if row.kind == "wrong":
        return f"{told} instead of {_amount(row.known, row)} in the system file"
    if row.forms:
        shown = (f"{_amount(value, row)} with {law}" for law, value in row.forms.items())
        told += f", {listed(shown)}, which these logs cannot tell from the named law"
    if not row.moves:
        return f"these logs determine {told}"
    parts = [_moved(row, move.law, move.value, found.value) for move in row.moves if move.family]
    if not parts:
        return f"{told} may absorb what is missing at the ports and no law names; do not use it elsewhere"
    return f"{told}; {'; '.join(parts)}"


def _amount(value: float, row: AuditedNumber) -> str:
    return amounts([value], row.unit, DIGITS)[0]


def _moved(row: AuditedNumber, law: str, without: float, value: float) -> str:
    was, by = amounts([without, value - without], row.unit, DIGITS)
    sign = "+" if value > without else ""
    return f"in a model without {law} it is {was} and absorbs the law, which moves it by {sign}{by}"


def sentences(found: Content) -> Iterator[str]:
    """Yield which set predicts best, as the model stands and with the laws that it leaves out."""
    yield f"As the model stands, {_best(found, 'as_given')}."
    if found["laws"]:
        yield f"With {listed(found['laws'])}, which the model leaves out, {_best(found, 'with_laws')}."


def _best(found: Content, key: str) -> str:
    sets = sorted(found["sets"], key=lambda one: -one[key]["probability"])
    first, chance = sets[0], sets[0][key]["probability"]
    if first[key]["errors"] is None:
        return "no set can be simulated"
    off, (after,) = _said_errors(found, first[key]["errors"]), amounts([found["horizon"]], "s", DIGITS)
    where = f"{listed(off[:MANY])} off within {after} in experiments that were left out"
    name = f"the {FILE}" if first["name"] == FILE else first["name"]
    if len(sets) == 1:
        return f"{name} is {where}"
    if chance >= SURE:
        return f"{name} predicts best: {where}"
    return f"{name} seems to predict best (probability {100.0 * chance:.0f} %): {where}"


def _said_errors(found: Content, errors: Mapping[str, float]) -> list[str]:
    """Errors of outputs in words."""
    units = {name: own["unit"] for name, own in found["outputs"].items()}
    return [f"{name} {amounts([value], units[name], DIGITS)[0]}" for name, value in errors.items()]


def lines(found: Content) -> list[str]:
    """Return an audit as a terminal shows it: sentences, a row a number, a row a set, notes."""
    names = [one["name"] for one in found["sets"]]
    numbers = [["", "these logs say", *names]]
    numbers += [[row["name"], row["kind"], *(_cell(row, name) for name in names)] for row in found["numbers"]]
    spans = {"as_given": "as given", **({"with_laws": "with the missing laws"} if found["laws"] else {})}
    refitted = {key: None if own is None else {"errors": own} for key, own in found["refitted"].items()}
    models = [*found["sets"], {"name": "fitted to the others", **refitted}]
    errors = [["errors left out", *spans.values()]]
    errors += [[one["name"], *(_errors(found, one[key]) for key in spans)] for one in models]
    return [
        *(*sentences(found), ""),
        *(*_in_columns(numbers), ""),
        # numbers that only show together share a sentence
        *dict.fromkeys(f"- {row['sentence']}" for row in found["numbers"] if row["kind"] != "known"),
        *("", *_in_columns(errors), ""),
        *(f"note: {note}" for note in found["notes"]),
    ]


def _in_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of cells as lines, each column as wide as its widest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{c:<{w}}" for c, w in zip(row, widths, strict=True)).rstrip() for row in rows]


def _cell(row: Content, name: str) -> str:
    own = row["sets"].get(name)
    return "" if own is None else f"{own['value']:.4g} {own['mark']}"


def _errors(found: Content, one: Content | None) -> str:
    if one is None or one["errors"] is None:
        return "diverges"
    return listed(_said_errors(found, one["errors"]))
