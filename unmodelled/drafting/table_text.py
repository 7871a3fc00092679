"""The table of the columns of logs, and what they look like."""

from __future__ import annotations

from unmodelled.base.errors import printable
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.draft import Draft
from unmodelled.drafting.names import Role

#: Rows of the table.
ROWS = 40


def table_text(draft: Draft) -> str:
    """Return a table with a row per column: samples, rate, range, unit, and what it looks like."""
    found: dict[str, list[Signal]] = {}
    for signals in draft.experiments:
        for signal in signals:
            found.setdefault(signal.address, []).append(signal)
    used = _used(draft)
    rows: list[tuple[str, ...]] = [("column", "rate", "from", "to", "unit", "looks like")]
    for address in sorted(found, key=lambda each: each not in used):
        parts = found[address]
        low, high = min(p.values.min() for p in parts), max(p.values.max() for p in parts)
        unit, likeness = used.get(address) or (parts[0].unit or "?", _unused(parts[0].role))
        rows.append(
            (
                printable(address),
                f"{parts[0].rate:.4g} Hz",
                f"{low:.4g}",
                f"{high:.4g}",
                printable(unit),
                likeness,
            )
        )
    shown = rows[: ROWS + 1]
    widths = [max(len(row[j]) for row in shown) for j in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in shown]
    more = [f"and {len(rows) - len(shown)} more columns"] if len(rows) > len(shown) else []
    return "\n".join([*lines, *more])


def _used(draft: Draft) -> dict[str, tuple[str, str]]:
    """Unit, symbol and kind of every column that is used."""
    return {
        each.channel.signal.address: (
            each.channel.signal.unit or each.channel.unit,
            f"{each.symbol}, {each.kind}",
        )
        for each in draft.used
    }


def _unused(role: Role | None) -> str:
    return Role.OTHER.value if role is None else f"{role.value}, {Role.OTHER.value}"
