"""Tables of executed stages, fitted models, campaigns and versions."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from pipeline.report.numbers import duration
from unmodelled.report.numbers import number
from unmodelled.report.tables import Cell, Table, exact

Execution = Mapping[str, Any]

#: What a file of numbers says of how it was made, and how that is set.
SETTINGS = {"profile": "", "revision": "mono"}


def stages_table(executions: Sequence[Execution]) -> Table:
    """Return the duration of every stage, the longest first; cells of a stage are added up."""
    cells: dict[str, list[float]] = defaultdict(list)
    for execution in executions:
        cells[str(execution["stage"]).partition("@")[0]].append(execution["seconds"])
    everything = sum(map(sum, cells.values()))
    rows = [
        (
            Cell(stage, stage),
            Cell(number(len(seconds)), str(len(seconds))),
            _time(round(sum(seconds), 3), "figure"),
            _time(max(seconds), "nowrap"),
            _share(sum(seconds), everything),
        )
        for stage, seconds in sorted(cells.items(), key=lambda item: -sum(item[1]))
    ]
    return Table(
        "stages",
        "Time per stage",
        ("Stage", "Cells", "Time", "Longest cell", "Share of all"),
        (False, True, True, True, False),
        tuple(rows),
        f"{duration(everything)} of wall time added up; parts of the graph ran side by side." if rows else "",
        download=(
            ("stage", "cells", "seconds", "longest_cell_seconds", "share"),
            *(tuple(cell.exact for cell in row) for row in rows),
        ),
    )


def _time(seconds: float, kind: str) -> Cell:
    return Cell(duration(seconds), exact(seconds), kind)


def _share(seconds: float, everything: float) -> Cell:
    share = seconds / everything if everything else 0.0
    return Cell(f"{100 * share:.1f}\u202f%", f"{share:.4f}", "bar")


def executions_table(executions: Sequence[Execution]) -> Table:
    """Return the last execution of every cell of the graph, with a link to its configuration."""
    keys = ("stage", "command", "seed", "seconds", "finished", "revision", "machine")
    rows = [
        (
            Cell(e["stage"], e["stage"], "cell", note=e["command"]),
            Cell(number(e["seed"]), exact(e["seed"])),
            _time(e["seconds"], "figure"),
            Cell(e["finished"][:16].replace("T", " "), e["finished"], "nowrap"),
            Cell(e["revision"], e["revision"], "mono"),
            Cell("all keys", "", link=f"configs/{quote(configuration_file(e))}"),
        )
        for e in executions
    ]
    return Table(
        "executions",
        "Every cell of the graph",
        ("Cell", "Seed", "Time", "Finished (UTC)", "Code", "Configuration"),
        (False, True, True, False, False, False),
        tuple(rows),
        "The last time that each was executed. What DVC takes from its cache is not executed again.",
        download=(keys, *(tuple(exact(e[key]) for key in keys) for e in executions)),
    )


def configuration_file(execution: Execution) -> str:
    """Return the name of the file of an execution's configuration."""
    return f"{str(execution['stage']).replace('/', '_')}.txt"


def versions_table(executions: Sequence[Execution]) -> Table:
    """Return the versions of packages and the machines of the executions."""
    counts = Counter(item for e in executions for item in e["versions"].items())
    counts.update(("machine", e["machine"]) for e in executions)
    rows = [
        (Cell(name, name), Cell(version, version, "mono"), Cell(number(count), str(count)))
        for (name, version), count in sorted(counts.items())
    ]
    about = "A package that stands here twice changed between the executions." if rows else ""
    return Table(
        "versions", "Versions", ("Package", "Version", "Cells"), (False, False, True), tuple(rows), about
    )


def runs_table(runs: Mapping[str, Mapping[str, Any]]) -> Table:
    """Return one row per fit; the folders of a fit name its choices in conf/."""
    columns = ("Mechanism", "Model", "Split", "Folds", "Repeats", "Seed", "Time (s)", "Parameters")
    rows = []
    for path, about in runs.items():
        choices = [*path.split("/"), "", "", ""][:3]
        folds = about.get("folds")
        values = [len(folds) if isinstance(folds, list) else folds]
        values += [about.get(key) for key in ("repeats", "seed", "seconds", "parameters")]
        rows.append(tuple([Cell(c or "–", c) for c in choices] + [Cell(number(v), exact(v)) for v in values]))
    return Table("runs", "Fitted models", columns, (*(False,) * 3, *(True,) * 5), tuple(rows))


def campaigns_table(
    campaigns: Mapping[str, Mapping[str, Any]], shown_on: Mapping[str, tuple[str, str]]
) -> Table:
    """Return the kind of the data of every campaign."""
    rows = []
    for name, about in campaigns.items():
        label, address = shown_on.get(name, ("–", ""))
        rows.append(
            (
                Cell(name.replace("_", " ").replace("/", ": "), name, note=about.get("description", "")),
                Cell(about["data"], about["data"], f"origin {about['data']}"),
                Cell(number(about.get("experiments")), exact(about.get("experiments"))),
                Cell(label, label, link=address),
            )
        )
    columns = ("Campaign", "Data", "Experiments", "Results")
    return Table(
        "campaigns", "What was run, on which data", columns, (False, False, True, False), tuple(rows)
    )


def provenance_table(metrics: Mapping[str, Mapping[str, Any]]) -> Table:
    """Return data, profile and code of every metrics file."""
    rows = [
        (
            Cell(topic.replace("_", " "), topic),
            Cell(about["data"], about["data"], f"origin {about['data']}"),
            *(
                Cell(str(about.get(key, "–")), str(about.get(key, "")), kind)
                for key, kind in SETTINGS.items()
            ),
            Cell(duration(about["seconds"]) if about.get("seconds") else "–", exact(about.get("seconds"))),
        )
        for topic, about in metrics.items()
    ]
    columns = ("Numbers", "Data", "Profile", "Code", "Time of the fits")
    return Table(
        "provenance", "Results and the data behind them", columns, (*(False,) * 4, True), tuple(rows)
    )


def settings(metrics: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the profiles and code revisions of the numbers from the graph."""
    made = [about for about in metrics.values() if about.get("profile", "-") != "-"]
    found = {key: sorted({str(about[key]) for about in made if about.get(key)}) for key in SETTINGS}
    return [f"{key} {', '.join(values)}" for key, values in found.items() if values]
