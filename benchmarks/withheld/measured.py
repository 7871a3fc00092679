"""Measured machines and reported inputs, from folders that the user has."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from fnmatch import fnmatch
from functools import partial
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

import yaml

from benchmarks.withheld.case import Case, once
from pipeline.chapters.known import SUFFIX, read_machine
from pipeline.recordings.archive import Archive
from pipeline.withheld.folders import LOGS
from unmodelled.base.errors import BadInput

ROOT = Path(__file__).parents[2]
#: Files, and bytes in all of them, that are unpacked of an archive.
MOST_FILES, MOST_BYTES = 10_000, 200_000_000
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


def real(archives: Path, folder: Path) -> Iterator[Case]:
    """Yield the measured machines of the project, and archives that bring system files and logs."""
    for name, archive in ARCHIVES.items():
        machine, own = read_machine(ROOT / "systems" / name), folder / name
        data = Path(os.environ.get(machine.variable) or archives / archive)
        if data.exists():
            make = partial(once, own, partial(_acquired, name, machine.variable, data, own))
            for system in sorted((ROOT / "systems" / name).glob(f"*{SUFFIX}.yaml")):
                known = machine.cases[part := system.stem.removesuffix(SUFFIX)]
                case = f"{name}_{part}"
                yield Case(case, "real", system, own, make, None, known.known, known)
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
    """System files beside a known.md at the top of an archive, or in folders there.

    `small_x.yaml` has the logs `logs_small` where these exist.
    """
    archive, top = Archive(str(path), ""), PurePosixPath(path.stem)
    if top.name in ("", ".."):
        raise BadInput(f"{path}: must have a name, which its folder gets: rename it")
    if len(archive.members) > MOST_FILES:  # each is compared with others, before anything is unpacked
        raise BadInput(f"{path}: has {len(archive.members)} files, at most {MOST_FILES}: give fewer logs")
    members = [PurePosixPath(name) for name in archive.members]
    if top / "known.md" in members:
        yield from _at_top(archive, members, folder / path.stem)
        return
    for about in sorted(p for p in members if p.name == "known.md" and p.parent.parent == top):
        own, text = folder / path.stem, archive.read(str(about)).decode(errors="replace")
        at, make = own / about.parent.name, partial(once, own, partial(_unpack, archive, own))
        name = f"{path.stem}_{about.parent.name}"
        yield Case(name, "archive", at / "system.yaml", at / LOGS, make, None, _points(text))


def _points(text: str) -> str:
    """The right answers of a case, from the points that begin with **Right."""
    points = [" ".join(point.split()) for point in text.split("\n- ")]
    return ". ".join(p.partition(":")[2].strip() for p in points if p.startswith("**Right"))


def _at_top(archive: Archive, members: Sequence[PurePosixPath], folder: Path) -> Iterator[Case]:
    top = PurePosixPath(folder.name)
    text = archive.read(str(top / "known.md")).decode(errors="replace")
    for system in sorted(p for p in members if p.parent == top and p.suffix == ".yaml"):
        logs = f"logs_{system.stem.split('_')[0]}"
        logs = logs if any((top / logs) in p.parents for p in members) else LOGS
        make = partial(once, folder, partial(_unpack, archive, folder))
        name, right = f"{folder.name}_{system.stem}", _right(text, system.name)
        yield Case(name, "archive", folder / system.name, folder / logs, make, None, right)


def _unpack(archive: Archive, folder: Path) -> None:
    """Write the files below the top folder of an archive into a folder, which appears with all of them."""
    top = PurePosixPath(folder.name)
    files = {PurePosixPath(name).relative_to(top): name for name in archive.members if _is_below(name, top)}
    size = sum(map(archive.size, files.values()))
    if size > MOST_BYTES:
        most = f"at most {MOST_BYTES / 1e6:.0f} MB are unpacked: give fewer logs"
        raise BadInput(f"{archive.path}: has {len(files)} files of {size / 1e6:.0f} MB, {most}")
    with TemporaryDirectory(dir=folder.parent) as temporary:
        whole = Path(temporary) / folder.name
        try:
            for file, name in files.items():
                (whole / file).parent.mkdir(parents=True, exist_ok=True)
                (whole / file).write_bytes(archive.read(name, 1.0))
            whole.rename(folder)
        except OSError as error:  # a file where another member needs a folder, a name that is too long
            if not folder.exists():  # another job was faster
                raise BadInput(f"{archive.path}: {name}: cannot be unpacked: {error.strerror}") from None


def _is_below(name: str, top: PurePosixPath) -> bool:
    path = PurePosixPath(name)
    return top in path.parents and ".." not in path.parts


def _right(text: str, system: str) -> str:
    """The right answer for a system file, from the list below `## Right answers`."""
    section = text.partition("## Right answers")[2].partition("\n## ")[0]
    points = [" ".join(point.split()) for point in section.split("\n- ")]
    named = [p for p in points if any(fnmatch(system, f"{n}*") for n in re.findall(r"^`([^`]+)`", p))]
    return " ".join(named) or " ".join(section.split())


def field(reports: Path, folder: Path) -> Iterator[Case]:
    """Yield the inputs that every make.py of a folder writes; right answers come from its README.md."""
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(reports, folder, copy_function=shutil.copyfile)
        for path in (folder, *(p for p in folder.rglob("*") if p.is_dir())):
            path.chmod(0o755)
        for script in sorted(folder.glob("*/make.py")):
            call = [sys.executable, script.name]
            made = subprocess.run(call, cwd=script.parent, capture_output=True, text=True)
            if made.returncode:
                print(f"field: {script.parent.name}: {made.stderr.strip().splitlines()[-1]}", file=sys.stderr)
    rows = [line.split("|") for line in (folder / "README.md").read_text().splitlines()]
    right = {row[1].strip(): row[3].strip() for row in rows if len(row) > 3}
    for own in sorted(script.parent for script in folder.glob("*/make.py")):
        systems = [p for p in sorted(own.glob("*.yaml")) if _is_system(p)]
        logs = [p for p in sorted(own.iterdir()) if p.is_dir() and any(p.rglob("*.csv"))]
        for system, log in ((s, p) for s in systems for p in logs):
            name = f"{own.name}_{system.stem}_{log.name}"
            yield Case(name, "field", system, log, truth=right.get(own.name, ""))


def _is_system(path: Path) -> bool:
    """Whether a file is a system file that does not have the answer in it."""
    return "oracle" not in path.stem and "schema" in (yaml.safe_load(path.read_text()) or {})
