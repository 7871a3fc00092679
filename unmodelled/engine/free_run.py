"""Free runs over windows of measured inputs: simulations that see no output after their first sample.

One function, `free_run`, on one of two backends. A register machine (`machine.program.Program`) runs any
system at once; a new structure costs milliseconds. A generated kernel (`compiled.backend.Generated`) also has
networks and gradients; it is compiled once for every structure, which takes seconds.
"""

# without postponed annotations: the pages on the library cannot read those of a NamedTuple
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np

from unmodelled.base.arrays import Array, Indices

Method = Literal["euler", "rk4"]

#: Explicit Runge-Kutta methods: coefficient on the stage before, weight, and time of every stage.
STAGES: dict[Method, tuple[tuple[float, float, float], ...]] = {
    "euler": ((0.0, 1.0, 0.0),),
    "rk4": ((0.0, 1 / 6, 0.0), (0.5, 1 / 3, 0.5), (0.5, 1 / 3, 0.5), (1.0, 1 / 6, 1.0)),
}


@dataclass(frozen=True)
class Integration:
    """Method and step by which a free run is integrated."""

    period: float  # sampling period, s
    method: Method = "euler"
    substeps: int = 1  # integration steps per sample
    #: course of the inputs between samples: 0 holds the value until the next sample, 1 goes straight to the
    #: next value; one for all, or one for each (not in generated kernels)
    hold: float | tuple[float, ...] = 0.0

    @property
    def common_hold(self) -> float:
        """Course that all inputs share."""
        if not isinstance(self.hold, tuple):
            return float(self.hold)
        if len(set(self.hold)) > 1:
            raise ValueError(f"all inputs must have the same course between samples, got {self.hold}")
        return float(self.hold[0]) if self.hold else 0.0

    @property
    def stages(self) -> Array:
        """Coefficient on the stage before, weight, and time within the step, shape (stages, 3)."""
        return np.asarray(STAGES[self.method], np.float64)


class Windows(NamedTuple):
    """Starts of free runs, and what drives them."""

    u: Array  # (rows, inputs), at the samples; further tables of the same samples may follow
    t: Array  # (samples,), s
    start: Indices  # (windows,), first samples
    steps: Indices  # (windows,), numbers of samples that follow
    owner: Indices  # (windows,), experiments whose parameters and constants count
    shift: Indices  # (sets,), rows of `u` before the table that a set of parameters reads

    def checked(self) -> "Windows":
        """Return the same windows with the memory layout that compiled loops read."""
        end = self.start + self.steps
        rows = len(self.u) - self.shift.max(initial=0)
        inside = not len(end) or (self.start.min() >= 0 and self.steps.min() >= 0 and end.max() < len(self.t))
        if not (inside and len(self.t) <= rows and self.shift.min(initial=0) >= 0):
            raise ValueError(f"windows must lie within {len(self.t)} samples of {rows} rows")
        whole = (np.ascontiguousarray(a, np.int64) for a in (self.start, self.steps, self.owner, self.shift))
        return Windows(_numbers(self.u), _numbers(self.t), *whole)


class Sizes(NamedTuple):
    """Numbers of the quantities of a system."""

    states: int
    inputs: int
    parameters: int
    constants: int  # constants of the operating point


class Backend(Protocol):
    """Equations x' = f(t, x, u; p, c) with observed values y = g(t, x, u; p, c), ready to be integrated."""

    @property
    def sizes(self) -> Sizes:
        """Numbers of states, inputs, parameters and constants of the equations."""
        ...

    def run(self, windows: Windows, p: Array, c: Array, x0: Array, how: Integration) -> Array:
        """Simulate checked windows; see `free_run`.

        Args:
            windows: first samples, lengths and inputs of the free runs.
            p: parameters, shape (experiments, sets, parameters), SI.
            c: constants of the operating points, shape (experiments, constants), SI.
            x0: states at the first samples, shape (windows, sets, states), SI.
            how: method, step and course of the inputs between samples.

        Returns:
            Observed values, shape (windows, sets, most steps + 1, observed).
        """
        ...


def free_run(backend: Backend, windows: Windows, p: Array, c: Array, x0: Array, how: Integration) -> Array:
    """Simulate all windows for all sets of parameters.

    Takes p (experiments, sets, parameters), c (experiments, constants) and x0 (windows, sets, states) in SI;
    gives (windows, sets, most steps + 1, observed).
    """
    windows, sizes = windows.checked(), backend.sizes
    experiments, sets = int(windows.owner.max(initial=-1)) + 1, len(windows.shift)
    expected = {
        "x0": (len(windows.start), sets, sizes.states),
        "p": (max(experiments, len(p)), sets, sizes.parameters),
        "c": (max(experiments, len(c)), sizes.constants),
        "u": (len(windows.u), sizes.inputs),
    }
    for name, array in {"x0": x0, "p": p, "c": c, "u": windows.u}.items():
        if array.shape != expected[name]:
            raise ValueError(f"{name} must have the shape {expected[name]}, got {array.shape}")
    return backend.run(windows, _numbers(p), _numbers(c), _numbers(x0), how)


def _numbers(values: Array) -> Array:
    return np.require(values, np.float64, ["C", "W"])
