"""Reading, checking and storing a zipped campaign against numpy.loadtxt on its files, one after the other."""

from __future__ import annotations

import io
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from benchmarks.timing import side_by_side
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.stages.ingest import ingest
from unmodelled.base.files import write_json

PEER = f"numpy.loadtxt {np.__version__}, one process"


def run() -> dict[str, float]:
    """600 logs of 5000 samples, two processes; ours also validates, unwraps, labels and writes Parquet."""
    t = np.arange(5000) * 0.0005
    theta = np.mod(12.0 * t, 2 * np.pi)
    noise = np.random.default_rng(0).normal(size=(5, 5000))
    log = "\n".join(",".join(f"{x:.5g}" for x in row) for row in (t, theta, *noise))
    with tempfile.TemporaryDirectory() as scratch:
        raw, store = Path(scratch) / "raw", Path(scratch) / "store"
        raw.mkdir()
        write_json(raw / "provenance.json", {"data": "virtual"})
        with zipfile.ZipFile(raw / "campaign.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            rows = "".join(f"{i},0.03,3.14,1.1,6\n" for i in range(600))
            archive.writestr("parameters.csv", "exp,H,beta,m,V\n" + rows)
            for i in range(600):
                archive.writestr(f"exp{i}.csv", log)

        def peer() -> None:
            with zipfile.ZipFile(raw / "campaign.zip") as archive:
                for i in range(600):
                    np.loadtxt(io.BytesIO(archive.read(f"exp{i}.csv")), delimiter=",")

        return side_by_side(lambda: ingest(raw, None, CamFollower(), 2, store), peer, rounds=3)
