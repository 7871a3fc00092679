"""Find where a system file and measured experiments differ, and the effect that causes it."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from unmodelled.base.ownership import verb
from unmodelled.cli.colour import coloured


@verb()
def diagnose(
    system: Path,
    logs: Path,
    out: Path,
    horizon: float | None = None,
    seed: int = 0,
    laws: Path | None = None,
    options: Mapping[str, float] | None = None,
    without: Sequence[str] = (),
) -> None:
    """Name the unmodelled effects that explain the gap, and the share of the gap that they explain.

    `out` holds `diagnosis.json` (verdict, effects with numbers and intervals, place of the gap, compared
    candidates), `augmented_system.yaml` (the system with the identified laws; `simulate` takes it with the
    same logs), `compensation_<output>.csv` (what to add to a sensor whose error a table compensates),
    `figures`, the `tables` of the figures, and `index.html`, a page on the whole answer in which the machine
    can be simulated. A system file that has impossible numbers or follows whole held-out runs worse than the
    given one is not written, and the answer says why. Into a new folder the answer is written first, an older
    one is replaced in the end; if a figure cannot be drawn, a note in the answer says so. If a fault of the
    logs, such as a wrong unit or sign, explains most of the gap, the verdict is check_logs and no law is
    compared.

    Args:
        system: file of the known physics (system/1); parameters marked `identify` are refitted.
        logs: folder of the measured experiments, of which each is left out once to assess the models; a
            record that is alone is cut into several.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        horizon, seed, laws, without: see `unmodelled.api.diagnosis.diagnose`.
        options: the few numbers that decide, by name, such as {level: 0.99} (`unmodelled.Options`); null: the
            defaults, which are measured.

    Raises:
        BadInput: when the system file, the logs, the horizon, the seed, a law or an option cannot
            be used.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.diagnosis import diagnose as diagnosed

    found = diagnosed(system, logs, horizon, seed, laws=laws, options=options, without=without)
    notes = found.save(out)
    print(coloured("\n".join([str(found), *(f"note: {note}" for note in notes)]), sys.stdout))
