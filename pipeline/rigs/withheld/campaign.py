"""Many cases of one kind, as `acquire` writes them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.rigs.withheld.drawing import cases
from pipeline.rigs.withheld.writing import write
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder
from unmodelled.base.progress import track


@dataclass(frozen=True)
class WithheldCampaign:
    """The first `count` cases of `kind` (see `cases`) drawn with `seed`; all of them if `count` is None.

    Raises:
        BadInput: when there is no such kind, or not as many cases.
    """

    kind: str = "single"
    count: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        many = len(cases(self.kind, self.seed))
        if self.count is not None and not 1 <= self.count <= many:
            raise BadInput(f"source.count: must be 1 to {many} for {self.kind} cases, got {self.count}")

    def write(self, folder: Path, seed: int) -> dict[str, Any]:
        """Replace `folder` by one folder per case (see `write`), and return the provenance.

        Args:
            folder: gets <kind>_001 and so on. seed: of inputs, sensors and noise, on top of that of the draw.

        Raises:
            BadInput: when the folder cannot be written.
        """
        drawn = cases(self.kind, self.seed)[: self.count]
        with replacing_folder(folder) as out:
            for k, case in enumerate(track(drawn, len(drawn), "withheld cases"), start=1):
                write(replace(case, seed=case.seed + seed), out / f"{self.kind}_{k:03d}")
        return {
            "data": "virtual",
            "description": "simulated logs of virtual machines with planted effects, not measurements",
            "seed": seed,
            "experiments": len(drawn),
        }
