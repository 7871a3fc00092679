"""Score answers with the truth. Needs this checkout, Python and `pip install jsonschema psutil`.

    python -m benchmarks.withheld.score truth=FOLDER answers=FOLDER

`truth` has <case>/truth.json and `answers` <case>/answer.json or <case>.json. An answer has

    {"verdict": "effect", "confidence": 0.8, "effects": [{"family": "coulomb_friction", "port": "rail"}]}

- verdict: `effect`, `main_effect` (more is missing than these effects), `no_gap`, `unknown`, `check_logs`.
- effects, the largest first: family and place (a port, `actuator:<input>`, `sensor:<output>` or
  `parameter:<name>`); optionally `indistinguishable` (a list of such pairs that these logs cannot tell from
  it, the first three of which count) and `number` (`{"value": 1.2, "interval": [1.1, 1.3]}` in SI, see
  `NUMBERS`).
- where, optional: `{"channels": [{"port": "rail", "share": 0.9}]}`, the place of a gap without a law.
- logs, for `check_logs`: `[{"channel": "torque"}]`.
- confidence: probability that the answer is right.
- model, optional: a system file beside it, which the benchmark simulates on motions of another kind.

`unmodelled/base/answers.schema.json` describes it (`definitions/answer`). An answer that does not follow it
counts as unanswered, with the reason on standard error.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from pipeline.chapters.reported import read_truth
from pipeline.withheld.judging import Case, Content, in_words
from unmodelled.base import answers
from unmodelled.base.errors import BadInput

Row = dict[str, Any]

TRUTH, ANSWER = "truth.json", "answer.json"
#: The number of a family, as truth.json calls it: what an entrant may give with an interval. Delays and lags
#: are none: the measurement chain adds to them.
NUMBERS = {
    "actuator_gain": "excess",
    "actuator_offset": "offset",
    "actuator_saturation": "limit",
    "constant_load": "load",
    "coulomb_friction": "force",
    "sensor_gain": "excess",
    "sensor_offset": "bias",
}
#: Heading and entry of a row.
ASKED = {"named first": "first", "in the set": "in_set", "exactly": "exact", "place": "place"}
#: Place of the gap in an answer that gives none.
NOWHERE: Content = {"channels": []}
#: Half width of an interval, relative to the number, from which on it tells no sign of the number.
WIDE = 1.0
#: Normal quantile of a 95 % interval.
Z = 1.959964


def read_answer(path: Path) -> Row:
    """Read an answer, with what it may leave out; a BadInput names the file and entry of a fault."""
    found = answers.read_answer(path)
    effects = [{"indistinguishable": [], **effect} for effect in found.get("effects", [])]
    return {"logs": [], "where": NOWHERE, **found, "effects": effects}


def score(truth: Content, answer: Content) -> Row:
    """Compare an answer with the truth.

    Gives truth and said (in words), verdict, confidence, right, first (the first named effect is planted),
    in_set (all planted ones are named or listed as indistinguishable), exact, place (of the first one), extra
    (number of effects that are not planted), seen (of every planted effect: whether it causes a tenth of the
    gap), material and material_named (number of these, and of those that are named), inside (whether the
    interval of a number holds it, by effect), width (half width of this interval, relative to the number),
    brier. Where no effect of the library is planted, first, in_set and exact are None. An effect that is not
    seen need not be named.
    """
    seen = [bool(effect.get("material", True)) for effect in truth["effects"]]
    case = Case.of(truth, answer, truth.get("acts_at", {}), seen)
    wrong = truth.get("fault") or {}
    right = _told(wrong, answer) if wrong.get("decides") else case.right
    asked = bool(case.planted) and not case.outside and not wrong.get("decides")
    planted = [[p for p in case.planted if p.is_named(e, case.acts_at)] for e in case.named]
    numbers = [*_numbers(truth, case)]
    return {
        "truth": f"{wrong['problem']} of {wrong['channels'][0]}" if wrong.get("decides") else case.truth,
        "said": in_words(case),
        "verdict": case.verdict,
        "confidence": answer["confidence"],
        "right": right,
        "first": case.first if asked else None,
        "in_set": case.all_reported if asked else None,
        "exact": case.exact if asked else None,
        "place": case.channel if case.planted else None,
        "extra": sum(not found for found in planted),
        "seen": seen,
        "material": len(case.material),
        "material_named": sum(case.material),
        "inside": [low <= true <= high for true, (low, high) in numbers],
        "width": [abs((high - low) / (2.0 * true)) for true, (low, high) in numbers],
        "brier": (answer["confidence"] - right) ** 2,
    }


def unanswered(truth: Content) -> Row:
    """Return what `score` says of no answer: nothing is named, and nothing is right."""
    nothing = {"verdict": "unknown", "confidence": 0.0, "effects": [], "logs": [], "where": NOWHERE}
    found = score(truth, nothing)
    asked = {key: None if found[key] is None else False for key in ASKED.values()}
    return {**found, **asked, "right": False, "brier": 0.0}


def _told(wrong: Content, answer: Content) -> bool:
    """Whether an answer to wrong logs names the channel."""
    said = {fault["channel"] for fault in answer["logs"]}
    return bool(answer["verdict"] == "check_logs" and said & {*wrong["channels"]})


def _numbers(truth: Content, case: Case) -> Iterator[tuple[float, Sequence[float]]]:
    """Planted numbers, which are not zero, with their intervals in effects of the same family and place."""
    for effect in case.named:
        for row in truth["effects"]:
            same = (row["family"], row["channel"]) == (effect["family"], effect["port"])
            true = row.get("parameters", {}).get(NUMBERS.get(row["family"], ""))
            interval = effect.get("number", {}).get("interval")
            if same and interval and isinstance(true, float):
                yield true, interval


def share(values: Sequence[bool]) -> str:
    """Return a count, its share and the 95 % interval by Wilson (1927)."""
    n, k = len(values), sum(map(bool, values))
    if not n:
        return ""
    p, square = k / n, Z**2 / n
    middle = (p + square / 2) / (1 + square)
    half = Z * math.sqrt(p * (1 - p) / n + square / (4 * n)) / (1 + square)
    return f"{k} of {n}: {100 * p:.0f} % ({100 * max(middle - half, 0.0):.0f} to {100 * (middle + half):.0f})"


def calibration(rows: Sequence[Mapping[str, Any]]) -> float:
    """Return the difference between confidence and share of right answers, mean over verdicts by cases."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(row["verdict"], []).append(row)
    off = (abs(sum(r["confidence"] - r["right"] for r in group)) for group in groups.values())
    return sum(off) / len(rows) if rows else 0.0


