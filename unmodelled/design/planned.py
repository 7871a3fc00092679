"""Planned experiments before any log exists: inputs within limits, and logs simulated with sensor noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import qmc

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.design.limits import MARGIN, Limits
from unmodelled.design.runs import equations, quantities, simulated
from unmodelled.design.signals import FAMILIES
from unmodelled.design.written import Watch, check_travel, frame, read_experiment
from unmodelled.logs.logs import Logs, as_logged
from unmodelled.systems.model import System

#: Inputs, shape (samples, inputs), SI, by name of the experiment.
Inputs = Mapping[str, Array]

#: Signals of a family that are tried, and experiments of a family that are planned.
TRIED, EACH = 64, 2
#: Most samples of a planned experiment that is given.
LONGEST = 1_000_000
#: Integration steps per sample of the simulated logs.
SUBSTEPS = 10


def default_inputs(system: System, limits: Limits, seed: int) -> Inputs:
    """Return two experiments of every family of signals in which the known physics keeps the limits."""
    found: dict[str, Array] = {}
    program, c = equations(system, quantities(system, limits)), limits.c
    for family in FAMILIES:
        z = np.asarray(qmc.Halton(family.size * len(limits.inputs), rng=seed).random(TRIED))
        u = family.inputs(z, limits)
        y, watched = simulated([system], u, limits, c, SUBSTEPS, program)
        kept = (limits.excess(watched[:, 0], MARGIN) == 0.0) & np.isfinite(y).all(axis=(1, 2, 3))
        for k, design in enumerate(np.flatnonzero(kept)[:EACH], start=1):
            found[f"{family.name.replace(' ', '_')}_{k}"] = u[design]
    if not found:
        raise BadInput(
            f"{limits.file}: travel: no experiment of {limits.duration:g} s was found in which the known "
            f"physics stays within the limits, with {100.0 * MARGIN:g} % to spare: widen them, shorten "
            "`duration`, or change `start`"
        )
    return found


def watched_by(system: System, limits: Limits) -> Watch:
    """Return the simulation of the known physics that looks at the travel limits."""
    program = equations(system, quantities(system, limits))

    def watch(u: Array) -> list[Array]:
        return [simulated([system], u[None], limits, limits.c, SUBSTEPS, program)[1][0]]

    return watch


def read_inputs(place: Path, system: System, limits: Limits) -> Inputs:
    """Read planned experiments, in the units of their columns; they are put on the sampling period."""
    files = sorted(place.glob("*.csv")) if place.is_dir() else [place]
    if not files:
        raise BadInput(f"{place}: holds no CSV file: give experiments with t and the inputs")
    found, watch = {}, watched_by(system, limits)
    for file in files:
        t, given = read_experiment(file, system, limits, str(file))
        if not t[-1] / limits.period < LONGEST:
            raise BadInput(
                f"{file}: lasts {t[-1]:g} s, more than {LONGEST} samples of {limits.period:g} s: cut it"
            )
        clock = limits.period * np.arange(int(t[-1] / limits.period + 1e-9) + 1)
        found[file.stem] = np.stack([np.interp(clock, t, u) for u in given.T], axis=1)
        check_travel(watch(found[file.stem]), system, limits, str(file))
    return found


def simulated_logs(inputs: Inputs, system: System, limits: Limits, seed: int) -> Logs:
    """Simulate logs of experiments (SI) with the known physics and the noise of the sensors."""
    for output in system.outputs:
        if output.name not in limits.noise:
            raise BadInput(
                f"{limits.file}: noise: the output {output.name} has none: add "
                f"noise: {{{output.name}: ...}}, the standard deviation of the sensor in {output.column_unit}"
            )
    rng, c, program = np.random.default_rng(seed), limits.c, equations(system, ())
    tables = {name: frame(u, system, limits) for name, u in inputs.items()}
    for name, u in inputs.items():
        own = replace(limits, travel={})
        y = simulated([system], u[None], own, c, SUBSTEPS, program)[0][0, 0]
        if not np.isfinite(y).all():
            raise BadInput(f"{limits.file}: start: the simulation of {name} diverges: change the inputs")
        for k, output in enumerate(system.outputs):
            value = y[:, k] + limits.noise[output.name] * rng.standard_normal(len(y))
            tables[name][output.column] = as_logged(output, value)
    constants = {
        item.name: as_logged(item, np.asarray(limits.constants[item.name]))
        for item in system.operating_point
        if item.values is None
    }
    return Logs.from_frames(tables, system, pd.DataFrame(constants, index=list(tables)))
