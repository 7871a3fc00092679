"""The page of a result: one file with its tables, its figures and, where there is one, the machine itself."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from unmodelled.base.files import replacing
from unmodelled.report.diagnosis_page import PAGE, short, with_scales
from unmodelled.report.machine_drawing import machine_drawing
from unmodelled.report.rendering import one_file
from unmodelled.report.search import as_block, table_entries
from unmodelled.report.tables import Table

#: What a drawing marks: nothing is missing anywhere.
_NOTHING: Mapping[str, Any] = {"effects": [], "where": {"channels": []}}


def write_result_page(
    folder: Path,
    template: str,
    tables: Sequence[Table],
    figures: Mapping[str, bytes],
    live: Mapping[str, Any] | None,
    machine: Mapping[str, Any] | None,
    **values: Any,
) -> None:
    """Write index.html, a page that nothing comes into from outside."""
    text = one_file(
        template,
        live="" if live is None else as_block(with_scales(live)),
        drawing="" if machine is None else machine_drawing(_NOTHING, machine),
        tables=[(table, _encoded(table.csv.encode())) for table in tables],
        figures={name: _encoded(file) for name, file in figures.items()},
        search=as_block(table_entries(tables, "")),
        short=short,
        **values,
    )
    with replacing(folder / PAGE) as temporary:
        temporary.write_text(text)


def _encoded(file: bytes) -> str:
    return base64.b64encode(file).decode()
