"""Cases of the bench: virtual machines with measurement chains, measured machines and reported inputs."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import partial
from pathlib import Path

import numpy as np
import yaml

from pipeline.chapters.known import SUFFIX, KnownCase, read_machine
from pipeline.rigs.withheld.chain.campaign import write_measured
from pipeline.rigs.withheld.chain.case import MeasuredCase
from pipeline.rigs.withheld.chain.drawing import measured_cases
from pipeline.withheld.folders import LOGS, SYSTEM, TRUTH
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.diagnosis.decide.usual_mistakes import MISTAKES

ROOT = Path(__file__).parents[2]
#: Kinds of one seed with their numbers of cases: those of the published tables (docs/diagnosis).
SHARES: Mapping[str, int] = {"null": 6, "single": 8, "pair": 4, "several": 3, "outside": 3}
#: Family of a wrong number, and share of those that are wrong by a usual mistake of units.
FAMILY, MISTAKEN = "parameter_error", 0.25
#: Names of the published archives in a folder of them; a variable of `make real` goes first.
ARCHIVES = {
    "xl330": "bam_xl330.zip",
    "so101": "so101.zip",
    "ur10e_joint": "ur10e.zip",
    "double_pendulum": "double_pendulum_a0.zip",
    "silverbox": "silverbox.zip",
    "cascaded_tanks": "cascaded_tanks.zip",
    "emps": "../emps",
    "cam_drivetrain": "../cam-follower-dataset.zip",
}


@dataclass(frozen=True)
class Case:
    """A case whose files are made when they are needed.

    Attributes:
        name: name of the case.
        kind: kind in the tables: null, single, pair, several, outside, real, archive or field.
        folder: folder of the case; of a virtual machine it holds truth.json and validation/ too.
        system: system file.
        logs: log folder.
        make: writes the files of the case if they are not there; default: does nothing.
        truth: right answer in words, for cases without truth.json; default "".
        known: right answer of a measured machine; default None.
    """

    name: str
    kind: str
    folder: Path
    system: Path
    logs: Path
    make: Callable[[], object] = lambda: None
    truth: str = ""
    known: KnownCase | None = None

    def digest(self) -> str:
        """Return the digest of the system file and the logs."""
        files = [self.system, *sorted(p for p in self.logs.rglob("*") if p.is_file())]
        return hashlib.sha256(b"".join(p.read_bytes() for p in files)).hexdigest()[:12]


def cases_of(word: str, folder: Path) -> list[Case]:
    """Return the cases that a word names.

    Args:
        word: `withheld:SEED:COUNT`, `number:SEED:COUNT`, `real:FOLDER` or `field:FOLDER`.
        folder: folder in which the files of the cases are made.

    Raises:
        BadInput: when the word names no cases.
    """
    kind, _, rest = word.partition(":")
    if found := re.fullmatch(r"(\d+):(\d+)", rest):
        seed, count = int(found[1]), int(found[2])
        if kind == "withheld":
            return withheld(seed, count, folder / "withheld")
        if kind == "number":
            return wrong_numbers(seed, count, folder / "number")
    if kind in ("real", "field") and Path(rest).is_dir():
        make = real if kind == "real" else field
        return list(make(Path(rest).resolve(), folder / kind))
    raise BadInput(
        f"cases: must be withheld:SEED:COUNT, number:SEED:COUNT, real:FOLDER or field:FOLDER, got {word!r}"
    )


def withheld(seed: int, count: int, folder: Path) -> list[Case]:
    """Return virtual machines with measurement chains, the kinds mixed so that any first part has all kinds.

    A seed has 24 cases, in the shares of the published tables; the next 24 have the next seed.

    Args:
        seed: seed of the first 24 cases.
        count: number of cases.
        folder: folder of the cases.
    """
    found: list[Case] = []
    for k in range(-(-count // sum(SHARES.values()))):
        placed = [
            ((i + 0.5) / many, kind, i, case)
            for kind, many in SHARES.items()
            for i, case in enumerate(measured_cases(kind, many, seed + k))
        ]
        for _, kind, i, case in sorted(placed, key=lambda each: each[:3]):
            own = folder / f"{seed + k}_{kind}_{i + 1:02d}"
            make = partial(_once, own, partial(write_measured, case, own))
            found.append(Case(own.name, kind, own, own / SYSTEM, own / LOGS, make))
    return found[:count]


def wrong_numbers(seed: int, count: int, folder: Path) -> list[Case]:
    """Return virtual machines with one effect or none, whose file has a wrong number that it calls known."""
    found = []
    for k in range(-(-count // (SHARES["null"] + SHARES["single"]))):
        for kind in ("null", "single"):
            for i, case in enumerate(measured_cases(kind, SHARES[kind], seed + k)):
                own = folder / f"{seed + k}_number_{kind}_{i + 1:02d}"
                make = partial(_once, own, partial(_with_wrong_number, case, own, [seed + k, i, len(kind)]))
                found.append(Case(own.name, "number", own, own / SYSTEM, own / LOGS, make))
    return found[:count]


def _with_wrong_number(case: MeasuredCase, folder: Path, seed: Sequence[int]) -> None:
    """Write a case, then change a known number of its file: by 10 to 40 %, or by a usual mistake of units."""
    write_measured(case, folder)
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
    planted = {"family": FAMILY, "channel": f"parameter:{name}", "parameters": {name: 1.0 / factor}}
    truth["effects"].append({**planted, "alike": [], "share": 1.0, "material": True})
    write_json(folder / TRUTH, truth)


def _once(folder: Path, make: Callable[[], object]) -> None:
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        make()


def real(archives: Path, folder: Path) -> Iterator[Case]:
    """Yield the measured machines of the project, and archives that bring system files and logs of their own.

    Args:
        archives: folder of published archives.
        folder: folder of the cases.
    """
    for name, archive in ARCHIVES.items():
        machine, own = read_machine(ROOT / "systems" / name), folder / name
        data = Path(os.environ.get(machine.variable) or archives / archive)
        if data.exists():
            make = partial(_once, own, partial(_acquired, name, machine.variable, data, own))
            for system in sorted((ROOT / "systems" / name).glob(f"*{SUFFIX}.yaml")):
                known = machine.cases[part := system.stem.removesuffix(SUFFIX)]
                case = f"{name}_{part}"
                yield Case(case, "real", own, system, own, make, known.known, known)
    for path in sorted(archives.glob("*.zip")):
        yield from _archived(path, folder / "archives")


def _acquired(name: str, variable: str, data: Path, out: Path) -> None:
    """Convert a published archive to a log folder, as `make real` does it."""
    words = [["acquire", f"source={name}", f"out={out}"]]
    if name == "cam_drivetrain":  # sixteen runs of a campaign that is read as a whole
        raw, read = out.with_name("campaign_raw"), out.with_name("campaign")
        words = [
            ["acquire", "source=measured", f"out={raw}"],
            ["ingest", f"raw={raw}", f"out={read}"],
            [*words[0], f"source.trajectories={read}"],
        ]
    for call in words:
        command = [sys.executable, "-m", "pipeline", call[0], "-q", *call[1:]]
        subprocess.run(command, check=True, cwd=ROOT, env={**os.environ, variable: str(data.resolve())})


def _archived(path: Path, folder: Path) -> Iterator[Case]:
    """System files at the top of an archive; `small_x.yaml` has the logs `logs_small` where these exist."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        about = f"{path.stem}/known.md"
        if about not in names:
            return
        text = archive.read(about).decode()
    systems = [Path(n) for n in names if re.fullmatch(rf"{path.stem}/[^/]+\.yaml", n)]
    for system in sorted(systems):
        logs = f"logs_{system.stem.split('_')[0]}"
        logs = logs if any(n.startswith(f"{path.stem}/{logs}/") for n in names) else LOGS
        own = folder / path.stem
        make = partial(_once, own, partial(shutil.unpack_archive, path, folder))
        name, right = f"{path.stem}_{system.stem}", _right(text, system.name)
        yield Case(name, "archive", own, own / system.name, own / logs, make, right)


