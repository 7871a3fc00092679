"""Tables of the rows of one entrant, or of two side by side, and the page with every case.

python -m benchmarks.withheld.table ENTRANT [ENTRANT] out=FOLDER
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from scipy.stats import binomtest

from benchmarks.withheld.score import share, summary
from pipeline.withheld.judging import NAMING
from unmodelled.base.answers import printable_content
from unmodelled.base.errors import BadInput, printable
from unmodelled.base.files import read_json
from unmodelled.report.rendering import policy, templates

Row = Mapping[str, Any]
Rows = Mapping[str, Row]

KINDS = (
    *("single", "null", "pair", "several", "outside", "number", "wrong_logs", "twin"),
    *("real", "archive", "field"),
)
HERE = Path(__file__).parent
#: What is counted, and its heading.
COUNTED = {
    "first": "named first",
    "in_set": "in the set",
    "exact": "exact",
    "right": "right",
    "harmful": "harmful",
}
#: Entries of a row that make two answers differ.
SAID = ("verdict", "effects")


def rows_of(out: Path, name: str) -> Path:
    """Return the folder of the rows of an entrant in the folder of the benchmark."""
    return out / "rows" / name


def read_rows(folder: Path) -> dict[str, Row]:
    """Return the rows of a folder by case; the folder may be missing."""
    return {
        printable(path.stem): printable_content(read_json(path)) for path in sorted(folder.glob("*.json"))
    }


def write_page(forms: Mapping[str, Rows], out: Path) -> None:
    """Write index.html: rates of every entrant, rates by kind, and every case with links to its files."""
    every = {name: [*rows.values()] for name, rows in forms.items()}
    each = [summary(rows) for rows in every.values()]
    rates = [[lines[0][0], *(line[1] for line in lines)] for lines in zip(*each, strict=True)]
    rates[0] = ["measure", *(f"{name}, {len(rows)} cases" for name, rows in forms.items())]
    text = (
        templates(HERE)
        .get_template("withheld.html.j2")
        .render(
            policy=policy([]),
            tables={"": rates, "By kind of case": [*_counts(every)], "Cost": [*_costs(every)]},
            cases={name: [_linked(row, name) for row in rows] for name, rows in every.items()},
        )
    )
    (out / "index.html").write_text(text)


def _linked(row: Row, name: str) -> tuple[str, dict[str, str]]:
    """Whether the answer of a case is right, and its texts by the addresses of its files."""
    case, right = row["case"], row.get("right")
    cells = {
        f"cases/{case}": case,
        f"truth/{case}/truth.json": row["truth"],
        f"answers/{name}/{case}/answer.json": _answer(row),
    }
    mark = "" if right is None else "right" if right else "wrong"
    return mark, {quote(address): text for address, text in cells.items()}


def page(forms: Mapping[str, Rows]) -> str:
    """Return all tables of one or two forms as Markdown: counts by kind, cost, paired differences, changes.

    Only cases that every form has are compared.
    """
    shared = [case for case in next(iter(forms.values())) if all(case in rows for rows in forms.values())]
    changed = [case for case in shared if len({rows[case]["digest"] for rows in forms.values()}) > 1]
    shared = [case for case in shared if case not in changed]
    compared = {name: [rows[case] for case in shared] for name, rows in forms.items()}
    lines = [f"# {' and '.join(forms)}: {len(shared)} cases", ""]
    revisions = {name: sorted({row["revision"] for row in rows}) for name, rows in compared.items()}
    lines += [f"- {name}: revision {_cell(', '.join(each))}" for name, each in revisions.items()]
    lines += [f"- left out, because their files differ: {_cell(', '.join(changed))}"] if changed else []
    lines += ["", "## Answers by kind", "", *_table(_counts(compared))]
    lines += ["", "## Cost", "", *_table(_costs(compared))]
    if len(compared) == 2:
        pairs = list(zip(*compared.values(), strict=True))
        lines += ["", "## Paired differences", "", *_table(_paired(pairs, list(compared)))]
        lines += ["", "## Cases whose answers differ", "", *_table(_different(pairs, list(compared)))]
    return "\n".join(lines) + "\n"


def _counts(forms: Mapping[str, Sequence[Row]]) -> Iterator[list[str]]:
    """Shares of all cases to which a question applies; without an answer, nothing is named."""
    more = "effects named", "alone first", "alone in 3", "unanswered"
    yield ["kind", "entrant", "cases", *COUNTED.values(), *more]
    for kind in (*KINDS, "all"):
        for name, every in forms.items():
            rows = [row for row in every if kind in (row["kind"], "all")]
            if rows:
                counts = [_share([_value(row, key) for row in rows]) for key in COUNTED]
                named = ((row.get("material_named", 0), row.get("material", 0)) for row in rows)
                counts += [_share([k < found for found, every in named for k in range(every)])]
                ranks = [rank for row in rows for rank in _ranks(row)]
                counts += [_share([rank is not None and rank <= most for rank in ranks]) for most in (1, 3)]
                yield [kind, name, str(len(rows)), *counts, str(sum(bool(row["error"]) for row in rows))]


def _value(row: Row, key: str) -> bool | None:
    """One answer of a row; None where the question does not apply."""
    found = row.get(key)
    return None if found is None else bool(found)


def _ranks(row: Row) -> Sequence[int | None]:
    """Ranks of the true laws alone that are large enough to be seen; None: not compared, or no answer."""
    if row["error"]:
        return [None] if row["kind"] == "single" else []
    ranks: Sequence[int | None] = row.get("rank", [])
    if row["kind"] == "outside" or not ranks:  # only a diagnosis compares models
        return []
    return [rank for rank, seen in zip(ranks, row.get("seen", [True] * len(ranks)), strict=True) if seen]


def _share(values: Sequence[bool | None]) -> str:
    return share([value for value in values if value is not None])


def _costs(forms: Mapping[str, Sequence[Row]]) -> Iterator[list[str]]:
    yield ["entrant", "CPU s, median", "CPU s, largest", "CPU s, sum", "wall s, median", "memory MB, largest"]
    for name, rows in forms.items():
        if rows:
            cpu, wall, memory = (np.array([row[key] for row in rows]) for key in ("cpu", "wall", "memory"))
            numbers = np.median(cpu), cpu.max(), cpu.sum(), np.median(wall), memory.max()
            yield [name, *(f"{number:.3g}" if number < 100 else f"{number:.0f}" for number in numbers)]


def _paired(pairs: Sequence[tuple[Row, Row]], names: Sequence[str]) -> Iterator[list[str]]:
    """McNemar's counts; the chance is that of a split at least as uneven if both forms are as good."""
    yield ["question", "both", f"only {names[0]}", f"only {names[1]}", "neither", "chance (two-sided)"]
    for key, heading in COUNTED.items():
        values = [(_value(a, key), _value(b, key)) for a, b in pairs]
        known = [pair for pair in values if None not in pair]
        one, other = known.count((True, False)), known.count((False, True))
        chance = binomtest(one, one + other).pvalue if one + other else 1.0
        same = known.count((True, True)), known.count((False, False))
        yield [heading, str(same[0]), str(one), str(other), str(same[1]), f"{chance:.2g}"]


