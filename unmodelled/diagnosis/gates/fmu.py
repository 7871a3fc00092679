"""The gate of a Functional Mock-up Unit: it says what its system says, and runs as the system runs."""

from __future__ import annotations

import zipfile
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.gates.robot_numbers import impossible_parameters
from unmodelled.diagnosis.gates.start import impossible_start
from unmodelled.engine.fmu.stepper import Stepper, defaults
from unmodelled.systems.model import System

#: Communication steps of the run, their length in s, and the largest difference, relative to the outputs.
STEPS, STEP, CLOSE = 10, 1e-3, 1e-9


def reason_against_fmu(system: System, file: Path) -> str:
    """Return why an FMU may not leave; empty if it may.

    The system can start. Its model description has the inputs, outputs and parameters of the system with
    their values. Where FMPy is installed, a short run without inputs gives the outputs of the system.
    """
    impossible = impossible_parameters(system) or impossible_start(system)
    return impossible or _described(system, file) or _run(system, file)


def _described(system: System, file: Path) -> str:
    with zipfile.ZipFile(file) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    found = {v.get("name"): (v.get("causality"), v.get("start")) for v in root.iter("Float64")}
    values = dict(zip((c.name for c in system.operating_point), defaults(system).tolist(), strict=True))
    values |= {p.name: p.value for p in system.parameters}
    for causality, items in (("input", system.inputs), ("output", system.outputs)):
        for item in items:
            if found.get(item.name, ("", ""))[0] != causality:
                return f"its model description lacks the {causality} {item.name}"
    for name, value in values.items():
        start = found.get(name, ("", None))[1]
        if start is None or not np.isclose(float(start), value, rtol=CLOSE, atol=0.0):
            return f"its model description gives {name} the value {start} instead of {value:g}"
    return ""


def _run(system: System, file: Path) -> str:
    wanted = _stepped(system)
    # a system that starts with inputs or constants of the user only is not run
    if find_spec("fmpy") is None or not np.isfinite(wanted).all():
        return ""
    import fmpy

    names = [output.name for output in system.outputs]
    try:
        rows = fmpy.simulate_fmu(
            str(file),
            output=names,
            stop_time=STEPS * STEP,
            output_interval=STEP,
            step_size=STEP,
            fmi_type="CoSimulation",
        )
    except Exception as fault:  # what the FMU or the library raises
        return f"it does not run ({fault}); please report this line"
    found = np.stack([rows[name] for name in names], 1)
    if found.shape != wanted.shape or np.abs(found - wanted).max() > CLOSE * max(1.0, np.abs(wanted).max()):
        return "it does not run as the system does; please report this line"
    return ""


def _stepped(system: System) -> Array:
    """Outputs (steps + 1, outputs) without inputs, from the initial states."""
    p, u = np.array(system.values), np.zeros(len(system.inputs))
    stepper = Stepper(system, p, defaults(system), u, np.full(len(system.states), np.nan))
    shown = [stepper.y]
    for _ in range(STEPS):
        stepper.step(u, STEP)
        shown.append(stepper.y)
    return np.array(shown)
