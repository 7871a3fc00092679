"""One row of the bench: a case, the answer of a form, and how it compares with the truth."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.head_to_head import case as head_to_head
from benchmarks.head_to_head.ours import FileParameters
from benchmarks.search_bench.case import Case
from benchmarks.search_bench.form import Form
from pipeline.chapters import real_judged
from pipeline.chapters.reported import read_judged, read_told, read_truth
from pipeline.withheld.channels import parameter_channels
from pipeline.withheld.folders import TRUTH, VALIDATION
from pipeline.withheld.judging import Planted, judged
from pipeline.withheld.validation import gap_on
from unmodelled.base.files import read_json, write_json
from unmodelled.systems.reader import read_system

Row = dict[str, Any]
#: Files of an answer: that of the diagnosis, and the system with the effects found.
ANSWER, AUGMENTED = "diagnosis.json", "augmented_system.yaml"
#: Of a case: gaps without effects on its validation experiments, by horizon.
BEFORE = "before.json"
#: What `judged` says of a case that goes into the row.
JUDGED = ("truth", "first", "exact", "right", "material", "material_named", "reidentified")


def row(case: Case, form: Form, answers: Path, cap: float) -> Row:
    """Diagnose a case by one form in a fresh process, and return its row.

    Args:
        case: case, whose files are there.
        form: form of the diagnosis.
        answers: folder that keeps diagnosis.json, the augmented system and the log of the case.
        cap: CPU seconds after which the case counts as unanswered.

    Returns:
        case, kind, form, revision, digest (of system file and logs), truth, cpu (s), wall (s), memory (MB)
        and error ("" or the reason why there is no answer); with an answer those of `told` and `compared`.
    """
    answers.mkdir(parents=True, exist_ok=True)
    out = answers / case.name
    shutil.rmtree(out, ignore_errors=True)
    run = form.run(case.system, case.logs, out, cap)
    found: Row = {"case": case.name, "kind": case.kind, "form": form.name, "revision": form.revision}
    found |= {"digest": case.digest(), "truth": case.truth, "cpu": run.cpu, "wall": run.wall}
    found |= {"memory": run.memory, "error": run.error}
    if not run.error:
        try:
            found |= told(out / ANSWER) | compared(case, out)
        except Exception as fault:  # a form that writes another file must not end the bench
            found["error"] = f"not judged: {type(fault).__name__}: {fault}"[:300]
    for path in out.glob("*"):  # figures and pages take a hundred times the room
        if path.is_dir():
            shutil.rmtree(path)
        elif path.name not in (ANSWER, AUGMENTED):
            path.unlink()
    return found


def told(path: Path) -> Row:
    """Return the answer: verdict, confidence, effects with places, gaps before and after.

    Args:
        path: diagnosis.json.
    """
    said = read_told(path)
    gap = {name: said["gap"][name] for name in ("known", "augmented", "floor")}
    effects = [[*_named(e)] for e in said["effects"]]
    alike = [[[*_named(o)] for o in e["indistinguishable"]] for e in said["effects"]]
    text = " + ".join(map(_text, said["effects"])) or said["verdict"]
    more = {"confidence": said["confidence"], "said": text, "effects": effects, "alike": alike}
    return {"verdict": said["verdict"], **more, "gap": gap}


def compared(case: Case, out: Path) -> Row:
    """Return how an answer compares with the truth.

    Args:
        case: case.
        out: folder of the answer.

    Returns:
        rank (of every planted effect alone, among the compared models with a single effect; None where it is
        not compared), seen (of every planted effect), first, in_set (all planted effects named or listed as
        indistinguishable), exact, right, material and material_named (numbers of effects), harmful; empty for
        cases without a truth that a program reads. An effect counts as seen where it is material: the refit
        with known effects of the published tables takes longer than the diagnosis.
    """
    if case.known is not None:
        return _of_real(case, read_told(out / ANSWER))
    if not (case.folder / TRUTH).exists():
        return {}
    truth, said = read_truth(case.folder / TRUTH), read_judged(out / ANSWER)
    acts_at = parameter_channels(read_system(case.system))
    seen = [bool(effect.get("material", True)) for effect in truth["effects"]]
    refit = {"oracle": {"seen": seen, "gap_seen": True, "shrink": 1.0}, "sparse_regression": None}
    validation = _validation(case, out, said)
    found = judged(truth, said, refit, acts_at, validation)
    planted = [Planted.of(effect, True) for effect in truth["effects"]]
    names: list[Callable[[Mapping[str, Any]], bool]] = [
        lambda one, p=p: p.is_named(one, acts_at)  # type: ignore[misc]
        for p in planted
    ]
    rows = {name: found[name] for name in JUDGED} | {"in_set": found["all_reported"]}
    rows |= {"rank": _ranks(said, names), "seen": seen, "validation": validation}
    return {**rows, "harmful": found["harmful"]}


def _of_real(case: Case, said: Mapping[str, Any]) -> Row:
    """Of a measured machine: `right` is whether the answer holds."""
    assert case.known is not None
    wanted, asserted = case.known.effects, real_judged.asserted(said)
    found = real_judged.judged(case.known, said)
    names = [{*map(real_judged.named, (e, *e["indistinguishable"]))} for e in asserted]
    first = bool(asserted) and any(real_judged.named(asserted[0]) in one for one in wanted)
    held = [any(one & said for said in names) for one in wanted]
    tests: list[Callable[[Mapping[str, Any]], bool]] = [
        lambda e, one=one: real_judged.named(e) in one  # type: ignore[misc]
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


def _validation(case: Case, out: Path, said: Mapping[str, Any]) -> dict[str, float | None] | None:
    """Gaps on the validation experiments without effects and with those of an answer that names some."""
    folder, horizon = case.folder / VALIDATION, said["gap"]["horizon"]
    if said["verdict"] not in ("effect", "main_effect") or not folder.exists():
        return None
    if not (out / AUGMENTED).exists():
        return {"reidentified": None, "augmented": None}
    known, key = read_json(path) if (path := case.folder / BEFORE).exists() else {}, f"{horizon:.9g}"
    if key not in known:
        study = head_to_head.Case(case.name, case.system, case.logs).study()
        known[key] = gap_on(FileParameters().fit(study).system, folder, horizon)
        write_json(path, known)
    return {"reidentified": known[key], "augmented": gap_on(read_system(out / AUGMENTED), folder, horizon)}


def _text(effect: Mapping[str, Any]) -> str:
    more = len(effect["indistinguishable"])
    return real_judged.named(effect) + (f" (or {more} more)" if more else "")


def _named(effect: Mapping[str, Any]) -> Iterator[str]:
    yield effect["family"]
    yield effect.get("port") or ""


def add_row(path: Path, one: Row) -> None:
    """Add a row to a file, on a line of its own even if a killed run left the last one unfinished.

    Args:
        path: file with a row per line; made if it is missing.
        one: the row.
    """
    before = path.read_text() if path.exists() else ""
    with path.open("a") as rows:
        rows.write(("\n" if before and not before.endswith("\n") else "") + json.dumps(one) + "\n")


def read_rows(path: Path) -> dict[str, Row]:
    """Return the rows of a file by case; a line that a killed run left unfinished is left out.

    Args:
        path: file with a row per line; may be missing.
    """
    found = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            one = json.loads(line)
        except json.JSONDecodeError:
            continue
        found[str(one["case"])] = one
    return found
