"""Planned experiments before any log exists: inputs within limits, and logs simulated with sensor noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import islice
from math import ceil
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import qmc

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.design.allowed import Watched
from unmodelled.design.limits import MARGIN, Limits
from unmodelled.design.runs import equations, simulated
from unmodelled.design.signals import FAMILIES
from unmodelled.design.written import check_travel, frame, read_experiment
from unmodelled.logs.logs import Logs, as_logged
from unmodelled.systems.model import System

#: Inputs, shape (samples, inputs), SI, by name of the experiment.
Inputs = Mapping[str, Array]

#: Signals of a family that are tried, and experiments of a family that are planned.
TRIED, EACH = 64, 2
#: Shares of their amplitudes that are tried until an experiment keeps the limits.
AMPLITUDES = (1.0, 0.5, 0.25, 0.125, 0.0625)
#: Most samples of a planned experiment that is given.
LONGEST = 1_000_000
#: Integration steps per sample of the simulated logs.
SUBSTEPS = 10


def default_inputs(system: System, limits: Limits, seed: int) -> Inputs:
    """Return two experiments of every family of signals that keep the limits, see `Watched.keeping`."""
    found: dict[str, Array] = {}
    watched = Watched(system, limits)
    for family in FAMILIES:
        z = np.asarray(qmc.Halton(family.size * len(limits.inputs), rng=seed).random(TRIED))
        whole, rest = family.inputs(z, limits), np.array([own.rest for own in limits.inputs])
        tried = (rest + share * (whole - rest) for share in AMPLITUDES)
        kept = next(filter(None, ([*islice(watched.keeping(u), EACH)] for u in tried)), [])
        for k, u in enumerate(kept, start=1):
            found[f"{family.name.replace(' ', '_')}_{k}"] = u
    if not found:
        held, cure = (f", for {watched.allowed}", ", narrow the bounds") if watched.uncertain else ("", "")
        raise BadInput(
            f"{limits.file}: travel: no experiment of {limits.duration:g} s was found in which the known "
            f"physics stays within the limits, with {100.0 * MARGIN:g} % to spare{held}: widen them{cure}, "
            "shorten `duration`, or change `start`"
        )
    return found


def read_inputs(place: Path, system: System, limits: Limits) -> Inputs:
    """Read planned experiments, in the units of their columns; they are put on the sampling period."""
    files = sorted(place.glob("*.csv")) if place.is_dir() else [place]
    if not files:
        raise BadInput(f"{place}: holds no CSV file: give experiments with t and the inputs")
    found, watched = {}, Watched(system, limits)
    for file in files:
        t, given = read_experiment(file, system, limits, str(file))
        if not t[-1] / limits.period < LONGEST:
            raise BadInput(
                f"{file}: lasts {t[-1]:g} s, more than {LONGEST} samples of {limits.period:g} s: cut it"
            )
        found[file.stem] = u = _on_the_clock(t, given, system, limits, file)
        (runs,) = watched(u)
        check_travel([runs.sets(slice(1))], system, limits, str(file))
        check_travel([runs], system, limits, f"{file}: with a draw of {watched.allowed}")
    return found


def _on_the_clock(t: Array, given: Array, system: System, limits: Limits, file: Path) -> Array:
    """Inputs (samples, inputs), SI, at the sampling period; refuse those of which the period misses a part.

    Takes times t (rows,), s, and inputs (rows, inputs), SI.
    """
    clock = limits.period * np.arange(ceil(t[-1] / limits.period - 1e-6) + 1)
    near = 1e-6 * limits.period  # by which times of a file are rounded
    found = []
    for item, own, u in zip(system.inputs, limits.inputs, given.T, strict=True):
        after, back = (np.searchsorted(a, b + near, side="right") - 1 for a, b in ((t, clock), (clock, t)))
        found.append(u[after] if item.hold else np.interp(clock, t, u))
        again = found[-1][back] if item.hold else np.interp(t, clock, found[-1])
        if np.abs(again - u).max() > MARGIN * (own.high - own.low):
            raise BadInput(
                f"{file}: {item.name} changes between the samples of {limits.period:g} s: write the "
                f"period of the file into {limits.file}: period: {float(np.diff(t).min()):.4g}"
            )
    return np.stack(found, axis=1)


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
        y = simulated([system], u[None], own, c, SUBSTEPS, program, watching=False).y[0, 0]
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