def _different(pairs: Sequence[tuple[Row, Row]], names: Sequence[str]) -> Iterator[list[str]]:
    yield ["case", "truth", *(f"{name} says" for name in names), *names]
    for pair in pairs:
        if pair[0]["error"] != pair[1]["error"] or any(pair[0].get(k) != pair[1].get(k) for k in SAID):
            truth = next((row["truth"] for row in pair if row["truth"]), "")
            yield [pair[0]["case"], truth[:200], *map(_answer, pair), *map(_marks, pair)]


def _answer(row: Row) -> str:
    if row["error"]:
        return str(row["error"])
    chain = "parts of the measurement chain" if row["verdict"] in NAMING else ""
    said = chain if row["said"] == row["verdict"] else row["said"]
    return f"{row['verdict']}: {said}" if said else str(row["verdict"])


def _marks(row: Row) -> str:
    found = [heading for key, heading in COUNTED.items() if _value(row, key)]
    return ", ".join([*found, f"{row['cpu']:.0f} s"])


def _table(rows: Iterator[list[str]]) -> list[str]:
    lines = ["| " + " | ".join(map(_cell, row)) + " |" for row in rows]
    return [lines[0], "|" + "---|" * (lines[0].count("|") - 1), *lines[1:]]


def _cell(text: str) -> str:
    """A text that Markdown shows as it is: neither a column, nor a link, nor HTML."""
    return escape(text.replace("|", "/"), quote=False).replace("[", "&#91;")


def main(words: Sequence[str]) -> None:
    """Write index.html of entrants, and the tables of the first two to compare_<names>.md; print these."""
    given = dict(word.partition("=")[::2] for word in words if "=" in word)
    names = [word for word in words if "=" not in word]
    if {*given} != {"out"} or not names:
        raise BadInput("words: give names of entrants and out=FOLDER")
    out = Path(given["out"]).resolve()
    forms = {name: read_rows(rows_of(out, name)) for name in names}
    if missing := [name for name, rows in forms.items() if not rows]:
        raise BadInput(f"{rows_of(out, missing[0])}: holds no row; run this entrant first")
    write_page(forms, out)
    text = page({name: forms[name] for name in names[:2]})
    (out / f"compare_{'_'.join(names[:2])}.md").write_text(text)
    print(text + f"open file://{out / 'index.html'}")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except BadInput as fault:
        print(fault, file=sys.stderr)
        sys.exit(2)
