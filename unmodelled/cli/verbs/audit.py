"""Tell which numbers of a system its logs determine, contradict or bend, and which set predicts best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from unmodelled.api.audit import audit as audited
from unmodelled.base.ownership import verb


@verb()
def audit(
    system: Path,
    logs: Path,
    sets: Sequence[str],
    out: Path,
    parameters: list[str] | None = None,
    horizon: float | None = None,
    seed: int = 0,
    close: float = 0.02,
    options: Mapping[str, float] | None = None,
) -> None:
    """Write and print what logs say about every number of a system, and how well sets of numbers predict.

    `out` holds `audit.json` (schema audit/1), `numbers.csv` with a row per number, `sets.csv` with a row per
    set, and `index.html`, a page of both.

    Args:
        system: system file; its numbers are a set, too.
        logs: log folder.
        sets: files of numbers (lines such as `J: 0.02 kg m^2`, YAML or JSON) and system files of the same
            structure, [tuned.yaml,sheet.json] for instance; each is called by the name of its file.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        parameters, horizon, seed, close, options: see `unmodelled.api.audit.audit`.

    Raises:
        BadInput: when the system, the logs, a set or an option cannot be used, or a fault of the logs would
            be explained by numbers.
    """
    found = audited(system, logs, list(sets), parameters, horizon, seed, None, options, close)
    found.save(out)
    print(found)
