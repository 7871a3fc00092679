"""Script of a Functional Mock-up Unit: copied into the FMU, and run there by PythonFMU3.

The FMU holds a system file, `resources/model/system.yaml`. The computer that runs the FMU needs Python with
this package. Inputs, outputs and parameters have the SI units of the system file.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pythonfmu3 import Fmi3Slave
from pythonfmu3.enums import Fmi3Causality, Fmi3Initial, Fmi3Variability
from pythonfmu3.variables import Float64

from unmodelled.engine.fmu.stepper import Stepper, defaults
from unmodelled.systems.reader import read_system


class Machine(Fmi3Slave):  # type: ignore[misc]  # the library has no types
    """A system in steps; PythonFMU3 gives its settings, such as the folder `resources`."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        system = self.system = read_system(Path(self.resources) / "model" / "system.yaml")
        self.modelName, self.description = system.name, f"free run of {system.name}"
        self.u = np.zeros(len(system.inputs))
        self.y = np.zeros(len(system.outputs))
        self.p, self.c = np.array(system.values), defaults(system)
        self.x = np.array([float(s.initial) if s.initial.is_number else np.nan for s in system.states])
        self.stepper: Stepper
        fixed = Fmi3Causality.parameter, Fmi3Variability.fixed, Fmi3Initial.exact
        moving = Fmi3Variability.continuous, None
        self.time = 0.0
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=moving[0]))
        self._register("u", system.inputs, (Fmi3Causality.input, *moving))
        self._register("y", system.outputs, (Fmi3Causality.output, *moving))
        self._register("p", system.parameters, fixed)
        self._register("c", system.operating_point, fixed)
        given = [state for state in system.states if state.initial.is_number]
        self._register("x", system.states, fixed, "start_", {state.name for state in given})

    def _register(self, array: str, items: Any, kind: Any, prefix: str = "", only: Any = None) -> None:
        causality, variability, initial = kind
        for k, item in enumerate(items):
            if only is None or item.name in only:
                variable = Float64(
                    prefix + item.name,
                    causality=causality,
                    variability=variability,
                    initial=initial,
                    description=f"{item.name} in {item.unit}",
                    getter=partial(self._get, array, k),
                    setter=partial(self._set, array, k),
                )
                self.register_variable(variable)

    def _get(self, array: str, k: int) -> float:
        return float(getattr(self, array)[k])

    def _set(self, array: str, k: int, value: float) -> None:
        getattr(self, array)[k] = value

    def setup_experiment(self, start_time: float) -> None:
        """Note the start time, s."""
        self.time = start_time

    def exit_initialization_mode(self) -> None:
        """Begin at the initial states, with the inputs that are set by then."""
        self.stepper = Stepper(self.system, self.p, self.c, self.u, self.x, self.time)
        self.y = self.stepper.y

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Simulate one communication step with constant inputs; times in s."""
        self.stepper.step(self.u, step_size)
        self.y, self.time = self.stepper.y, current_time + step_size
        return bool(np.isfinite(self.y).all())
