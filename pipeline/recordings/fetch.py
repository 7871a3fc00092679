"""Fetch the public data set of the dissertation, or copy it from a local path."""

import shutil
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.recordings.rawlogs import RawLogs
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.base.progress import say


@dataclass(frozen=True)
class PublicDataSet:
    """A measured campaign that is published in a git repository.

    Attributes:
        url: address of the repository.
        revision: revision of the repository.
        dataset: path of a folder or downloaded zip file, which replaces the download; default: none.
    """

    url: str
    revision: str
    dataset: str | None = None

    def write(self, folder: Path, seed: int) -> dict[str, Any]:
        """Write campaign.zip, and return the provenance.

        Args:
            folder: existing folder that is written into.
            seed: unused, because nothing is random.

        Raises:
            BadInput: when the data set cannot be found, fetched or read.
        """
        archive, revision = folder / "campaign.zip", str(self.revision)
        if self.dataset:
            path = Path(str(self.dataset)).expanduser()
            revision = f"taken from {path.name}, published as {revision}"
            if path.is_dir():
                _pack(path, archive)
            elif path.is_file():
                shutil.copyfile(path, archive)
            else:
                raise BadInput(f"{path}: no such file or folder")
        else:
            self._fetch(archive)
        return {
            "data": "measured",
            "description": "public measurements of the cam-follower bench of the dissertation",
            "url": self.url,
            "revision": revision,
            "experiments": len(RawLogs(archive).parameters()),
        }

    def _fetch(self, archive: Path) -> None:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / "Dataset"
            options = ["get", "--rev", str(self.revision), "-o", str(folder), self.url, "Dataset"]
            say(f"fetching {self.url}, some minutes")
            got = subprocess.run([sys.executable, "-m", "dvc", *options], capture_output=True, text=True)
            if got.returncode:
                # the last clause of a chain of causes is the one that a user can act on
                reason = (got.stderr.strip() or "no reason given").splitlines()[-1].split(": ")[-1][:100]
                raise BadInput(f"{self.url}: cannot be fetched ({reason}); give DATASET=<folder or zip>")
            _pack(folder, archive)


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
