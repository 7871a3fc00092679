"""Results as a notebook shows them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

import pandas as pd


def shown(title: str, lines: Iterable[str], tables: Mapping[str, pd.DataFrame]) -> str:
    """Return a result as HTML: a heading, sentences, and tables with their captions."""
    parts = [f"<h4>{escape(title)}</h4>", *(f"<p>{escape(line)}</p>" for line in lines)]
    for caption, table in tables.items():
        if len(table):
            text = table.to_html(index=False, border=0, na_rep="–", float_format=lambda x: f"{x:.4g}")
            parts += [f"<p><b>{escape(caption)}</b></p>", text]
    return "\n".join(["<div>", *parts, "</div>"])
