"""Topics that a chapter of the dissertation names, with the results of this project on each of them."""

from dataclasses import dataclass, replace
from typing import Any

from pipeline.report.claims import claims_table, short
from pipeline.report.metrics import metrics_table
from pipeline.report.results import Results
from unmodelled.report.tables import Table


@dataclass(frozen=True)
class Topic:
    """Topic that a chapter of the dissertation names."""

    id: str  # anchor on its page
    title: str
    section: str  # section of the dissertation that names the topic
    asks: str  # request of the dissertation
    has: str  # part of the request that this project has, in words without numbers
    lacks: str  # part of the request that is missing, as a noun phrase
    claims: tuple[str, ...] = ()  # ids of claims whose verdicts belong to the topic
    numbers: tuple[str, ...] = ()  # "<metrics file>.<key>.<key>", numbers or groups of numbers
    pages: tuple[str, ...] = ()  # ids of the pages that show more
    verbs: tuple[str, ...] = ()  # verbs of the command `unmodelled` that do this on any machine


@dataclass(frozen=True)
class Answered:
    """Topic with the results that exist."""

    topic: Topic
    claims: Table
    numbers: list[Table]  # one table per metrics file

    @property
    def tables(self) -> list[Table]:
        """All tables with rows."""
        return [table for table in (self.claims, *self.numbers) if table.rows]


def answered(topic: Topic, results: Results) -> Answered:
    """Choose the results that belong to a topic; results that do not exist are left out."""
    claims = claims_table(f"claims-{topic.id}", [row for row in results.claims if row["id"] in topic.claims])
    files = dict.fromkeys(name.partition(".")[0] for name in topic.numbers)
    numbers = [_numbers(topic, file, results.metrics[file]) for file in files if file in results.metrics]
    return Answered(topic, replace(short(claims), title=f"Claims: {topic.title}"), numbers)


def _numbers(topic: Topic, file: str, content: dict[str, Any]) -> Table:
    """The numbers of a metrics file that the topic names."""
    whole = metrics_table(f"metrics-{file}", content)
    names = tuple(f"{name}." for name in topic.numbers)
    rows = tuple(row for row in whole.rows if f"{file}.{row[0].exact}.".startswith(names))
    return replace(whole, id=f"{whole.id}-{topic.id}", rows=rows)
