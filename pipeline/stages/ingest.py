"""Convert raw logs to one validated store, with unwrapped angles and labelled experiments."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.labels import label, mean_extreme, unwrapped
from pipeline.recordings.rawlogs import ROWS, RawLogs
from unmodelled.base.campaign import Campaign
from unmodelled.base.ownership import verb
from unmodelled.base.progress import track
from unmodelled.base.shapes import ORIGIN, read_shaped
from unmodelled.base.workers import pool_of
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

#: What to do with the result (`unmodelled.cli.written`).
NEXT = "use it as logs={out} with a system file, or: {program} featurize trajectories={out}"

Chunk = tuple[list[int], dict[str, NDArray[np.float32 | np.float64]]]

#: Experiments that a worker reads at a time.
CHUNK = 40


@verb()
def ingest(raw: Path, system: Path | None, mechanism: CamFollower, workers: int, out: Path) -> None:
    """Write the store of a campaign (see `Campaign.write`).

    With `system`, `raw` is a log folder of that system. The logs are resampled on a uniform clock, angles are
    unwrapped, and states are estimated.

    Args:
        raw: folder with campaign.zip and provenance.json, or a log folder.
        system: system file.
        mechanism: constants of the cam-follower bench, which contain the thresholds of the labels.
        workers: number of processes that parse logs.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when a log cannot be used; nothing is written then.
    """
    if system is not None:
        read_logs(raw, read_system(system)).write(out)
    else:
        _ingest_cam_follower(raw, mechanism, workers, out)


def _ingest_cam_follower(raw: Path, mechanism: CamFollower, workers: int, out: Path) -> None:
    archive = raw / "campaign.zip"
    parameters = RawLogs(archive).parameters()
    ids = parameters["exp"].tolist()
    chunks = [ids[i : i + CHUNK] for i in range(0, len(ids), CHUNK)]
    lengths: list[int] = []
    parts: list[dict[str, NDArray[np.float32 | np.float64]]] = []
    with pool_of(workers) as pool:
        for sizes, part in track(pool.map(partial(_read, archive), chunks), len(chunks), "reading logs"):
            lengths += sizes
            parts.append(part)
    signals = {name: np.concatenate([part.pop(name) for part in parts]) for name in ROWS}
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    campaign = Campaign(parameters, signals, offsets, read_shaped(raw / "provenance.json", ORIGIN))
    labelled = pd.concat([parameters, _label(campaign, mechanism)], axis=1)
    Campaign(labelled, signals, offsets, campaign.provenance).write(out)


def _read(archive: Path, ids: list[int]) -> Chunk:
    """Logs of some experiments, one after the other, angles unwrapped.

    Five significant digits fit in a float32; the unwrapped angle and the time need more.
    """
    source = RawLogs(archive)
    logs = [source.log(exp) for exp in ids]
    joined = np.concatenate(logs, axis=1)
    joined[1] = np.concatenate([unwrapped(log[1]) for log in logs])
    wide = {"t", "theta"}
    columns = {n: joined[i].astype(np.float64 if n in wide else np.float32) for i, n in enumerate(ROWS)}
    return [log.shape[1] for log in logs], columns


def _label(campaign: Campaign, mechanism: CamFollower) -> pd.DataFrame:
    rows = []
    for H, log in zip(campaign.experiments["H"], campaign, strict=True):
        turns = log["theta"][-1] / TURN
        share = mean_extreme(log["theta"], log["eps"], largest=True) / H
        kind = label(turns, share, mechanism.jump_share, mechanism.stall_turns)
        rows.append((kind, turns, share, log["t"][-1]))
    return pd.DataFrame(rows, columns=["label", "turns", "eps_share", "duration"])
