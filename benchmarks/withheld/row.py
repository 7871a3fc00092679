"""One case of the benchmark and its row: the answer of an entrant, its cost, and its score."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.head_to_head import case as head_to_head
from benchmarks.head_to_head.ours import FileParameters
from benchmarks.withheld.case import Case, cases_of
from benchmarks.withheld.entrant import Entrant
from benchmarks.withheld.score import ANSWER, NUMBERS, Row, read_answer, score, unanswered
from benchmarks.withheld.table import rows_of
from pipeline.chapters import real
from pipeline.withheld.folders import TRUTH, VALIDATION
from pipeline.withheld.judging import NAMING, Planted
from pipeline.withheld.validation import gap_on
from unmodelled.base.answers import read_diagnosis
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.systems.reader import read_system

#: Files of a diagnosis, and the system with the effects found.
DIAGNOSIS, AUGMENTED = "diagnosis.json", "augmented_system.yaml"
KEPT = (ANSWER, DIAGNOSIS, AUGMENTED)
#: Beside the truth: horizon, and gap of the re-identified physics on the validation experiments.
BEFORE = "before.json"


def row(case: Case, entrant: Entrant, answers: Path, cap: float) -> Row:
    """Answer a case, whose files are there, in a fresh process of at most `cap` CPU seconds; return its row.

    It has case, kind, entrant, revision, digest (of system file and logs), truth, cpu (s), wall (s), memory
    (MB) and error ("" or the reason why there is no answer); with an answer what `score` says, effects (pairs
    of family and place), gap and rank (of a diagnosis), and harmful. `answers` keeps <case>/answer.json, the
    model and the log.
    """
    answers.mkdir(parents=True, exist_ok=True)
    out = answers / case.name
    shutil.rmtree(out, ignore_errors=True)
    run = entrant.run(case.system, case.logs, out, cap)
    found: Row = {"case": case.name, "kind": case.kind, "entrant": entrant.name, "revision": entrant.revision}
    found |= {"digest": case.digest(), "truth": case.truth, "cpu": run.cpu, "wall": run.wall}
    found |= {"memory": run.memory, "error": run.error}
    if not run.error:
        try:
            found |= judged(case, out)
        except Exception as fault:  # an entrant that writes another file must not end the benchmark
            found["error"] = f"not judged: {type(fault).__name__}: {fault}"[:300]
    if found["error"]:
        found |= _unanswered(case)
    for path in out.glob("*"):  # figures and pages take a hundred times the room
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        elif path.name not in KEPT and path.suffix not in (".yaml", ".log"):
            path.unlink()
    return found


def _unanswered(case: Case) -> Row:
    if case.apart is not None:
        return unanswered(read_json(case.apart / TRUTH))
    return {} if case.known is None else dict.fromkeys(("first", "in_set", "exact", "right"), False)


def judged(case: Case, out: Path) -> Row:
    """Return how an answer compares with the truth; `rank` is that of the true laws alone in a diagnosis."""
    diagnosis = read_diagnosis(out / DIAGNOSIS) if (out / DIAGNOSIS).exists() else None
    if diagnosis is not None:
        write_json(out / ANSWER, answer_of(diagnosis))
    answer = read_answer(out / ANSWER)
    found: Row = {
        "verdict": answer["verdict"],
        "confidence": answer["confidence"],
        "effects": [[e["family"], e["port"]] for e in answer["effects"]],
        "said": " + ".join(map(_text, answer["effects"])) or answer["verdict"],
    }
    if diagnosis is not None:
        found["gap"] = {name: diagnosis["gap"][name] for name in ("known", "augmented", "floor")}
    if case.known is not None and diagnosis is not None:
        return found | _of_real(case, diagnosis)
    if case.apart is None:
        return found
    truth = read_json(case.apart / TRUTH)
    found |= score(truth, answer) | _harm(case, out, answer)
    if diagnosis is not None:
        planted, acts_at = [Planted.of(effect, True) for effect in truth["effects"]], truth["acts_at"]
        found["rank"] = _ranks(diagnosis, [lambda one, p=p: p.is_named(one, acts_at) for p in planted])  # type: ignore[misc]
    return found


def _text(effect: Mapping[str, Any]) -> str:
    more = len(effect["indistinguishable"])
    return real.named(effect) + (f" (or {more} more)" if more else "")


def answer_of(diagnosis: Mapping[str, Any]) -> Row:
    """Return the answer that a diagnosis is."""
    keys = "family", "port", "parameter", "factor", "level", "indistinguishable"
    effects = []
    for effect in diagnosis["effects"]:
        own = {key: effect[key] for key in keys if key in effect}
        number: Mapping[str, Any] = next(iter(effect["parameters"].values()), {})
        # an end that is open (null) makes it no interval
        if effect["family"] in NUMBERS and None not in number.get("interval", (None,)):
            own["number"] = {"value": number["value"], "interval": number["interval"]}
        effects.append(own)
    same = {key: diagnosis[key] for key in ("verdict", "confidence", "where", "logs")}
    return {**same, "effects": effects, "model": AUGMENTED}


def _of_real(case: Case, said: Mapping[str, Any]) -> Row:
    """Of a measured machine: `right` is whether the answer holds."""
    assert case.known is not None
    wanted, asserted = case.known.effects, real.asserted(said)
    found = real.judged(case.known, said)
    names = [{*map(real.named, (e, *e["indistinguishable"]))} for e in asserted]
    first = bool(asserted) and any(real.named(asserted[0]) in one for one in wanted)
    held = [any(one & said for said in names) for one in wanted]
    tests: list[Callable[[Mapping[str, Any]], bool]] = [
        lambda e, one=one: real.named(e) in one  # type: ignore[misc]
        for one in wanted
    ]
    return {
        **{"rank": _ranks(said, tests), "first": first, "in_set": all(held)},
        **{"exact": all(held) and len(asserted) == len(wanted), "right": found["holds"] == "yes"},
        **{"harmful": found["harmful"] == "yes", "failed_at": found["failed at"]},
    }


def _ranks(said: Mapping[str, Any], named: Sequence[Callable[[Mapping[str, Any]], bool]]) -> list[int | None]:
    """Place of every true effect among the compared models with a single effect, the best first."""
    alone = sorted((c for c in said["comparison"] if len(c["effects"]) == 1), key=lambda c: c["difference"])
    effects = [c["effects"][0] for c in alone]
    return [next((k for k, e in enumerate(effects, start=1) if is_one(e)), None) for is_one in named]


def _harm(case: Case, out: Path, answer: Mapping[str, Any]) -> Row:
    """Whether the model of an answer that names effects is no better than the re-identified file elsewhere.

    Both are simulated on the validation experiments, which have motions of another kind.
    """
    assert case.apart is not None
    model = out / str(answer.get("model", AUGMENTED))
    if answer["verdict"] not in NAMING or model.parent != out or not model.exists():
        return {"harmful": None}
    experiments, path = case.apart / VALIDATION, case.apart / BEFORE
    if not path.exists():
        study = head_to_head.Case(case.name, case.system, case.logs).study()
        gap = gap_on(FileParameters().fit(study).system, experiments, study.horizon)
        write_json(path, {"horizon": study.horizon, "gap": gap})
    before = read_json(path)
    after = gap_on(read_system(model), experiments, before["horizon"])
    usable = after is not None and before["gap"] is not None
    return {
        "harmful": after >= before["gap"] if usable else None,
        "validation": {"reidentified": before["gap"], "augmented": after},
    }


def answer(cases: str, number: int, entrant: Entrant, out: Path, cap: float = 300.0) -> Row | None:
    """Write the row of a case, by its number among `cases`, and return it; None if it was there.

    After `cap` CPU seconds the case counts as unanswered.
    """
    every = _drawn(cases, out)
    if not 0 <= number < len(every):
        raise BadInput(f"case: must be 0 to {len(every) - 1} of {cases}, got {number}")
    case = every[number]
    path = rows_of(out, entrant.name) / f"{case.name}.json"
    if path.exists():
        return None
    case.make()
    made = row(case, entrant, out / "answers" / entrant.name, cap)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, made)
    return made


@cache
def _drawn(cases: str, out: Path) -> list[Case]:
    """The cases, drawn once in a process that answers several."""
    return cases_of(cases, out)
