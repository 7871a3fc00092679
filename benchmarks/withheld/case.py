"""Cases of the benchmark: a folder with a system file and logs, and nothing else; the truth is kept apart."""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from benchmarks.withheld.wrong_logs import FAULTS, Fault
from pipeline.chapters.known import KnownCase
from pipeline.rigs.withheld.chain.campaign import write_measured
from pipeline.rigs.withheld.chain.case import MeasuredCase
from pipeline.rigs.withheld.chain.drawing import measured_cases
from pipeline.withheld.channels import parameter_channels
from pipeline.withheld.folders import LOGS, SYSTEM, TRUTH
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.diagnosis.doubts.usual_mistakes import MISTAKES
from unmodelled.systems.reader import read_system

#: Kinds of one seed with their numbers of cases: those of the published tables (docs/diagnosis).
SHARES: Mapping[str, int] = {"null": 6, "single": 8, "pair": 4, "several": 3, "outside": 3}
#: The same of machines without inertia, and the kinds that these are in tables.
BALANCES: Mapping[str, int] = {"balance_null": 4, "balance": 8}
#: The same of machines of other kinds.
FURTHER: Mapping[str, int] = {f"further_{kind}": many for kind, many in SHARES.items()}
AS = {"balance_null": "null", "balance": "single"} | {f"further_{kind}": kind for kind in SHARES}
#: Family of a wrong number, and share of those that are wrong by a usual mistake of units.
FAMILY, MISTAKEN = "parameter_error", 0.25


@dataclass(frozen=True)
class Case:
    """A case whose files are made when they are needed."""

    name: str
    kind: str  # in the tables, see `table.KINDS`
    system: Path
    logs: Path
    make: Callable[[], object] = lambda: None  # writes the files of the case if they are not there
    apart: Path | None = None  # folder of truth.json and of the validation experiments
    truth: str = ""  # right answer in words, without truth.json
    known: KnownCase | None = None  # right answer of a measured machine

    def digest(self) -> str:
        """Return the digest of the system file and the logs."""
        files = [self.system, *sorted(p for p in self.logs.rglob("*") if p.is_file())]
        return hashlib.sha256(b"".join(p.read_bytes() for p in files)).hexdigest()[:12]


def cases_of(word: str, folder: Path) -> list[Case]:
    """Return the cases that a word names, made in folder/cases/<name> and folder/truth/<name>.

    The word is TRACK:SEED:COUNT for virtual machines, `real:FOLDER` or `field:FOLDER`.
    """
    track, _, rest = word.partition(":")
    virtual: dict[str, Callable[[int, int, Path], list[Case]]] = {
        "planted": planted,
        "further": partial(planted, shares=FURTHER),
        "balance": partial(planted, shares=BALANCES),
        "number": wrong_numbers,
        "wrong_logs": wrong_logs,
    }
    if (found := re.fullmatch(r"(\d+):(\d+)", rest)) and track in virtual:
        return virtual[track](int(found[1]), int(found[2]), folder)
    if track in ("real", "field") and Path(rest).is_dir():
        from benchmarks.withheld import measured

        make = measured.real if track == "real" else measured.field
        return list(make(Path(rest).resolve(), folder / "cases" / track))
    words = ", ".join(f"{track}:SEED:COUNT" for track in virtual)
    raise BadInput(f"cases: must be {words}, real:FOLDER or field:FOLDER, got {word!r}")


