"""Get raw logs: simulate them on a virtual test bench, or read published measurements."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, Protocol

from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.ownership import verb

#: What to do with the result (`unmodelled.cli.written`).
NEXT = "use it as logs={out} with a system file, or: {program} ingest raw={out}"


class Source(Protocol):
    """Source of raw logs, as a file of conf/source/ names it."""

    def write(self, folder: Path, seed: int) -> dict[str, Any]:
        """Write raw logs, and return their provenance.

        Args:
            folder: existing folder that is written into, or replaced.
            seed: seed of a virtual campaign.
        """


@verb()
def acquire(source: Source, seed: int, out: Path) -> None:
    """Write raw logs to `out`, and their provenance to `out`/provenance.json.

    Args:
        source: virtual test bench with its campaign, or published data set.
        seed: seed of a virtual campaign.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the data set cannot be found, fetched or read.
    """
    with replacing_folder(out) as folder:
        provenance = source.write(folder, seed)
        files = sorted(p for p in folder.rglob("*") if p.is_file())
        digests = [hashlib.sha256(p.read_bytes()).hexdigest() for p in files]
        # of one file its own digest, as any tool computes it; of several that of their digests
        whole = digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
        write_json(folder / "provenance.json", {**provenance, "sha256": whole})
