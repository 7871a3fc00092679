"""Audits of cases whose true numbers are known: what is called determined, absorbed and contradicted.

    python -m benchmarks.withheld.audit planted:8900:60 out=FOLDER

audits three sets of the uncertain numbers of every case: those of the system file (5 to 20 % off), those of a
refit without any law ("tuned"), and the true ones. A row is written as its case ends, and the same command
goes on where it was stopped. The table counts numbers:

- Determined: the interval is false where the true number is outside and further off than `CLOSE`.
- Absorbs: of numbers that the refit without the planted laws gets wrong by more than `BENT`, those that the
  audit says absorb a planted law, or one that the case calls alike; and of the numbers of cases without an
  effect, those that it says absorb anything.
- Contradicted: true numbers that it contradicts, and bent ones that it does not call right.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.withheld.case import Case, cases_of
from pipeline.withheld.folders import TRUTH
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.design.audit.audit import AuditFound, audit_numbers
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.judge.known_physics import known_physics
from unmodelled.logs.inputs import read_inputs
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import several
from unmodelled.systems.model import System

Content = Mapping[str, Any]
#: Share up to which two values are the same, as by default, and from which a refit without a law bends one.
CLOSE, BENT = 0.02, 0.10
TRUE, TUNED = "true", "tuned"
#: Kinds of cases whose planted effects have laws in the library.
NAMEABLE = ("single", "pair", "several")


def audited(case: Case) -> Content:
    """Audit a case; an audit that is refused has the reason."""
    case.make()
    truth = read_json((case.apart or case.system) / TRUTH)
    system, logs = read_inputs(case.system, case.logs)
    right = {name: own["true"] for name, own in truth["parameters"].items()}
    row = {"case": case.name, "kind": case.kind, "effects": truth["effects"], "true": right}
    begun = time.process_time()
    try:
        tuned = {name: value for name, value in refitted(system, logs).items() if name in right}
        found = audit_numbers(system, logs, {TRUE: right, TUNED: tuned}, workers=1)
    except BadInput as fault:
        return {**row, "refused": str(fault), "cpu": time.process_time() - begun}
    return {**row, "tuned": tuned, **_told(found), "cpu": time.process_time() - begun}


def refitted(system: System, logs: Logs) -> dict[str, float]:
    """Return the uncertain numbers of the known physics, fitted without any law and measurement chain."""
    logs = several(system, logs)
    study = Study(system, logs, horizon_of(logs, None), ())
    return dict(known_physics(study, lambda _: None).fitted.fit.values)


def _told(found: AuditFound) -> Content:
    numbers = {
        row.name: {
            "kind": row.kind,
            "interval": None if row.estimate is None else row.estimate.interval,
            "value": None if row.estimate is None else row.estimate.value,
            "moves": [vars(move) for move in row.moves],
            "marks": row.marks,
        }
        for row in found.numbers
    }
    sets = {
        row.name: [row.as_given.probability, row.with_laws.probability if row.with_laws else None]
        for row in found.predictions
    }
    return {"verdict": found.verdict, "laws": found.laws, "numbers": numbers, "sets": sets}


def counts(rows: Sequence[Content]) -> Iterator[tuple[str, int, int]]:
    """Yield what is counted: words, how many, and of how many."""
    there = [row for row in rows if "numbers" in row]
    every = [_Number(row, name) for row in there for name in row["true"] if name in row["numbers"]]
    sure = [one for one in every if one.said["kind"] == "determined"]
    bent = [one for one in every if one.row["kind"] in NAMEABLE and one.bent]
    plain = [one for one in every if not one.row["effects"]]
    yield "cases that were audited", len(there), len(rows)
    yield "numbers called determined", len(sure), len(every)
    yield "of these, false", sum(not one.inside for one in sure), len(sure)
    moved = [one for one in every if one.said["kind"] == "absorbs" and one.row["kind"] != "outside"]
    yield (
        "numbers that absorb a law whose interval with it is false",
        sum(not o.inside for o in moved),
        len(moved),
    )
    yield "bent numbers that absorb the planted law", sum(one.absorbs for one in bent), len(bent)
    yield "bent numbers that absorb some law", sum(one.said["kind"] == "absorbs" for one in bent), len(bent)
    yield (
        "bent numbers called determined at the bent value",
        sum(one.said["kind"] == "determined" and not one.inside for one in bent),
        len(bent),
    )
    absorbing = [one for one in plain if one.said["kind"] == "absorbs"]
    yield "numbers of cases without effect that absorb something", len(absorbing), len(plain)
    held = [one for one in every if one.said["marks"].get(TRUE) != "open"]
    yield "true numbers contradicted", sum(o.said["marks"][TRUE] == "contradicted" for o in held), len(held)
    yield "bent numbers that agree", sum(one.said["marks"][TUNED] == "agrees" for one in bent), len(bent)
    laws = [row for row in there if row["laws"] and row["kind"] in NAMEABLE]
    first = [max(row["sets"], key=lambda name: row["sets"][name][1]) for row in laws]
    yield "cases in which the true set predicts best with the laws", first.count(TRUE), len(first)


class _Number:
    """An uncertain number of a case."""

    def __init__(self, row: Content, name: str) -> None:
        self.row, self.said = row, row["numbers"][name]
        self.true, self.tuned = row["true"][name], row["tuned"][name]

    @property
    def bent(self) -> bool:
        return bool(abs(self.tuned - self.true) > BENT * abs(self.true))

    @property
    def inside(self) -> bool:
        low, high = self.said["interval"]
        near = abs(self.said["value"] - self.true) <= CLOSE * abs(self.true)
        return bool(near or low <= self.true <= high)

    @property
    def absorbs(self) -> bool:
        """Whether a planted law is among those that move the number."""
        effects = self.row["effects"]
        planted = [*effects, *(other for effect in effects for other in effect["alike"])]
        right = {(law["family"], law["channel"]) for law in planted}
        return any((move["family"], move["channel"]) in right for move in self.said["moves"])


def main(words: Sequence[str]) -> None:
    """Audit the cases that have no row yet, and print the table of all."""
    given = dict(word.partition("=")[::2] for word in words if "=" in word)
    tracks = [word for word in words if "=" not in word]
    if {*given} != {"out"} or not tracks:
        raise BadInput("words: give cases (TRACK:SEED:COUNT) and out=FOLDER")
    out = Path(given["out"]).resolve()
    for case in (case for track in tracks for case in cases_of(track, out)):
        file = out / "audits" / f"{case.name}.json"
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            row = audited(case)
            write_json(file, row)
            print(f"{case.name}: {row['cpu']:.0f} s, {row.get('refused') or row['laws']}", flush=True)
    rows = [read_json(file) for file in sorted((out / "audits").glob("*.json"))]
    for text, many, whole in counts(rows):
        print(f"| {text} | {many} of {whole} |")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except BadInput as fault:
        print(fault, file=sys.stderr)
        sys.exit(2)