def planted(seed: int, count: int, folder: Path, shares: Mapping[str, int] = SHARES) -> list[Case]:
    """Return virtual machines with measurement chains, the kinds mixed so that any first part has all kinds.

    A seed has as many cases as the shares say, 24 by default; further ones have the next seed.
    """
    found: list[Case] = []
    for k in range(-(-count // sum(shares.values()))):
        placed = [
            ((i + 0.5) / many, kind, i, case)
            for kind, many in shares.items()
            for i, case in enumerate(measured_cases(kind, many, seed + k))
        ]
        for _, kind, i, case in sorted(placed, key=lambda each: each[:3]):
            name = f"{seed + k}_{kind}_{i + 1:02d}"
            found.append(_virtual(name, AS.get(kind, kind), case, folder))
    return found[:count]


def wrong_numbers(seed: int, count: int, folder: Path) -> list[Case]:
    """Return virtual machines with one effect or none, whose file has a wrong number that it calls known."""
    found = []
    for k, kind, i, case in _few(seed, count):
        change = partial(_wrong_number, seed=[k, i, len(kind)])
        found.append(_virtual(f"{k}_number_{kind}_{i + 1:02d}", "number", case, folder, change))
    return found[:count]


def wrong_logs(seed: int, count: int, folder: Path) -> list[Case]:
    """Return virtual machines with one effect or none whose logs are wrong, each with its faultless twin."""
    found = []
    for n, (k, kind, i, case) in enumerate(_few(seed, -(-count // 2))):
        fault, name = FAULTS[(seed + n) % len(FAULTS)], f"{k}_{kind}_{i + 1:02d}"
        change = partial(_wrong_log, fault=fault, seed=[k, i, len(kind)])
        found.append(_virtual(f"{name}_{fault.name}", "wrong_logs", case, folder, change))
        found.append(_virtual(f"{name}_twin", "twin", case, folder))
    return found[:count]


def _few(seed: int, count: int) -> Iterator[tuple[int, str, int, MeasuredCase]]:
    """Seed, kind, number and case of machines with one effect or none."""
    for k in range(seed, seed + -(-count // (SHARES["null"] + SHARES["single"]))):
        for kind in ("null", "single"):
            for i, case in enumerate(measured_cases(kind, SHARES[kind], k)):
                yield k, kind, i, case


def _virtual(
    name: str, kind: str, case: MeasuredCase, folder: Path, change: Callable[[Path], object] | None = None
) -> Case:
    own, apart = folder / "cases" / name, folder / "truth" / name
    make = partial(once, own, partial(_write, case, own, apart, change))
    return Case(name, kind, own / SYSTEM, own / LOGS, make, apart)


def _write(
    case: MeasuredCase, folder: Path, apart: Path, change: Callable[[Path], object] | None = None
) -> None:
    """Write a case, change its files, and part system file and logs from the truth.

    Jobs side by side may write the same case: each writes its own folders, and the first is kept.
    """
    apart.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".", dir=folder.parent) as own:
        told, begun = Path(own) / "truth", Path(own) / "case"
        write_measured(case, told)
        if change is not None:
            change(told)
        acts_at = parameter_channels(read_system(told / SYSTEM))
        truth = read_json(told / TRUTH) | {"acts_at": {name: sorted(at) for name, at in acts_at.items()}}
        write_json(told / TRUTH, truth)
        begun.mkdir()
        for name in (SYSTEM, LOGS):
            shutil.move(told / name, begun / name)
        for made, place in ((told, apart), (begun, folder)):
            try:
                made.rename(place)
            except OSError:
                if not place.exists():
                    raise


def _wrong_number(folder: Path, seed: Sequence[int]) -> None:
    """Change a known number of the file: by 10 to 40 %, or by a usual mistake of units."""
    rng, path = np.random.default_rng(seed), folder / SYSTEM
    content, truth = yaml.safe_load(path.read_text()), read_json(folder / TRUTH)
    sure = ((n, p) for n, p in content["parameters"].items() if not p.get("identify"))
    known = {n: p for n, p in sure if n != "g" and p["value"] != 0.0}
    if not known:  # a machine of which all numbers are uncertain
        return
    name = rng.choice(sorted(known))
    usual = rng.choice([*MISTAKES]) ** rng.choice([-1.0, 1.0])
    factor = usual if rng.random() < MISTAKEN else np.exp(rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.4))
    known[name]["value"] *= float(factor)
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    wrong = {"family": FAMILY, "channel": f"parameter:{name}", "parameters": {name: 1.0 / factor}}
    truth["effects"].append({**wrong, "alike": [], "share": 1.0, "material": True})
    write_json(folder / TRUTH, truth)


def _wrong_log(folder: Path, fault: Fault, seed: Sequence[int]) -> None:
    """Plant a fault in the logs; if it is safe to cure, the right answer stays that of the twin."""
    at = fault.plant(read_system(folder / SYSTEM), folder / LOGS, np.random.default_rng(seed))
    fault_row = {"problem": fault.name, "channels": at, "decides": fault.decides}
    write_json(folder / TRUTH, read_json(folder / TRUTH) | {"fault": fault_row})


def once(folder: Path, make: Callable[[], object]) -> None:
    """Make a folder unless it is there."""
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        make()
