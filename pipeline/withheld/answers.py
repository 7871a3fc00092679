"""Read the diagnoses of withheld cases together with the planted effects."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pipeline.chapters.reported import read_judged, read_refit, read_truth, read_validation
from pipeline.withheld.channels import parameter_channels
from pipeline.withheld.folders import SYSTEM, TRUTH, VALIDATION, campaigns_in, cases_in
from pipeline.withheld.judging import ANSWERS, NAMING, ActsAt, Case, Content, Planted, in_words
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.data.gap import shrink
from unmodelled.systems.reader import read_system


def answers(
    cases: Path, diagnoses: Path, refits: Path
) -> Iterator[tuple[Path, dict[str, Any], dict[str, Any]]]:
    """Return place <campaign>/<case>, diagnosis.json and table row (see `judged`) of every case."""
    for case in (case for campaign in campaigns_in(cases) for case in cases_in(campaign)):
        place = case.relative_to(cases)
        name = f"{case.name}.json"
        yield place, *answer(case, diagnoses / place.parent / name, refits / place.parent / name)


def answer(case: Path, diagnosis: Path, refit: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the content of diagnosis.json and the table row (see `judged`) of a case."""
    said, truth, best = read_judged(diagnosis), read_truth(case / TRUTH), read_refit(refit)
    if len(best["oracle"]["seen"]) != len(truth["effects"]):
        raise BadInput(f"{refit}: oracle.seen: must have {len(truth['effects'])} entries, as many as planted")
    acts_at = parameter_channels(read_system(case / SYSTEM))
    errors = diagnosis.parent / VALIDATION / diagnosis.name
    validation = read_validation(errors) if (case / VALIDATION).exists() else None
    return said, judged(truth, said, best, acts_at, validation)


def judged(
    truth: Content, diagnosis: Content, refit: Content, acts_at: ActsAt, validation: Content | None = None
) -> dict[str, Any]:
    """Return a row of the table of cases."""
    best = refit["oracle"]
    case = Case.of(truth, diagnosis, acts_at, best["seen"], best["gap_seen"])
    planted, gap = case.planted, diagnosis["gap"]
    return {
        "system": truth["system"],
        "level": truth["level"],
        "family": planted[0].family if planted else "none",
        "truth": case.truth,
        "verdict": case.verdict,
        "said": in_words(case),
        "first_family": case.named[0]["family"] if case.named else case.verdict,
        "confidence": diagnosis["confidence"],
        "seen": best["gap_seen"] if case.outside else all(p.seen for p in planted),
        **{name: getattr(case, name) for name in ANSWERS},
        "right": case.right,
        "set_size": sum(map(len, case.reported)) / max(len(case.named), 1),
        "reidentified": gap["reidentified"],
        "floor": gap["floor"],
        "shrink": gap["shrink"],
        "oracle_shrink": best["shrink"],
        "network_shrink": shrink(gap["reidentified"], gap["neural"], gap["floor"]),
        "sparse_first": _sparse(planted, refit["sparse_regression"]),
        "material": len(case.material),
        "material_named": sum(case.material),
        **_coverage(truth.get("parameters", {}), diagnosis.get("parameters", {})),
        "harmful": _harmful(diagnosis, validation),
    }


def _coverage(true: Content, identified: Content) -> dict[str, int]:
    intervals = [
        (values["true"], identified[name]["interval"])
        for name, values in true.items()
        if identified.get(name, {}).get("interval") and None not in identified[name]["interval"]
    ]
    covered = sum(low <= value <= high for value, (low, high) in intervals)
    return {"intervals": len(intervals), "covered": covered}


def _harmful(diagnosis: Content, validation: Content | None) -> bool | None:
    if validation is None or diagnosis["verdict"] not in NAMING or validation["augmented"] is None:
        return None
    return bool(validation["augmented"] >= validation["reidentified"])


def _sparse(planted: Sequence[Planted], term: Content | None) -> bool:
    if term is None:
        return not planted
    return any((term["family"], term["channel"]) in p.answers for p in planted)
