"""Diagnoses of measured machines as numbers and tables, and whether they agree with what is known."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.chapters.known import FILE, KNOWN_PHYSICS, SUFFIX, KnownCase, Machine, Reference
from pipeline.chapters.reported import read_told
from unmodelled.base.errors import BadInput
from unmodelled.base.shapes import ORIGIN, read_shaped

Report = Mapping[str, Any]

#: Verdicts that name effects.
ASSERTING = ("effect", "main_effect")


def named(effect: Mapping[str, Any]) -> str:
    """Return family and place of an effect, such as "coulomb_friction at rail"."""
    place = effect.get("port")
    return f"{effect['family']} at {place}" if place else str(effect["family"])


def asserted(report: Report) -> Sequence[Mapping[str, Any]]:
    """Return the effects that the verdict asserts."""
    effects: Sequence[Mapping[str, Any]] = report["effects"]
    return effects if report["verdict"] in ASSERTING else ()


def judged(case: KnownCase, report: Report) -> dict[str, Any]:
    """Return how a diagnosis compares with what is known."""
    effects = asserted(report)
    families = [frozenset(_family(name) for name in names) for names in case.effects]
    sayings = [_said(effect) for effect in effects]
    inside = [is_inside(reference, report) for reference in case.numbers]
    faults = [*_faults(case, report)]
    return {
        "names right": _count(_told(families, [frozenset(map(_family, names)) for names in sayings])),
        "places right": _count(_told(case.effects, sayings)),
        "numbers inside": _count([found for found in inside if found is not None]),
        "holds": "no" if faults else "yes",
        "harmful": "yes" if _is_harmful(case, report) else "no",
        "failed at": "; ".join(faults),
    }


def is_inside(reference: Reference, report: Report) -> bool | None:
    """Return whether a reference overlaps the 95 % interval of its number; None without interval."""
    identified = parameters(report).get((reference.of, reference.parameter))
    if identified is None or None in (interval := identified["interval"] or [None]):
        return None
    low, high = interval
    return bool(low <= reference.high and reference.low <= high)


def parameters(report: Report) -> dict[tuple[str, str], dict[str, Any]]:
    """Return the identified numbers by owner (effect, or known physics) and name."""
    own = {(KNOWN_PHYSICS, name): dict(values) for name, values in report["parameters"].items()}
    return own | {
        (named(effect), name): {"identified": values["value"], **values}
        for effect in report["effects"]
        for name, values in effect["parameters"].items()
    }


def _said(effect: Mapping[str, Any]) -> frozenset[str]:
    """Names of an effect and of those that the logs cannot distinguish from it."""
    return frozenset(map(named, (effect, *effect["indistinguishable"])))


def _told(wanted: Sequence[frozenset[str]], said: Sequence[frozenset[str]]) -> list[bool]:
    """For each wanted effect: whether it is said, as many as possible; one saying stands for one effect."""
    best = [False] * len(wanted)
    for chosen in permutations([*said, *[frozenset[str]()] * len(wanted)], len(wanted)):
        told = [bool(names & one) for names, one in zip(wanted, chosen, strict=True)]
        best = max(best, told, key=sum)
    return best


def _family(name: str) -> str:
    return name.partition(" at ")[0]


def _count(found: Sequence[bool]) -> str:
    return f"{sum(found)} of {len(found)}" if found else ""


def _is_harmful(case: KnownCase, report: Report) -> bool:
    if any(not case.right & _said(effect) for effect in asserted(report)):
        return True
    return report["verdict"] in ("no_gap", "check_logs") and report["verdict"] not in case.verdicts


def _faults(case: KnownCase, report: Report) -> Iterator[str]:
    """The parts of a diagnosis that failed, in the order in which a diagnosis goes through them."""
    verdict, effects = report["verdict"], asserted(report)
    if verdict in ("check_logs", "no_gap") and verdict not in case.verdicts:
        yield "check of the logs" if verdict == "check_logs" else "noise floor: the gap counts as noise"
        return
    told = _told(case.effects, [_said(effect) for effect in effects])
    missing = [names for names, found in zip(case.effects, told, strict=True) if not found]
    if verdict != "main_effect" or len(missing) == len(case.effects):
        yield from (_missed(names, report) for names in missing)
    for effect in effects:
        if not case.right & _said(effect):
            yield f"choice: {named(effect)} is not known of this machine"
    if verdict not in case.verdicts and not missing:
        yield f"verdict: must be {' or '.join(sorted(case.verdicts))}"


def _missed(names: frozenset[str], report: Report) -> str:
    name = " or ".join(sorted(names))
    if any(names & _said(effect) for effect in report["effects"]):
        return f"choice: one effect is named in place of {name} and another effect"
    tried = [c["difference"] for c in report["comparison"] if names & {*map(named, c["effects"])}]
    if tried:
        return (
            f"choice: {name} was fitted, its score is {min(tried):.3g} nats from that of the named candidate"
        )
    return f"search: {name} was not fitted"


GAPS = ("known", "reidentified", "augmented", "neural", "floor")
PROTOCOL = (
    "gap: free runs from the measured states on held-out experiments, in standard deviations of the outputs; "
    "shrink: share of the re-identified squared gap above the noise floor that the effects explain, with its "
    "95 % interval over experiments; remainder: augmented gap over noise floor; holds: verdict and effects "
    "agree with what is known of the machine from elsewhere; harmful: a wrong effect is asserted, or the "
    "answer ends the search although an effect is missing"
)


@dataclass(frozen=True)
class Diagnosed:
    """The diagnosis of one system file of a machine."""

    machine: str
    withheld: str  # physics that the system file leaves out
    case: KnownCase  # right answer
    report: Report  # content of diagnosis.json
    data: str  # measured or virtual

    @property
    def about(self) -> dict[str, str]:
        """First columns of every table."""
        return {"machine": self.machine, "withheld": self.withheld}


def read_diagnoses(folder: Path, machines: Sequence[Machine]) -> list[Diagnosed]:
    """Read `folder`/<machine>/<withheld>_withheld/diagnosis.json of all machines."""
    return [found for machine in machines for found in _read(folder / machine.name, machine)]


def _read(folder: Path, machine: Machine) -> Iterator[Diagnosed]:
    for path in sorted(folder.glob(f"[!.]*{SUFFIX}/diagnosis.json")):
        withheld = path.parent.name.removesuffix(SUFFIX)
        if withheld not in machine.cases:
            raise BadInput(f"{FILE} of {machine.name}: cases: {withheld} is missing, but {path} exists")
        report = read_told(path)
        if report["gap"]["floor"] <= 0.0 or len(report["gap"]["interval"]) != 2:
            raise BadInput(f"{path}: gap: floor must be positive, interval two numbers")
        data = str(read_shaped(path.parent / "tables" / "about.json", ORIGIN)["data"])
        yield Diagnosed(machine.name, withheld, machine.cases[withheld], report, data)


def leaves(report: Report) -> dict[str, Any]:
    """Return the numbers of one diagnosis."""
    gap = report["gap"]
    n = len(gap["held_out"])
    return {
        "verdict": {"value": report["verdict"], "n": n},
        "effects": {"value": said(report), "n": n},
        "confidence": {"value": report["confidence"], "unit": "1"},
        "shrink": {"value": gap["shrink"], "unit": "1", "n": n, **_limits(gap["interval"])},
        "remainder": {"value": gap["augmented"] / gap["floor"], "unit": "floors", "n": n},
        "gap": {
            kind: {"value": gap[kind], "unit": "standard deviations", "n": n}
            for kind in GAPS
            if gap[kind] is not None
        },
    }


def _limits(interval: Sequence[float | None]) -> dict[str, Any]:
    return {} if None in interval else {"interval": list(interval)}


def judgements(found: Sequence[Diagnosed], machines: Sequence[Machine]) -> pd.DataFrame:
    """Return a row per system file: what is known from elsewhere, what is said, and whether it holds.

    A system file without a diagnosis has a row that says how to give the data of its machine.
    """
    reports = {(one.machine, one.withheld): one.report for one in found}
    rows = []
    for machine in machines:
        for withheld, case in machine.cases.items():
            row = {"machine": machine.name, "withheld": withheld, "known from elsewhere": case.known}
            if (report := reports.get((machine.name, withheld))) is None:
                path = f"make real {machine.variable}=<zip file or folder>"
                rows.append({**row, "verdict": "not diagnosed", "effects": f"no data given: {path}"})
            else:
                told = {"verdict": report["verdict"], "effects": said(report)}
                rows.append({**row, **told, "confidence": report["confidence"], **judged(case, report)})
    columns = ["confidence", "names right", "places right", "numbers inside", "holds", "harmful", "failed at"]
    head = ["machine", "withheld", "known from elsewhere", "verdict", "effects"]
    return pd.DataFrame(rows, columns=[*head, *columns])


def gaps(found: Sequence[Diagnosed]) -> pd.DataFrame:
    """Return the gaps of every diagnosis, model by model."""
    rows = [
        {
            **one.about,
            **{kind: one.report["gap"][kind] for kind in GAPS},
            "shrink": one.report["gap"]["shrink"],
            "shrink low": one.report["gap"]["interval"][0],
            "shrink high": one.report["gap"]["interval"][1],
            "remainder / floor": one.report["gap"]["augmented"] / one.report["gap"]["floor"],
        }
        for one in found
    ]
    columns = [*GAPS, "shrink", "shrink low", "shrink high", "remainder / floor"]
    return pd.DataFrame(rows, columns=["machine", "withheld", *columns])


def numbers(found: Sequence[Diagnosed]) -> pd.DataFrame:
    """Return the identified numbers of the known physics and of the effects, with their references."""
    rows = [row for one in found for row in _numbers(one)]
    columns = ["of", "parameter", "unit", "given", "identified", "low", "high"]
    more = ["reference low", "reference high", "inside", "source"]
    return pd.DataFrame(rows, columns=["machine", "withheld", *columns, *more])


def _numbers(one: Diagnosed) -> Iterator[dict[str, Any]]:
    references = {(r.of, r.parameter): r for r in one.case.numbers}
    identified = parameters(one.report)
    for key in dict.fromkeys([*identified, *references]):
        values, reference = identified.get(key, {}), references.get(key)
        row: dict[str, Any] = {**one.about, "of": key[0], "parameter": key[1]}
        row |= {"unit": values.get("unit"), "given": values.get("known")}
        if values:
            low, high = values["interval"] or (None, None)
            row |= {"identified": values["identified"], "low": low, "high": high}
        if reference is not None:
            inside = {True: "yes", False: "no", None: "not identified"}[is_inside(reference, one.report)]
            row |= {"unit": reference.unit, "reference low": reference.low, "reference high": reference.high}
            row |= {"inside": inside, "source": reference.source}
        yield row


def left_over(found: Sequence[Diagnosed]) -> pd.DataFrame:
    """Return where the gap lies, the remaining gap of every held-out experiment, and the notes."""
    rows = [
        {**one.about, "kind": kind, "where": where, "share": share, "left": left}
        for one in found
        for kind, where, share, left in _places(one.report)
    ]
    return pd.DataFrame(rows, columns=["machine", "withheld", "kind", "where", "share", "left"])


def _places(report: Report) -> Iterator[tuple[str, str, float | None, float | None]]:
    where = report["where"]
    for c in where["channels"]:
        yield "channel", c["port"], c["share"], None
    for r in where["regions"]:
        yield "region", f"{r['signal']} from {r['low']:.3g} to {r['high']:.3g}", r["share"], None
    for f in where["factors"]:
        level = f["level"] if isinstance(f["level"], str) else f"{f['level']:.4g}"
        yield "factor", f"{f['factor']} = {level}", f["share"], None
    for e in where["experiments"]:
        yield "experiment", e["id"], None, e["augmented"]
    for note in report["notes"]:
        yield "note", note, None, None


def said(report: Report) -> str:
    """Return the effects of a diagnosis with their laws and the effects that are not told apart from them."""
    return "; ".join(map(_effect, report["effects"])) or "none"


def _effect(effect: Mapping[str, Any]) -> str:
    level = f" where {effect['factor']} = {effect['level']}" if "factor" in effect else ""
    alike = ", ".join(sorted(map(named, effect["indistinguishable"])))
    return f"{named(effect)}: {effect['law']}{level}" + (f" (or {alike})" if alike else "")
