"""A system as a Functional Mock-up Unit, for people who simulate in Simulink, Modelica or another tool."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from unmodelled.base.errors import BadInput
from unmodelled.base.extras import missing
from unmodelled.base.files import replacing
from unmodelled.diagnosis.answer.augmented import FILE
from unmodelled.diagnosis.gates.fmu import reason_against_fmu
from unmodelled.systems.given import SystemGiven, system_of
from unmodelled.systems.model import System
from unmodelled.systems.writer import write_system

SCRIPT = Path(__file__).parents[1] / "engine" / "fmu" / "machine.py"


def write_fmu(system: SystemGiven, path: Path | str) -> System:
    """Write a system as a Functional Mock-up Unit (FMI 3.0, co-simulation).

    Inputs and outputs of the FMU are those of the system, in SI units. Its parameters are the parameters of
    the system, the constants of the operating point (unless they are set, their value for `other`
    experiments, or zero), and `start_<state>` for the states whose initial value is a number. Inputs keep
    their values during a communication step. Delays are simulated. The computer that runs the FMU needs
    Python with this package, because the FMU runs the free runs of this package on the system file that it
    contains.

    Args:
        system: system to write, the path of its file, or a result that has one, such as an answer.
        path: file of the FMU, `machine.fmu`; replaced where it exists.

    Returns:
        The system in the FMU.

    Raises:
        BadInput: when the extra `fmu` is not installed, the path does not end in `.fmu`, two variables of the
            FMU have the same name, the system of the answer is not offered, a number is impossible, such as a
            mass of zero or one with which a rate or an output has no value at the start, the FMU
            does not run as the system does, or the file cannot be written.

    Examples:
        >>> import zipfile
        >>> import unmodelled as um
        >>> from tempfile import TemporaryDirectory
        >>> system, _ = um.example("pendulum")
        >>> with TemporaryDirectory() as folder:
        ...     _ = um.write_fmu(system, f"{folder}/pendulum.fmu")
        ...     "modelDescription.xml" in zipfile.ZipFile(f"{folder}/pendulum.fmu").namelist()
        True
    """
    path, known = Path(path), system_of(system)
    for sentence in getattr(system, "refused", ()):
        if sentence.startswith(FILE):
            raise BadInput(f"{path} was not written: {sentence}")
    if path.suffix != ".fmu":
        raise BadInput(f"{path}: the name of an FMU must end in .fmu, for example {path.stem}.fmu")
    if find_spec("pythonfmu3") is None:
        needed = missing(ModuleNotFoundError(name="pythonfmu3")) or "pythonfmu3 is not installed"
        raise BadInput(f"an FMU needs pythonfmu3: {needed}")
    names = {str(symbol) for symbol in (*known.u, *known.p, *known.c)} | {y.name for y in known.outputs}
    taken = [f"start_{s.name}" for s in known.states if f"start_{s.name}" in names]
    if taken:
        raise BadInput(f"{known.place}: {taken[0]}: the FMU has an initial state of that name: rename it")
    from pythonfmu3.builder import FmuBuilder

    with TemporaryDirectory() as folder, replacing(path) as temporary:
        model = Path(folder, "model")
        model.mkdir()
        write_system(known, model / "system.yaml")
        built = FmuBuilder.build_FMU(SCRIPT, Path(folder, "fmu"), [model])
        if reason := reason_against_fmu(known, Path(built)):
            raise BadInput(f"{path} was not written: {reason}")
        shutil.move(built, temporary)
    return known
