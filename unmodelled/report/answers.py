"""Answers of diagnoses found below a folder, each checked and ready to be listed and compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from unmodelled.base.answers import read_diagnosis
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput, printable
from unmodelled.base.search import Search
from unmodelled.base.sure_numbers import as_said, doubt, interval_of, main_number, remark
from unmodelled.base.tables import read_table
from unmodelled.base.wording import effect_name, place_name
from unmodelled.report.headline import fallen, headline, outcome, percent
from unmodelled.report.numbers import amounts, number, quantity, unit_text

Entry = Mapping[str, Any]

SUMMARY = "diagnosis.json"
#: What reading a table of another structure, or with numbers out of range, can raise.
UNLIKE = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError)
#: Verdicts of diagnosis.json in words.
VERDICTS = {
    "effect": "effect found",
    "main_effect": "main effect found",
    "no_gap": "no gap",
    "unknown": "unknown effect",
    "check_logs": "check the logs",
}


@dataclass(frozen=True)
class Compared:
    """A row of the comparison of two answers."""

    name: str  # with the unit; rows of equal names are compared
    text: str  # value, with its interval if there is one
    interval: tuple[float, float] | None = None  # 95 %, in the unit of the name


@dataclass(frozen=True)
class Error:
    """An error of experiments left out."""

    text: str  # of one output in its unit, or the gap in standard deviations
    note: str  # output, time since the start of the free run, and gap
    gap: float  # standard deviations of the outputs


@dataclass(frozen=True, eq=False)
class ListedAnswer:
    """Answer as a list of answers shows it."""

    folder: Path
    name: str  # path of the folder below the listed one
    system: str
    verdict: str  # as in diagnosis.json
    confidence: float  # 0 to 1
    sentence: str  # verdict with amounts
    effects: tuple[tuple[str, str], ...]  # in words, each with its main amount and 95 % interval
    place: str  # channel by which most of the gap enters, with its share; empty if there is none
    before: Error  # of the system file as given
    after: Error | None  # with effects and refitted parameters; None: nothing was fitted
    written: datetime  # time of the diagnosis; where it says none, of the last change of diagnosis.json
    rows: tuple[Compared, ...]  # of a comparison with another answer

    def residual(self) -> tuple[Array, Array] | None:
        """Return residuals (intervals,) over the time of the experiments, before and after."""
        try:
            table = read_table(self.folder / "tables" / "time", ("over",))
            rows = table[table["over"] == "experiment"]
            before, after = (rows[name].to_numpy(dtype=float) for name in ("reidentified", "augmented"))
        except (BadInput, ModuleNotFoundError, *UNLIKE):
            return None
        return (before, after) if len(rows) > 1 and np.isfinite([before, after]).all() else None


def find_answers(folder: Path) -> tuple[list[ListedAnswer], list[str]]:
    """Find the answers below a folder, in alphabetical order; hidden folders and links are left out."""
    if not folder.is_dir():
        raise BadInput(f"{folder}: is no folder: give the folder that holds the answers of `diagnose`")
    found: list[ListedAnswer] = []
    notes: list[str] = []
    for place in _folders(folder):
        try:
            found.append(_read(place, folder))
        except BadInput as fault:
            notes.append(str(fault))
    if not found:
        raise BadInput(
            f"{folder}: holds no answer: give the folder that holds the results of `diagnose`", notes
        )
    return found, notes


def _folders(folder: Path) -> list[Path]:
    search = Search(lambda why: BadInput(f"{folder}: {why}: give the folder that holds the answers"))
    return sorted(path.parent for path in search.below(folder, hidden=False) if path.name == SUMMARY)


def _read(folder: Path, listed: Path) -> ListedAnswer:
    content, name = read_diagnosis(folder / SUMMARY), printable(folder.relative_to(listed).as_posix())
    verdict, gap = content["verdict"], content["gap"]
    fitted = verdict != "check_logs"
    channels = content["where"]["channels"][:1]
    return ListedAnswer(
        folder,
        name,
        content["system"],
        verdict,
        float(content["confidence"]),
        outcome(content),
        tuple((effect_name(effect), _main_amount(effect)) for effect in content["effects"]),
        "".join(f"{place_name(str(row['port']))}, {percent(row['share'])}" for row in channels),
        _error(content, "known"),
        _error(content, "augmented") if fitted else None,
        _made(content, folder / SUMMARY),
        (Compared("verdict", headline(content)), *_errors(gap, fitted), *_numbers(content)),
    )


def _made(content: Entry, file: Path) -> datetime:
    kept = content.get("sources")
    try:
        return datetime.fromisoformat(str(kept["made"])).astimezone(UTC) if kept else _changed(file)
    except (LookupError, TypeError, ValueError):
        return _changed(file)


def _changed(file: Path) -> datetime:
    return datetime.fromtimestamp(file.stat().st_mtime, UTC)


def _main_amount(effect: Entry) -> str:
    if unsure := doubt(effect):
        return unsure
    if effect.get("text"):
        return str(effect["text"])
    entry = main_number(effect) or next(map(as_said, effect["parameters"].values()), None)
    return _amount(entry) if entry else ""


def _amount(entry: Entry, value: str = "value") -> str:
    """A number with its unit and interval, such as 6.2 N (5.8 to 6.6)."""
    text, interval = quantity(entry[value], interval_of(entry))
    many = f"; one for each of {len(entry['values'])} experiments" if "values" in entry else ""
    unsure = f"; {doubts}" if (doubts := remark(entry)) else ""
    about = f"{interval}{many}{unsure}".removeprefix("; ")
    return f"{text} {unit_text(entry.get('unit'))}".strip() + (f" ({about})" if about else "")


def _error(content: Entry, model: str) -> Error:
    """Error of the output whose error falls, else of the first one; without units, the gap."""
    gap = content["gap"]
    deviations = f"{number(float(f'{gap[model]:.3g}'))} s.d."
    every = [(name, as_said(entry)) for name, entry in gap.get("units", {}).items()]
    for name, entry in [*fallen(content), *every][:1]:
        text = "diverges" if entry[model] is None else amounts([entry[model]], entry["unit"])[0]
        late = f" after {amounts([gap['horizon']], 's')[0]}" if "horizon" in gap else ""
        return Error(text, f"{name}{late}; {deviations}", float(gap[model]))
    return Error(deviations, "", float(gap[model]))


def _errors(gap: Entry, fitted: bool) -> Iterator[Compared]:
    """Errors of every output before and after, and the gap."""
    for span, key in (("after the horizon", ""), ("over whole runs", "_whole_run")):
        for name, given in gap.get("units", {}).items():
            entry = as_said(given)
            values = [entry[f"{model}{key}"] for model in ("known", "augmented")[: 1 + fitted]]
            shown = ["diverges" if v is None else amounts([v], entry["unit"])[0] for v in values]
            yield Compared(f"error of {name} {span}", " → ".join(shown))
    gaps = [number(float(f"{gap[model]:.3g}")) for model in ("known", "augmented")[: 1 + fitted]]
    yield Compared("gap (standard deviations)", " → ".join(gaps))


def _numbers(content: Entry) -> Iterator[Compared]:
    """Effects with their shares and numbers, then the refitted parameters."""
    for effect in content["effects"]:
        name = effect_name(effect)
        yield Compared(name, f"explains {percent(effect['shrink'])} of the gap")
        for key, given in effect["parameters"].items():
            entry = as_said(given)
            interval = None if "values" in entry else interval_of(entry)
            symbol = entry.get("symbol", key)
            yield Compared(_with_unit(f"{symbol} of {name}", entry), _amount(entry), interval)
    for key, entry in content["parameters"].items():
        yield Compared(
            _with_unit(f"parameter {key}", entry), _amount(entry, "identified"), interval_of(entry)
        )


def _with_unit(name: str, entry: Entry) -> str:
    unit = unit_text(entry.get("unit"))
    return f"{name} ({unit})" if unit else name


def table_lines(answers: Sequence[ListedAnswer]) -> list[str]:
    """Return the list as aligned lines: answer, verdict, error before, after, effects."""
    rows = [("answer", "verdict", "error before", "after", "missing effects")]
    for one in answers:
        effects = "; ".join(f"{name}: {amount}".removesuffix(": ") for name, amount in one.effects)
        after = one.after.text if one.after else "–"
        rows.append((one.name, VERDICTS[one.verdict], one.before.text, after, effects or "–"))
    widths = [max(len(row[k]) for row in rows) for k in range(5)]
    return ["  ".join(text.ljust(w) for text, w in zip(row, widths, strict=True)).rstrip() for row in rows]
