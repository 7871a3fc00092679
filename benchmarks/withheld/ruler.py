"""Two entrants on the same cases, scored by classes and kinds: the ruler of every change of the diagnosis.

    python -m benchmarks.withheld.ruler OLD NEW [cases=TRACK:SEED:COUNT ...] out=FOLDER

answers the cases with both, as `python -m benchmarks.withheld` does, and compares all rows in the folder:
rates side by side, the chance of such a difference (McNemar 1947), the cases that differ, and CPU seconds.

- A class, a law with those that the logs cannot tell from it, is right or wrong as a whole. Delay or lag of a
  channel are one. At most `MOST_ALIKE` of a class count.
- Kind and place: the first class is about what is planted (dry friction, damping, ...), where it is planted.
- Parts of the measurement chain are neither right nor wrong, but `main_effect` with nothing else says that
  something is missing: right for an effect outside the library, wrong where nothing is.
- Pairs are those with two visible effects.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.withheld.case import cases_of
from benchmarks.withheld.entrant import ROOT, Entrant
from benchmarks.withheld.score import share
from benchmarks.withheld.table import read_rows, rows_of
from pipeline.withheld.folders import TRUTH
from pipeline.withheld.judging import CONFIDENT, NAMING, channels
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.effects.library import effects

Content = Mapping[str, Any]
#: Laws of a class that count, the named one and its alternatives.
MOST_ALIKE = 4
#: Families of the library by the names that cases have from when it lacked them.
LATER = {"sticky_valve": "actuator_stiction"}
#: Families that are one: a lag shorter than the motion is a delay.
SAME = {"sensor_lag": "sensor_delay", "actuator_lag": "input_delay", **LATER}
#: Kinds of cases, with what is asked of them.
ASKED = {
    "single": ("first", "about"),
    "null": ("right",),
    "pair": ("exact",),
    "several": ("material",),
    "outside": ("right",),
    "number": ("first",),
    "wrong_logs": ("right",),
    "twin": ("right",),
    "real": ("right",),
    "archive": ("right",),
}
HEADINGS = {
    "first": "right class first",
    "about": "right kind and place",
    "exact": "exactly both, where both are visible",
    "material": "all material ones",
    "right": "right",
}


@cache
def kinds() -> dict[str, str]:
    """Return the kind of every family, that of its plainest law."""
    found: dict[str, str] = {}
    for effect in effects():
        found.setdefault(effect.family, effect.kind)
    return found


def scored(truth: Content, answer: Content) -> dict[str, bool | None]:
    """Score an answer by classes; None where a question does not apply."""
    acts_at = truth.get("acts_at", {})
    visible = [p for p in truth["effects"] if p.get("material", True)]
    planted = [_planted(p) for p in visible]
    chain = {_site(p["family"], p["channel"]) for p in truth.get("tolerated", ())}
    named = [_class(e, acts_at) for e in answer["effects"]] if answer["verdict"] in NAMING else []
    named = [own for own in named if not own & chain or any(own & p for p in planted)]
    hits = [any(own & p for p in planted) for own in named]
    met = [any(own & p for own in named) for p in planted]
    outside = truth["verdict"] == "unknown" and not all(e["family"] in LATER for e in truth["effects"])
    exact = bool(planted) and all(met) and len(named) == len(planted)
    silent = answer["verdict"] in ("no_gap", "effect") and not named
    says_more = answer["verdict"] == "unknown" or (answer["verdict"] == "main_effect" and not named)
    right = says_more if outside else exact or (all(hits) and any(hits)) if planted else silent
    return {
        "first": bool(hits and hits[0]) if planted and not outside else None,
        "about": _kind_and_place(answer, visible, acts_at) if planted and not outside else None,
        "exact": exact if len(planted) == 2 and not outside else None,
        "material": all(met) if planted and not outside else None,
        "right": bool(right),
    }


def _site(family: str, channel: str) -> tuple[str, str]:
    return SAME.get(family, family), channel


def _planted(row: Content) -> frozenset[tuple[str, str]]:
    every = [(row["family"], row["channel"]), *((e["family"], e["channel"]) for e in row["alike"])]
    return frozenset(_site(*one) for one in every)


def _class(effect: Content, acts_at: Mapping[str, Sequence[str]]) -> frozenset[tuple[str, str]]:
    """Families and channels of a named effect and of those that are told to be like it."""
    found = set()
    for one in [effect, *effect.get("indistinguishable", ())][:MOST_ALIKE]:
        own = [f"parameter:{one['parameter']}"] if one.get("parameter") else []
        found |= {_site(one["family"], at) for at in (*own, *channels(one["port"], acts_at))}
    return frozenset(found)


def _kind_and_place(
    answer: Content, visible: Sequence[Content], acts_at: Mapping[str, Sequence[str]]
) -> bool:
    """Whether kind and channel of the first effect are those of a planted one."""
    if answer["verdict"] not in NAMING or not answer["effects"]:
        return False
    first = answer["effects"][0]
    said = {(kinds().get(first["family"], ""), at) for at in channels(first["port"], acts_at)}
    wanted = {(kinds().get(family, ""), at) for p in visible for family, at in _planted(p)}
    return bool(said & wanted)


def in_words(text: str) -> tuple[set[str], set[str]]:
    """Return the families and the verdicts that a text calls right, such as that of a measured machine.

    A sentence on what is wrong, or right in part only, names none.
    """
    sentences = re.split(r"[.;] ", text)
    said = " ".join(s for s in sentences if not re.search(r"\b(wrong|partly|only as|listed|false)\b", s))
    said = said.replace("dry friction", "coulomb_friction")
    for family in kinds():
        said = said.replace(family.replace("_", " "), family)
    words = set(re.findall(r"[a-z_]+", said))
    return words & set(kinds()), words & {"no_gap", "unknown", "check_logs"}


def of_words(text: str, answer: Content) -> dict[str, bool]:
    """Score an answer to a machine of which only words are known: its first class, or its verdict."""
    families, verdicts = in_words(text)
    named = answer["effects"] if answer["verdict"] in NAMING else []
    own = [e["family"] for e in [*named[:1], *(named[0]["indistinguishable"] if named else ())][:MOST_ALIKE]]
    first = bool(families & set(own))
    return {"first": first, "right": first if named else answer["verdict"] in verdicts}


def rows(out: Path, entrant: str) -> dict[str, dict[str, Any]]:
    """Return the rows of an entrant with the scores of this ruler, by case."""
    found = {}
    for case, row in read_rows(rows_of(out, entrant)).items():
        truth, answer = out / "truth" / case / TRUTH, out / "answers" / entrant / case / "answer.json"
        own = dict(row)
        unanswered: Content = {"verdict": "", "effects": [], "confidence": 0.0}
        said = read_json(answer) if answer.exists() and not row["error"] else unanswered
        if row["kind"] == "archive":
            own |= of_words(row["truth"], said)
        elif truth.exists():
            content = read_json(truth)
            fault = content.get("fault") or {}
            own |= scored(content, said) if not fault.get("decides") else {}
        found[case] = own
    return found


def table(old: Mapping[str, Content], new: Mapping[str, Content]) -> Iterator[list[str]]:
    """Yield rates of both on the cases that both have, and the chance of such a difference."""
    shared = [case for case in old if case in new]
    yield ["asked of", "question", "old", "new", "only old", "only new", "chance"]
    for kind, questions in ASKED.items():
        for question in questions:
            cases = [c for c in shared if old[c]["kind"] == kind and old[c].get(question) is not None]
            pairs = [(bool(old[c][question]), bool(new[c].get(question))) for c in cases]
            if pairs:
                yield [kind, HEADINGS[question], *_compared(pairs)]
    wrong = [tuple(_misleads(rows[c]) for rows in (old, new)) for c in shared]
    yield ["all", "confidently wrong", *_compared(wrong)]
    cpu = [f"{np.median([rows[c]['cpu'] for c in shared] or [0.0]):.1f}" for rows in (old, new)]
    yield ["all", "CPU s, median", *cpu, "", "", ""]


def _misleads(row: Content) -> bool:
    return bool(row.get("confidence", 0.0) >= CONFIDENT and not row.get("right"))


def _compared(pairs: Sequence[tuple[bool, ...]]) -> list[str]:
    one, other = pairs.count((True, False)), pairs.count((False, True))
    chance = binomtest(one, one + other).pvalue if one + other else 1.0
    rates = [share([pair[k] for pair in pairs]) for k in (0, 1)]
    return [*rates, str(one), str(other), f"{chance:.2g}"]


def differing(old: Mapping[str, Content], new: Mapping[str, Content]) -> Iterator[list[str]]:
    """Yield the cases in which one of them is right and the other is not."""
    yield ["case", "truth", "old", "new", "right"]
    for case in old:
        if case in new:
            marks = [bool(rows[case].get(_asked(rows[case]))) for rows in (old, new)]
            if marks[0] != marks[1]:
                said = [str(rows[case].get("said") or rows[case]["error"]) for rows in (old, new)]
                yield [case, str(old[case]["truth"])[:80], *said, "old" if marks[0] else "new"]


def _asked(row: Content) -> str:
    return ASKED.get(row["kind"], ("right",))[0]


def _answer(cases: str, entrant: str, out: Path) -> None:
    """Answer cases on all cores; what is there is kept."""
    keys = overrides(cases, len(cases_of(cases, out)), entrant, out)
    call = [sys.executable, "-m", "benchmarks.withheld", "-m", *keys, "hydra/launcher=joblib"]
    subprocess.run(call, check=True, cwd=ROOT)


def overrides(cases: str, count: int, entrant: str, out: Path) -> list[str]:
    """Return the overrides of Hydra that answer cases; an entrant may have words with `=`."""
    return [f"cases='{cases}'", f"case=range(0,{count})", f"entrant='{entrant}'", f"out='{out}'"]


def main(words: Sequence[str]) -> None:
    """Print the tables of two entrants."""
    entrants = [word for word in words if "=" not in word]
    given = [(key, value) for key, _, value in (word.partition("=") for word in words) if value]
    if len(entrants) != 2 or {key for key, _ in given} - {"out", "cases"}:
        raise BadInput("ruler: give two entrants, cases=TRACK:SEED:COUNT and out=FOLDER")
    out = Path(dict(given).get("out", "outputs/withheld")).resolve()
    for key, cases in given:
        for entrant in entrants if key == "cases" else ():
            _answer(cases, entrant, out)
    names = [Entrant.of(entrant).name for entrant in entrants]
    old, new = (rows(out, name) for name in names)
    if not {*old} & {*new}:
        raise BadInput(f"ruler: {names[0]} and {names[1]} have no case in common; run both first")
    for part in (table(old, new), differing(old, new)):
        for line in part:
            print("| " + " | ".join(cell.replace("|", "/") for cell in line) + " |")
        print()


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except BadInput as fault:
        print(fault, file=sys.stderr)
        sys.exit(2)
