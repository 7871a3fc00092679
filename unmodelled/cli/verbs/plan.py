"""Tell which effects planned experiments could show, before any log exists."""

from __future__ import annotations

from pathlib import Path

from unmodelled.base.ownership import verb


@verb()
def plan(system: Path, limits: Path, inputs: Path | None, out: Path, seed: int = 0) -> None:
    """Write from which size on every effect of the library would show, and which effects would look alike.

    The known physics is simulated with the noise of the sensors; uncertain parameters, the timing of inputs
    and initial states are re-fitted. `out` holds `plan.json`, `effects.csv` and the folder `experiments` with
    the inputs, in the units of their columns.

    Args:
        system: system file of the machine.
        limits, inputs, seed: see `unmodelled.api.plan.plan`.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the system file, the limits or the inputs cannot be used, or no experiment keeps the
            limits.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.plan import plan as planned

    found = planned(system, limits, inputs, seed)
    found.save(out)
    print(found)
