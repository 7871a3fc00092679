"""Claims, metrics, runs and CSV files as one kind of table: what is shown, and all digits beside it."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

#: The four verdicts on a claim, and the name of their colour in the style sheet.
VERDICTS = {
    "holds": "holds",
    "holds in direction": "direction",
    "does not hold": "fails",
    "cannot be tested on these data": "untestable",
}

#: Keys of a metrics file that describe the file; everything else holds numbers.
ABOUT = ("data", "profile", "revision", "seconds", "protocol", "chapter")

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Cell:
    """What a cell shows, what it is sorted by and saved as, its style, and a second line under it."""

    text: str
    exact: str
    kind: str = ""
    link: str = ""
    note: str = ""


@dataclass(frozen=True)
class Table:
    """A table as the pages show it; `numeric` columns stand right, `notes` heads second lines in a column."""

    id: str
    title: str
    columns: tuple[str, ...]
    numeric: tuple[bool, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    protocol: str = ""
    chapter: int | None = None
    data: str = ""
    anchors: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def csv(self) -> str:
        """All digits, for download."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        noted = [i for i, name in enumerate(self.notes) if name]
        writer.writerow([*self.columns, *(self.notes[i] for i in noted)])
        writer.writerows([*(cell.exact for cell in row), *(row[i].note for i in noted)] for row in self.rows)
        return text.getvalue()


