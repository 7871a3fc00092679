"""The tables of docs/head_to_head: from the rows of the runner to CSV files, and from these to the page."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.head_to_head.__main__ import METHODS, ROBOTS, rows
from unmodelled.diagnosis.data.gap import shrink

PAGE = Path(__file__).parents[2] / "docs" / "head_to_head"
MEASURED, VIRTUAL = "measured.csv", "virtual.csv"
#: Headings of the methods.
HEADINGS = {
    "file": "re-identified",
    "sysid": "mujoco.sysid",
    "sysid_joints": "mujoco.sysid, no stiffness",
    "sysid_links": "mujoco.sysid, links",
    "cma": "CMA-ES (PACE)",
    "pysindy": "PySINDy",
    "pyoperon": "pyoperon",
    "ours": "ours",
}
#: Methods of machines that are no robots.
COMMON = {name: heading for name, heading in HEADINGS.items() if name not in ROBOTS}
#: Methods that tune parameters and know no other effect.
TUNING = ("file", "sysid", "sysid_joints", "cma")
#: A tuned model hides an effect if it removes at least this share of the squared gap above the noise floor,
#: and a parameter that did not end at a bound is wrong by more than this share of its true value.
REMOVED, WRONG = 0.5, 0.1
#: Gaps are called the smallest up to this factor of the smallest one.
ALIKE = 1.01
#: Longest text of a cell.
LONGEST = 220
COLUMNS = [
    *("case", "method", "gap", "learned", "known", "floor", "mujoco", "mujoco_given", "cpu", "wall"),
    *("horizon", "held_out", "says", "budget", "versions", "revision", "error"),
]


def measured_table(found: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Return a row per published machine and method, from the rows of the runner."""
    lines = [_line(row) for row in found if not row["case"].startswith("virtual/")]
    return pd.DataFrame(lines, columns=COLUMNS)


