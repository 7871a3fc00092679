"""Tables of an answer, from the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from unmodelled.base.sure_numbers import as_said
from unmodelled.base.wording import effect_name, effect_names

Content = Mapping[str, Any]

MODELS = ("known", "reidentified", "augmented", "neural", "floor", "persistence")


class ComparisonTable(pd.DataFrame):  # type: ignore[misc]  # pandas has no types
    """Data frame that prints with all of its rows and columns; a part of it is a plain one."""

    def __repr__(self) -> str:
        return str(self.to_string(index=False, float_format="{:.3g}".format))


def evidence_table(content: Content) -> pd.DataFrame:
    """Return the evidence of every refitted law, see `Answer.evidence`."""
    columns = ["horizon", "nats", "removed"]
    rows = [(effect_name(e), *(e[c] for c in columns)) for e in content.get("evidence", ())]
    return ComparisonTable(rows, columns=["law", *columns])


def gap_table(content: Content) -> pd.DataFrame:
    """Return model and gap, see `Answer.gaps`."""
    gap = content["gap"]
    return pd.DataFrame([(name, gap[name]) for name in MODELS], columns=["model", "gap"])


def unit_table(content: Content) -> pd.DataFrame:
    """Return the errors in units of the columns, see `Answer.units`."""
    errors = content["gap"]["units"]
    rows = [{"output": name, **as_said(entry)} for name, entry in errors.items()]
    numbers = ["known", "augmented", "known_whole_run", "augmented_whole_run"]
    table = pd.DataFrame(rows, columns=["output", "unit", *numbers])
    return table.astype(dict.fromkeys(numbers, float))


def parameter_table(content: Content) -> pd.DataFrame:
    """Return the refitted parameters, see `Answer.parameters`."""
    rows = [
        (name, e["unit"], e["known"], e["identified"], *e["interval"])
        for name, e in content["parameters"].items()
    ]
    return pd.DataFrame(rows, columns=["name", "unit", "known", "identified", "low", "high"])


def comparison_table(content: Content) -> pd.DataFrame:
    """Return the compared hypotheses, see `Answer.comparison`."""
    numbers = ["score", "difference", "standard_error", "named", "probability"]
    found = sorted(content["comparison"], key=lambda entry: entry["difference"])
    rows = [
        (rank, effect_names(entry["effects"]), *(entry.get(name) for name in numbers))
        for rank, entry in enumerate(found, start=1)
    ]
    return ComparisonTable(rows, columns=["rank", "hypothesis", *numbers])


def number_table(content: Content) -> pd.DataFrame:
    """Return the numbers of the effects, see `Answer.table`."""
    rows = [
        (
            *(effect_name(entry), entry["law"], name, number["value"], *number["interval"]),
            *(number["unit"], entry["confidence"], entry["shrink"]),
        )
        for entry in content["effects"]
        for name, number in entry["parameters"].items()
    ]
    columns = ["effect", "law", "parameter", "value", "low", "high", "unit", "confidence", "shrink"]
    return pd.DataFrame(rows, columns=columns)