def number(value: Any) -> str:
    """Four significant digits; whole numbers in full."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    size = abs(value)
    if isinstance(value, int) or 1e4 <= size < 1e7:
        text = f"{value:,.0f}".replace(",", "\u202f" if size >= 1e4 else "")
    elif size and not 1e-4 <= size < 1e7:
        mantissa, exponent = f"{value:.2e}".split("e")
        text = f"{mantissa}×10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    else:
        text = f"{value:.4g}"
    return text.replace("-", "−")


def quantity(value: Any, interval: list[float] | None) -> tuple[str, str]:
    """Value and interval, to the two digits that the width of the interval supports."""
    if interval is None:
        return number(value), ""
    low, high = interval
    large = max(abs(low), abs(high), abs(value)) if isinstance(value, int | float) else math.inf
    if not (low < high and 1e-3 <= large < 1e6):
        return number(value), f"{number(low)} to {number(high)}"
    digits = max(0, 1 - math.floor(math.log10(high - low)))
    shown = [f"{v:.{digits}f}".replace("-", "−") for v in (value, low, high)]
    return shown[0], f"{shown[1]} to {shown[2]}"


def claims_table(id: str, claims: list[dict[str, Any]]) -> Table:
    """One row per claim; what the data were comes last."""
    columns = ("Claim", "Dissertation", "Ours", "Verdict", "Source", "Data")
    notes = ("Protocol", "", "Unit and 95 % interval", "", "", "")
    rows = []
    for row in claims:
        value, interval = quantity(row["ours"], row["interval"])
        unit = _unit(row["unit"])
        # a long unit would push the verdict out of sight
        beside, below = (f" {unit}", "") if unit and len(unit) < 10 else ("", unit)
        page = f"p.\u00a0{row['page']}" if str(row["page"]).isdigit() else str(row["page"])
        theirs, ours = row["dissertation"], row["ours"]
        cells = (
            Cell(
                row["claim"],
                row["claim"],
                "claim",
                f"chapter_{row['chapter']}.html#claim-{row['id']}",
                row["protocol"] or "",
            ),
            Cell(number(theirs) + (beside if isinstance(theirs, int | float) else ""), _exact(theirs)),
            Cell(
                value + (beside if ours is not None else ""),
                _exact(ours),
                # a number stays on one line, a comparison in words may wrap
                "" if isinstance(ours, str) else "figure",
                note=", ".join(filter(None, (below, interval))),
            ),
            Cell(row["verdict"], row["verdict"], f"verdict {VERDICTS[row['verdict']]}"),
            Cell(f"Ch.\u00a0{row['chapter']}, {page}", f"chapter {row['chapter']}, {row['page']}", "source"),
            Cell(row["data"], row["data"], f"origin {row['data']}"),
        )
        rows.append(cells)
    anchors = tuple(f"claim-{row['id']}" for row in claims)
    return Table(
        id, "Claims of the dissertation", columns, (False,) * 6, tuple(rows), anchors=anchors, notes=notes
    )


def metrics_table(topic: str, content: dict[str, Any]) -> Table:
    """Flatten nested numbers; a protocol that all of them share stands above the table."""
    columns = ("Metric", "Value", "95 % interval", "Unit", "n", "Protocol")
    general = content.get("protocol", "")
    rows = []
    for name, leaf, protocol in leaves({k: v for k, v in content.items() if k not in ABOUT}, general):
        value, interval = quantity(leaf["value"], leaf.get("interval"))
        cells = (
            Cell(" · ".join(name), ".".join(name), "metric"),
            Cell(value, _exact(leaf["value"]), "figure"),
            Cell(interval or "–", " to ".join(map(str, leaf.get("interval") or []))),
            Cell(_unit(leaf.get("unit")) or "–", _unit(leaf.get("unit"))),
            Cell(number(leaf.get("n")), _exact(leaf.get("n"))),
            Cell(protocol or "–", protocol, "small"),
        )
        rows.append(cells)
    used = len(columns) if any(row[-1].exact != general for row in rows) else len(columns) - 1
    about = [content.get("profile") and f"profile {content['profile']}"]
    about += [content.get("revision") and f"revision {content['revision']}"]
    about += [f"{number(content['seconds'])} s" if content.get("seconds") is not None else None]
    return Table(
        f"metrics-{topic}",
        topic,
        columns[:used],
        (False, True, False, False, True, False)[:used],
        tuple(row[:used] for row in rows),
        ", ".join(str(part) for part in about if part),
        general,
        data=content.get("data") or "",
    )


def leaves(
    content: Any, protocol: str, name: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any, str]]:
    """Name, leaf and protocol of every number; a bare number or word counts as a leaf without a unit."""
    if not isinstance(content, dict):
        yield name, {"value": content}, protocol
    elif "value" in content:
        yield name, content, content.get("protocol", protocol)
    else:
        inner = content.get("protocol", protocol)
        for key in content:
            if key != "protocol":
                yield from leaves(content[key], inner, (*name, key))


def runs_table(runs: dict[str, dict[str, Any]]) -> Table:
    """One row per fit; the folders above it name the choices in conf/ that it was made with."""
    columns = ("Mechanism", "Model", "Split", "Folds", "Repeats", "Seed", "Seconds", "Parameters")
    rows = []
    for path, about in runs.items():
        choices = [*path.split("/"), "", "", ""][:3]
        folds = about.get("folds")
        values = [len(folds) if isinstance(folds, list) else folds]
        values += [about.get(key) for key in ("repeats", "seed", "seconds", "parameters")]
        rows.append(
            tuple([Cell(c or "–", c) for c in choices] + [Cell(number(v), _exact(v)) for v in values])
        )
    return Table("runs", "Fitted models", columns, (*(False,) * 3, *(True,) * 5), tuple(rows))


def file_table(name: str, text: str, about: dict[str, Any]) -> Table:
    """A CSV file; a column is numeric when every filled cell of it is."""
    columns, *rows = list(csv.reader(io.StringIO(text)))
    numbers = [[_parsed(cell) for cell in row] for row in rows]
    cells = [
        tuple(Cell(text if v is None else number(v), text) for text, v in zip(row, values, strict=True))
        for row, values in zip(rows, numbers, strict=True)
    ]
    numeric = tuple(
        all(row[i].exact == "" or values[i] is not None for row, values in zip(cells, numbers, strict=True))
        for i in range(len(columns))
    )
    title, caption, protocol = (about.get(key) or "" for key in ("title", "caption", "protocol"))
    chapter = about.get("chapter")
    data = about.get("data") or ""
    caption = "" if caption == title else caption
    return Table(name, title or name, tuple(columns), numeric, tuple(cells), caption, protocol, chapter, data)


def _parsed(text: str) -> float | int | None:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return None


def _unit(unit: str | None) -> str:
    return "" if unit in (None, "-", "1") else str(unit)


def _exact(value: Any) -> str:
    return "" if value is None else str(value)
