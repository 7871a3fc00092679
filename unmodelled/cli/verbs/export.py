"""Write a system as a Functional Mock-up Unit."""

from __future__ import annotations

from pathlib import Path

from unmodelled.base.ownership import Out, verb


@verb(Out.FILE)
def export(system: Path, out: Path) -> None:
    """Write a system as a Functional Mock-up Unit (FMI 3.0, co-simulation).

    Inputs and outputs of the FMU are those of the system, in SI units; its parameters are those of the
    system, the constants of the operating point and the initial states `start_<state>`. The computer that
    runs the FMU needs Python with this package. An FMU with an impossible number, or that does not run as
    the system does, is not written.

    Args:
        system: system file, `augmented_system.yaml` of a diagnosis for instance.
        out: file of the FMU, which ends in `.fmu`; replaced where it exists.

    Raises:
        BadInput: when the system file cannot be used, the extra `fmu` is not installed, or the file cannot be
            written.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.fmu import write_fmu

    found = write_fmu(system, out)
    print(f"inputs: {', '.join(f'{u.name} ({u.unit})' for u in found.inputs) or 'none'}")
    print(f"outputs: {', '.join(f'{y.name} ({y.unit})' for y in found.outputs)}")
