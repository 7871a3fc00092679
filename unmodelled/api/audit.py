"""Audit sets of numbers of a system by its logs: a result with a table, a page and the best set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from unmodelled.base.files import replacing, replacing_folder, write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.base.progress import silence
from unmodelled.design.audit.audit import AuditFound, audit_numbers
from unmodelled.design.audit.content import content, lines, sentences
from unmodelled.design.audit.number_sets import SetsGiven
from unmodelled.diagnosis.data.options import Options
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.report.audit_page import write_audit_page
from unmodelled.systems.given import SystemGiven


@dataclass(frozen=True, eq=False, repr=False)
class Audit:
    """Audit of the numbers of a system and of sets of them by logs; made by `audit`.

    Attributes:
        found: numbers, sets with their predictions, missing laws and notes.
    """

    found: AuditFound

    @cached_property
    def content(self) -> dict[str, Any]:
        """Return the content of audit.json."""
        return content(self.found)

    @property
    def laws(self) -> tuple[str, ...]:
        """Return the laws that the system leaves out, in words."""
        return self.found.laws

    def table(self) -> pd.DataFrame:
        """Return a row per number of the system file.

        Columns: number, unit, kind (determined, combined: only together with others, undetermined, absorbs: a
        missing law moves it, known: held, wrong: these logs need another value than the file), value, low and
        high (95 % interval with the missing laws; nan where it was held), absorbs (laws), without (value
        without the first of these), tied (numbers), sentence, and for every set its value and, in the column
        `<set> says`, agrees, absorbs, contradicted or open.
        """
        rows = []
        for row in self.content["numbers"]:
            low, high = row["interval"] or (float("nan"), float("nan"))
            moves = row["moves"]
            about = {"number": row["name"], "unit": row["unit"], "kind": row["kind"]}
            value = float("nan") if row["value"] is None else row["value"]
            about |= {"value": value, "low": low, "high": high}
            about |= {"absorbs": ", ".join(move["law"] for move in moves)}
            about |= {"without": moves[0]["value"] if moves else float("nan")}
            about |= {"tied": ", ".join(row["tied"]), "sentence": row["sentence"]}
            for name, own in row["sets"].items():
                about |= {name: own["value"], f"{name} says": own["mark"]}
            rows.append(about)
        return pd.DataFrame(rows)

    def sets(self) -> pd.DataFrame:
        """Return a row per set, the best first.

        Columns: set, probability (that it predicts best as the model stands, 0 to 1), best_with_laws (the
        same with the missing laws; nan without one), and for every output its root mean square error in
        experiments left out, in the unit of its column: `<output>` and `<output> with laws`.
        """
        rows = []
        for one in self.content["sets"]:
            about = {"set": one["name"], "probability": one["as_given"]["probability"]}
            about["best_with_laws"] = (one["with_laws"] or {}).get("probability", float("nan"))
            for end, key in (("", "as_given"), (" with laws", "with_laws")):
                errors = (one[key] or {}).get("errors") or {}
                about |= {f"{name}{end}": errors.get(name, float("nan")) for name in self.content["outputs"]}
            rows.append(about)
        return pd.DataFrame(rows)

    def save(self, folder: Path | str) -> None:
        """Write audit.json, numbers.csv (a row a number), sets.csv (a row a set) and the page index.html.

        Args:
            folder: folder that is new, empty or holds an older audit; replaced as a whole.

        Raises:
            BadInput: when the folder may not be replaced or cannot be written.
        """
        sources = {"system": self.found.system.source, "logs": self.found.logs.source}
        with writing("audit", Path(folder), sources), replacing_folder(Path(folder)) as new:
            write_json(new / "audit.json", self.content)
            for name, table in (("numbers", self.table()), ("sets", self.sets())):
                with replacing(new / f"{name}.csv") as temporary:
                    table.to_csv(temporary, index=False)
            write_audit_page(new, self.content, list(sentences(self.content)))

    def __repr__(self) -> str:
        return "\n".join(lines(self.content))

    def _repr_html_(self) -> str:
        tables = {"Numbers": self.table().drop(columns="sentence"), "Sets": self.sets()}
        return shown(f"Audit of {self.found.system.name}", sentences(self.content), tables)


def audit(
    system: SystemGiven,
    logs: LogsGiven,
    sets: SetsGiven = (),
    parameters: Sequence[str] | None = None,
    horizon: float | None = None,
    seed: int = 0,
    workers: int | None = None,
    options: Options | Mapping[str, float] | None = None,
    close: float = 0.02,
    quiet: bool = False,
) -> Audit:
    """Audit sets of numbers of one system: which numbers hold, which make up for a law, which set predicts.

    Numbers that the file marks with `identify` and those that a set doubts are fitted, as a diagnosis does,
    beside the laws that the system leaves out. A number that is another one without such a law *absorbs* the
    law: it is right in no other machine, motion or model. Every experiment is left out once; a set predicts
    it with the measurement chain, and the numbers that it lacks, of the other experiments.

    Args:
        system: known physics, or the path of its file; its numbers are a set, too.
        logs: measured experiments, the path of their folder, or data frames.
        sets: sets by name, each a mapping (name of the parameter: value in the unit of the file, or a text
            such as "35 g cm^2"), a system of the same structure, or the path of a YAML or JSON file with
            either; or a list of such files; default: none, so that the numbers of the file are audited.
        parameters: names of the numbers to audit; default: those that the file marks with `identify`, and
            those of which a set has another value than the file.
        horizon: length of the free-run windows, s; default: from the logs.
        seed: seed of the random generators; default 0.
        workers: number of threads; default: one per core.
        options: numbers that decide (`Options`), or those that are not the defaults by name.
        close: share of a number up to which two values are the same, 0 to 1; default 0.02.
        quiet: whether nothing is said about the progress; default False.

    Returns:
        A row for every number of the file, and the sets by their predictions.

    Raises:
        BadInput: when the system, the logs, a set or an option cannot be used, or a fault of the logs, such
            as a wrong unit, would be explained by numbers.

    Examples:
        The pendulum has dry friction, which its file leaves out; the damping was tuned without it:

        >>> import unmodelled as um
        >>> sets = {"tuned": {"b": 0.0254}, "sheet": {"b": "15 mN m s/rad"}}
        >>> found = um.audit(*um.example("pendulum"), sets)
        >>> found.laws
        ('Coulomb friction at joint',)
        >>> found.table().set_index("number").loc["b", ["kind", "tuned says", "sheet says"]].tolist()
        ['absorbs', 'absorbs', 'agrees']
        >>> table = found.sets().set_index("set")
        >>> table["probability"].idxmax(), table["best_with_laws"].idxmax()
        ('tuned', 'sheet')
    """
    limits = Options.of(options)
    with silence() if quiet else nullcontext():
        known, measured = read_inputs(system, logs)
        return Audit(audit_numbers(known, measured, sets, parameters, horizon, seed, workers, limits, close))
