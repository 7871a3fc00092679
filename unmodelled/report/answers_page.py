"""The page that lists answers: one file to filter, sort and compare them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from unmodelled.base.files import replacing
from unmodelled.report.answers import VERDICTS, ListedAnswer
from unmodelled.report.diagnosis_page import PAGE
from unmodelled.report.headline import percent
from unmodelled.report.rendering import check_own_page, one_file
from unmodelled.report.search import as_block, entry

#: What the page says of itself in its head, so that no other index.html is taken for an earlier one.
GENERATOR = '<meta name="generator" content="unmodelled report">'
#: Classes of the style sheet by verdict.
KINDS = {
    "effect": "holds",
    "main_effect": "direction",
    "no_gap": "untestable",
    "unknown": "few",
    "check_logs": "fails",
}
#: Width and height of a sparkline, and its margin, px.
WIDE, HIGH, MARGIN = 120, 34, 3


def write_answers_page(answers: Sequence[ListedAnswer], notes: Sequence[str], title: str, out: Path) -> None:
    """Write index.html, a list of answers with links to their pages.

    The page contains its style and its scripts. Its content security policy allows these scripts by their
    digests only: names and numbers of the answers are data.
    """
    file = out / PAGE
    check_own_page(file, GENERATOR, "report")
    verdicts = [one.verdict for one in answers]
    text = one_file(
        "answers.html.j2",
        ("report", "answers"),
        title=title,
        rows=[_row(one, out, k) for k, one in enumerate(answers)],
        tiles=[(verdicts.count(v), VERDICTS[v], kind) for v, kind in KINDS.items() if v in verdicts],
        notes=notes,
        generator=GENERATOR,
        search=as_block(
            [entry("diagnosis", one.name, one.sentence, f"#answer-{k}") for k, one in enumerate(answers)]
        ),
        compared=as_block([{"name": one.name, "rows": [*map(asdict, one.rows)]} for one in answers]),
    )
    with replacing(file) as temporary:
        temporary.write_text(text)


def _row(one: ListedAnswer, out: Path, number: int) -> dict[str, Any]:
    page = one.folder / PAGE
    address = Path(os.path.relpath(page.resolve(), out.resolve())).as_posix()
    return {
        "number": number,
        "answer": one,
        "link": quote(os.fsencode(address)) if page.exists() else "",
        "verdict": VERDICTS[one.verdict],
        "kind": KINDS[one.verdict],
        "confidence": percent(one.confidence),
        "spark": _sparkline(one),
    }


def _sparkline(one: ListedAnswer) -> Markup:
    """Residuals over the time of the experiments as an SVG; empty where they are unknown."""
    found = one.residual()
    if found is None:
        return Markup("")
    top = max(float(np.max(found)), 1e-300)

    def line(values: Any, kind: str) -> Markup:
        x = np.linspace(MARGIN, WIDE - MARGIN, len(values))
        y = HIGH - MARGIN - (HIGH - 2 * MARGIN) * values / top
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        return Markup('<polyline class="{}" points="{}"/>').format(kind, points)

    said = "Residual over the time of the experiments, root mean square {:.2g} before and {:.2g} after"
    means = [float(np.sqrt(np.mean(values**2))) for values in found]
    return Markup(
        '<svg class="spark" role="img" aria-label="{}" viewBox="0 0 {} {}" width="{}" height="{}">{}{}</svg>'
    ).format(said.format(*means), *(WIDE, HIGH) * 2, line(found[0], "before"), line(found[1], "after"))
