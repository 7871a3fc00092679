"""Convert the nested numbers of a metrics file to a table."""

import re
from collections.abc import Iterator
from typing import Any

from unmodelled.report.numbers import number, quantity, unit_text
from unmodelled.report.tables import Cell, Table, exact

#: Keys of a metrics file that describe the file; everything else holds numbers.
ABOUT = ("data", "profile", "revision", "protocol", "chapter")

COLUMNS = ("Metric", "Value", "95 % interval", "Unit", "n", "Protocol")


def metrics_table(id: str, content: dict[str, Any]) -> Table:
    """Convert nested numbers to a table; a protocol of all numbers is written above the table."""
    general = content.get("protocol", "")
    rows = []
    for name, leaf, protocol in leaves({k: v for k, v in content.items() if k not in ABOUT}, general):
        value, interval = quantity(leaf["value"], leaf.get("interval"))
        cells = (
            Cell(" · ".join(name), ".".join(name), "metric", note="\n".join(leaf.get("text", ()))),
            # a short value stays on one line
            Cell(value, exact(leaf["value"]), "figure" if len(str(leaf["value"])) < 25 else "words"),
            Cell(interval or "–", " to ".join(map(str, leaf.get("interval") or [])), "nowrap"),
            Cell(unit_text(leaf.get("unit")) or "–", leaf.get("unit") or ""),
            Cell(number(leaf.get("n")), exact(leaf.get("n"))),
            Cell(protocol or "–", protocol, "small"),
        )
        rows.append(cells)
    used = len(COLUMNS) if any(row[-1].exact != general for row in rows) else len(COLUMNS) - 1
    return Table(
        id,
        _title(id.removeprefix("metrics-")),
        COLUMNS[:used],
        (False, True, False, False, True, False)[:used],
        tuple(row[:used] for row in rows),
        _about(content),
        general,
        data=content.get("data") or "",
    )


def _title(topic: str) -> str:
    words = re.sub(r"([a-z])(\d)", r"\1 \2", topic.replace("_", " "))
    return f"Numbers: {words.replace('-', ', ')}"


def _about(content: dict[str, Any]) -> str:
    parts = [f"{key} {content[key]}" for key in ("profile", "revision") if content.get(key, "-") != "-"]
    return ", ".join(parts)


def leaves(
    content: Any, protocol: str, name: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any, str]]:
    """Yield name, number and protocol of every number; a plain number or word has no unit."""
    if not isinstance(content, dict):
        yield name, {"value": content}, protocol
    elif "value" in content:
        yield name, content, content.get("protocol", protocol)
    else:
        inner = content.get("protocol", protocol)
        for key in content:
            if key != "protocol":
                yield from leaves(content[key], inner, (*name, key))
