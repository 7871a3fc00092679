"""Get the raw logs of a campaign: simulate them on a virtual rig, or fetch what was measured."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.errors import BadInput
from pipeline.files import replacing, replacing_folder, write_json
from pipeline.rawlogs import Archive


def acquire(source: Mapping[str, Any], seed: int, out: Path) -> None:
    """Write `out`/campaign.zip (raw logs) and `out`/provenance.json (where they come from).

    Args:
        source: `kind: virtual` with the levels of the four factors, or `kind: measured` with `dataset`
            (a folder, the zip as downloaded, or nothing: fetched with `dvc get`), `url` and `revision`.
        seed: of a virtual campaign.
        out: folder, replaced as a whole.

    Raises:
        BadInput: when the data set cannot be found, fetched or read.
    """
    with replacing_folder(out) as folder:
        archive = folder / "campaign.zip"
        if source["kind"] == "virtual":
            provenance = _simulate(source, seed, archive)
        elif source["kind"] == "measured":
            provenance = _fetch(source, archive)
        else:
            raise BadInput(f"source.kind must be virtual or measured, got {source['kind']}")
        experiments = len(Archive(archive).parameters())
        digest = hashlib.sha256(archive.read_bytes()).hexdigest()
        write_json(folder / "provenance.json", {**provenance, "experiments": experiments, "sha256": digest})


def _simulate(source: Mapping[str, Any], seed: int, archive: Path) -> dict[str, Any]:
    from pipeline.progress import Counter
    from pipeline.rigs.cam_follower import CamFollowerRig
    from pipeline.rigs.campaign import factorial, write_campaign

    table = factorial(source["H"], source["beta"], source["m"], source["V"])
    with Counter(len(table), "virtual bench") as counter:
        write_campaign(archive, table, CamFollowerRig(), seed, progress=lambda done, _: counter.update(done))
    return {
        "data": "virtual",
        "description": "simulated logs of an event-driven virtual cam-follower bench, not measurements",
        "seed": seed,
    }


def _fetch(source: Mapping[str, Any], archive: Path) -> dict[str, Any]:
    dataset, revision = source.get("dataset"), str(source["revision"])
    if dataset:
        path = Path(str(dataset)).expanduser()
        revision = f"taken from {path.name}, published as {revision}"
        if path.is_dir():
            _pack(path, archive)
        elif path.is_file():
            shutil.copyfile(path, archive)
        else:
            raise BadInput(f"{path}: no such file or folder")
    else:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / "Dataset"
            command = [
                sys.executable,
                "-m",
                "dvc",
                "get",
                "--rev",
                str(source["revision"]),
                "-o",
                str(folder),
            ]
            got = subprocess.run([*command, str(source["url"]), "Dataset"], capture_output=True, text=True)
            if got.returncode:
                # the last clause of a chain of causes is the one that a user can act on
                reason = (got.stderr.strip() or "no reason given").splitlines()[-1].split(": ")[-1][:100]
                raise BadInput(f"{source['url']}: cannot be fetched ({reason}); give DATASET=<folder or zip>")
            _pack(folder, archive)
    return {
        "data": "measured",
        "description": "public measurements of the cam-follower bench of the dissertation",
        "url": source["url"],
        "revision": revision,
    }


def _pack(folder: Path, archive: Path) -> None:
    files = sorted(p for p in folder.rglob("*.csv") if p.is_file())
    with (
        replacing(archive) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as z,
    ):
        for file in files:
            # a fixed time stamp, so that the same files make the same archive
            info = zipfile.ZipInfo(str(file.relative_to(folder)), (1980, 1, 1, 0, 0, 0))
            z.writestr(info, file.read_bytes(), zipfile.ZIP_DEFLATED, 1)
