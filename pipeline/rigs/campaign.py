"""Write a measurement campaign of a virtual bench in the layout of the published cam-follower data set.

One zip file holds Dataset/parameters.csv (exp, H, beta, m, V) and one Dataset/experiments/exp<i>.csv per
experiment: seven comma-separated rows t, theta, omega, alpha, y, h, eps in SI units, five significant digits.
"""

import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

import pandas as pd

from pipeline.rigs.cam_follower import CamFollowerRig
from pipeline.rigs.virtual import VirtualCampaign
from unmodelled.base.files import replacing
from unmodelled.base.progress import Counter
from unmodelled.base.workers import pool_of

CHANNELS = ("t", "theta", "omega", "alpha", "y", "h", "eps")
FACTORS = ("H", "beta", "m", "V")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # a fixed time stamp keeps equal campaigns equal byte by byte
_COMPRESSION = 4  # nearly as small as the default level in half the time

Job = tuple[int, float, float, float, float]


@dataclass(frozen=True)
class CamFollowerCampaign(VirtualCampaign):
    """A full factorial on the virtual cam-follower bench, as campaign.zip.

    Attributes:
        H: strokes, m.
        beta: rise angles, rad.
        m: follower masses, kg.
        V: voltages, V.
    """

    H: Sequence[float]
    beta: Sequence[float]
    m: Sequence[float]
    V: Sequence[float]

    description = "simulated logs of an event-driven virtual cam-follower bench, not measurements"

    def make(self, out: Path, seed: int) -> int:
        table = factorial(self.H, self.beta, self.m, self.V)
        with Counter(len(table), "virtual bench") as counter:
            path, shown = out / "campaign.zip", lambda done, _: counter.update(done)
            write_campaign(path, table, CamFollowerRig(), seed, progress=shown)
        return len(table)


def factorial(
    heights: Iterable[float], skews: Iterable[float], masses: Iterable[float], voltages: Iterable[float]
) -> pd.DataFrame:
    """Return a full factorial of heights (m), skews (rad), masses (kg), voltages (V, varies fastest)."""
    table = pd.DataFrame(product(heights, skews, masses, voltages), columns=list(FACTORS), dtype=float)
    table.insert(0, "exp", range(1, len(table) + 1))
    return table


def write_campaign(
    path: Path,
    table: pd.DataFrame,
    rig: CamFollowerRig,
    seed: int,
    workers: int = 2,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Simulate every experiment of a table, and write the campaign to a zip file.

    The file appears under its name only when it is complete. Its bytes do not depend on `workers`.
    """
    jobs: list[Job] = list(zip(*(table[name].tolist() for name in ("exp", *FACTORS)), strict=True))
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        _add(archive, "Dataset/parameters.csv", _parameters(jobs))
        for done, (exp, text) in enumerate(_logs(jobs, rig, seed, workers), start=1):
            _add(archive, f"Dataset/experiments/exp{exp}.csv", text)
            if progress is not None:
                progress(done, len(jobs))


def _logs(jobs: Sequence[Job], rig: CamFollowerRig, seed: int, workers: int) -> Iterator[tuple[int, str]]:
    """Number and text of each experiment, in the order of `jobs`."""
    work = partial(_log, rig, seed)
    if workers < 2 or len(jobs) < 2:
        yield from map(work, jobs)
        return
    # The first run is made here, so that the workers load the compiled code instead of all compiling it.
    yield work(jobs[0])
    with pool_of(workers) as pool:
        yield from pool.map(work, jobs[1:], chunksize=4)


def _log(rig: CamFollowerRig, seed: int, job: Job) -> tuple[int, str]:
    exp, H, beta, m, V = job
    log = rig.run(H, beta, m, V, seed)
    rows = (",".join([f"{value:.5g}" for value in log[name].tolist()]) for name in CHANNELS)
    return exp, "\n".join(rows) + "\n"


def _parameters(jobs: Sequence[Job]) -> str:
    rows = (",".join([str(exp), *(f"{value:.15g}" for value in factors)]) for exp, *factors in jobs)
    return "\n".join([",".join(("exp", *FACTORS)), *rows]) + "\n"


def _add(archive: zipfile.ZipFile, name: str, text: str) -> None:
    entry = zipfile.ZipInfo(name, date_time=_EPOCH)
    entry.create_system, entry.external_attr = 3, 0o644 << 16  # the same on every platform: Unix, rw-r--r--
    archive.writestr(entry, text, compress_type=zipfile.ZIP_DEFLATED, compresslevel=_COMPRESSION)