def summary(rows: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Return the rates of rows as a table, its header first; a case without an answer is wrong."""
    known = [row for row in rows if not row.get("error")]
    widths = [width for row in known for width in row.get("width", [])]
    return [
        ["measure", "rate"],
        ["right", share([r.get("right", False) for r in rows])],
        *([name, _asked(rows, key)] for name, key in ASKED.items()),
        ["names beyond the truth", share([r["extra"] > 0 for r in known])],
        ["number in its interval", share([yes for r in known for yes in r.get("inside", [])])],
        ["half width of these intervals", _median(widths)],
        ["intervals wider than ± 100 %", share([width > WIDE for width in widths])],
        ["confidently wrong (0.8)", share([r["confidence"] >= 0.8 and not r["right"] for r in known])],
        ["worse than the given file", _asked(known, "harmful")],
        ["Brier score", f"{sum(r['brier'] for r in known) / max(len(known), 1):.3f}"],
        ["calibration error by verdict", f"{calibration(known):.3f}"],
        ["without an answer", share([bool(r.get("error")) for r in rows])],
    ]


def _asked(rows: Sequence[Mapping[str, Any]], key: str) -> str:
    return share([row[key] for row in rows if row.get(key) is not None])


def _median(widths: Sequence[float]) -> str:
    return f"{100.0 * median(widths):.3g} % of the number in the median" if widths else ""


def main(words: Sequence[str]) -> None:
    """Print the rates of a folder of answers."""
    given = dict(word.partition("=")[::2] for word in words)
    if {*given} != {"truth", "answers"}:
        raise BadInput("words: give truth=FOLDER and answers=FOLDER")
    truths, said = Path(given["truth"]), Path(given["answers"])
    rows = [_row(path, said) for path in sorted(truths.glob(f"*/{TRUTH}"))]
    if not rows:
        raise BadInput(f"{truths}: holds no <case>/{TRUTH}")
    for row in rows:
        if row.get("error"):
            print(f"without an answer: {row['error']}", file=sys.stderr)
    for line in summary(rows):
        print("  ".join((line[0].ljust(30), line[1])))


def _row(path: Path, said: Path) -> Row:
    """What `score` says of a case; one that has no answer, or a damaged one, is not answered."""
    truth, name = read_truth(path), path.parent.name
    found = [p for p in (said / name / ANSWER, said / f"{name}.json") if p.exists()]
    try:
        if not found:
            raise BadInput(f"{said / name / ANSWER}: no such file")
        return score(truth, read_answer(found[0]))
    except BadInput as fault:
        return unanswered(truth) | {"error": str(fault)}


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except BadInput as fault:
        print(fault, file=sys.stderr)
        sys.exit(2)