def virtual_table(found: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Return a row per virtual machine and method, with the planted effect and what the method makes of it.

    It has the columns of the measured table and planted; expressible (whether the planted effect is among the
    numbers that a tuning method fits); named (whether the method names the planted effect or lists it as
    indistinguishable); given_error and parameter_error (largest error of the uncertain parameters, as a
    share of the true value, before and after the fit); hides.
    """
    lines = []
    for row in found:
        if not row["case"].startswith("virtual/"):
            continue
        line = _line(row)
        if not row["error"]:
            planted = [tuple(effect) for effect in row["planted"]]
            listed = {tuple(effect) for effect in (*row["named"], *row["alike"])}
            known = all(effect in listed for effect in planted)
            tuned = row["method"] in TUNING
            error = max(row["parameter_errors"].values(), default=float("nan"))
            wrong = {n for n, off in row["parameter_errors"].items() if off > WRONG}
            plausible = wrong - {*row["at_bound"]}
            removed = shrink(row["known"], row["gap"], row["floor"])
            line |= {
                "planted": "; ".join(" at ".join(effect) for effect in planted),
                "expressible": known if tuned else None,
                "named": known if row["method"] == "ours" else None,
                "given_error": max(row["given_errors"].values(), default=float("nan")),
                "parameter_error": error,
                "hides": bool(not known and removed >= REMOVED and plausible) if tuned else None,
            }
        lines.append(line)
    more = ["planted", "expressible", "named", "given_error", "parameter_error", "hides"]
    return pd.DataFrame(lines, columns=[*COLUMNS, *more])


def _line(row: Mapping[str, Any]) -> dict[str, Any]:
    line = {name: row.get(name) for name in COLUMNS}
    line["held_out"] = " ".join(row["held_out"])
    line["versions"] = " ".join(f"{name} {number}" for name, number in (row.get("versions") or {}).items())
    return line


def gaps(table: pd.DataFrame) -> str:
    """Return the gaps of all methods as a table in Markdown, the smallest within 1 % in bold."""
    return _smallest(table, "machine", "gap", {"as given": "known", "noise floor": "floor"}, COMMON)


def in_mujoco(table: pd.DataFrame) -> str:
    """Return the gaps in MuJoCo of machines that are robots as a table in Markdown."""
    some = table[table["mujoco"].notna()]
    return _smallest(some, "robot", "mujoco", {"as given": "mujoco_given"}, HEADINGS)


def _smallest(
    table: pd.DataFrame, machine: str, column: str, beside: Mapping[str, str], methods: Mapping[str, str]
) -> str:
    """A row per machine: columns that are the same for all methods, and a column of every method."""
    lines = [[machine, *beside, *methods.values()]]
    for case, group in table.groupby("case", sort=False):
        each, first = group.set_index("method"), group.iloc[0]
        values = {name: _number(each, name, column) for name in methods}
        best = min((value for value in values.values() if value == value), default=float("nan"))
        cells = [_cell(each, name, value, value <= ALIKE * best) for name, value in values.items()]
        lines.append([_name(case, first), *(f"{first[known]:.3g}" for known in beside.values()), *cells])
    return _markdown(lines)


def seconds(table: pd.DataFrame) -> str:
    """Return the CPU seconds of all fits as a table in Markdown."""
    lines = [["machine", *COMMON.values()]]
    for case, group in table.groupby("case", sort=False):
        each = group.set_index("method")
        values = [_number(each, name, "cpu") for name in COMMON]
        lines.append([_name(case, group.iloc[0]), *("–" if v != v else f"{v:.0f}" for v in values)])
    return _markdown(lines)


def sayings(table: pd.DataFrame) -> str:
    """Return what every method says of every machine as a table in Markdown."""
    lines = [["machine", "method", "says"]]
    for _, row in table.iterrows():
        said = row["error"] or row["says"]
        said = said if len(said) <= LONGEST else f"{said[: LONGEST - 3]}..."
        lines.append([row["case"], HEADINGS[row["method"]], f"`{said.replace('|', '/')}`"])
    return _markdown(lines)


def errors(table: pd.DataFrame) -> str:
    """Return the largest parameter error of every method on virtual machines as a table in Markdown."""
    lines = [["case", "planted", "given", *COMMON.values(), "ours names it"]]
    for case, group in table.groupby("case", sort=False):
        each = group.set_index("method")
        cells = []
        for name in COMMON:
            value = _number(each, name, "parameter_error")
            hidden = name in each.index and str(each.loc[name, "hides"]) == "True"
            cells.append("–" if value != value else f"{100 * value:.0f} %" + (" (hides)" if hidden else ""))
        given = group["given_error"].dropna()
        named = str(each.loc["ours", "named"]) if "ours" in each.index else ""
        said = {"True": "yes", "False": "no"}.get(named, "–")
        planted = group["planted"].dropna()
        before = f"{100 * given.iloc[0]:.0f} %" if len(given) else "–"
        lines.append([case.split("/")[-1], planted.iloc[0] if len(planted) else "–", before, *cells, said])
    return _markdown(lines)


def counts(table: pd.DataFrame) -> str:
    """Return how often tuning methods hide an effect as a table in Markdown."""
    lines = [["method", "cases", "effect is no parameter of it", "hidden", "median of the largest error"]]
    for name in COMMON:
        mine = table[(table["method"] == name) & table["gap"].notna()]
        middle = f"{100 * mine['parameter_error'].astype(float).median():.0f} %" if len(mine) else "–"
        other = (mine["expressible"].astype(str) == "False").sum()
        hidden = (mine["hides"].astype(str) == "True").sum()
        found = [str(other), str(hidden)] if name in TUNING else ["–", "–"]
        lines.append([HEADINGS[name], str(len(mine)), *found, middle])
    return _markdown(lines)


#: Tables of the page by name: file and function.
TABLES: dict[str, tuple[str, Callable[[pd.DataFrame], str]]] = {
    "gaps": (MEASURED, gaps),
    "mujoco": (MEASURED, in_mujoco),
    "seconds": (MEASURED, seconds),
    "says": (MEASURED, sayings),
    "virtual": (VIRTUAL, gaps),
    "errors": (VIRTUAL, errors),
    "counts": (VIRTUAL, counts),
}


def filled(text: str, folder: Path) -> str:
    """Return a page with the tables of CSV files between its `<!-- table: NAME -->` and `<!-- end -->`."""
    read = {name: pd.read_csv(folder / name, keep_default_na=True) for name in (MEASURED, VIRTUAL)}
    for table in read.values():
        for column in ("error", "says", "budget"):
            table[column] = table[column].astype(object).fillna("")

    def made(match: re.Match[str]) -> str:
        file, write = TABLES[match[1]]
        return f"<!-- table: {match[1]} -->\n\n{write(read[file])}\n\n<!-- end -->"

    return re.sub(r"<!-- table: (\w+) -->.*?<!-- end -->", made, text, flags=re.S)


def _number(each: pd.DataFrame, name: str, column: str) -> float:
    return float(each.loc[name, column]) if name in each.index else float("nan")


def _cell(each: pd.DataFrame, name: str, value: float, best: bool) -> str:
    if value != value:
        return "failed" if name in each.index and each.loc[name, "error"] else "–"
    return f"**{value:.3g}**" if best else f"{value:.3g}"


def _name(case: str, row: pd.Series) -> str:
    planted = row.get("planted")
    return f"{case.split('/')[-1]}: {planted}" if isinstance(planted, str) else case


def _markdown(lines: Sequence[Sequence[str]]) -> str:
    head, *body = (f"| {' | '.join(line)} |" for line in lines)
    return "\n".join([head, "|" + "---|" * len(lines[0]), *body])


def main() -> None:
    """Write the CSV files and the tables of the page from a folder of rows."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.head_to_head.page", description=__doc__)
    parser.add_argument("rows", type=Path, help="folder of rows")
    found = rows(parser.parse_args().rows)
    order = list(METHODS)
    found.sort(key=lambda row: (row["case"], order.index(row["method"])))
    PAGE.mkdir(exist_ok=True)
    measured_table(found).to_csv(PAGE / MEASURED, index=False, float_format="%.5g", lineterminator="\n")
    virtual_table(found).to_csv(PAGE / VIRTUAL, index=False, float_format="%.5g", lineterminator="\n")
    page = PAGE / "README.md"
    page.write_text(filled(page.read_text(encoding="utf-8"), PAGE), encoding="utf-8")


if __name__ == "__main__":
    main()