def _right(text: str, system: str) -> str:
    """The right answer for a system file, from the list below `## Right answers`."""
    section = text.partition("## Right answers")[2].partition("\n## ")[0]
    points = [" ".join(point.split()) for point in section.split("\n- ")]
    named = [p for p in points if any(fnmatch(system, f"{n}*") for n in re.findall(r"^`([^`]+)`", p))]
    return " ".join(named) or " ".join(section.split())


def field(reports: Path, folder: Path) -> Iterator[Case]:
    """Yield the inputs that every make.py of a folder writes; right answers come from its README.md.

    Args:
        reports: folder of folders with make.py.
        folder: folder into which all of it is copied.
    """
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(reports, folder, copy_function=shutil.copyfile)
        for path in (folder, *(p for p in folder.rglob("*") if p.is_dir())):
            path.chmod(0o755)
        for script in sorted(folder.glob("*/make.py")):
            made = subprocess.run(
                [sys.executable, script.name], cwd=script.parent, capture_output=True, text=True
            )
            if made.returncode:
                print(f"field: {script.parent.name}: {made.stderr.strip().splitlines()[-1]}", file=sys.stderr)
    rows = [line.split("|") for line in (folder / "README.md").read_text().splitlines()]
    right = {row[1].strip(): row[3].strip() for row in rows if len(row) > 3}
    for own in sorted(script.parent for script in folder.glob("*/make.py")):
        systems = [p for p in sorted(own.glob("*.yaml")) if _is_system(p)]
        logs = [p for p in sorted(own.iterdir()) if p.is_dir() and any(p.rglob("*.csv"))]
        for system, log in ((s, p) for s in systems for p in logs):
            name = f"{own.name}_{system.stem}_{log.name}"
            yield Case(name, "field", own, system, log, truth=right.get(own.name, ""))


def _is_system(path: Path) -> bool:
    """Whether a file is a system file that does not have the answer in it."""
    return "oracle" not in path.stem and "schema" in (yaml.safe_load(path.read_text()) or {})
