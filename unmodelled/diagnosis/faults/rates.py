"""Outputs that are the rate of another output: what the samples of both say about the logs.

The residual of every run is the speed less the slope of its position, and its size is compared with the noise
of both. Most runs show that the two belong together, and the pattern of the residual in the others names the
fault: another multiple, exchanged columns, a column that stands still, or nothing in common.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.remark import listed
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.engine.machine.program import Program
from unmodelled.logs.inspection.pairs import FACTOR, REST, SAME
from unmodelled.logs.logs import Logs
from unmodelled.logs.time_units import on_clock
from unmodelled.systems.model import System

#: Points at which two outputs are compared, and the rounding error of their quotient.
POINTS, ROUNDING = 16, 1e-9
#: Names of the problems.
EXCHANGED, STANDS, APART = "exchanged", "frozen", "unrelated_rate"
#: Share of the power of a speed that the slope explains at most where the two have nothing in common.
COMMON = 0.5
#: Fewest equal samples, in widths of the filter of the slope, of a column that stands still.
STILL = 2


@dataclass(frozen=True)
class Rate:
    """An output that is the rate of another one, by the system file."""

    position: int
    speed: int
    factor: float  # of the slope of the position


@dataclass(frozen=True)
class Ratio:
    """Runs in which a speed is another multiple of the slope than in the others."""

    rate: Rate
    runs: Mask  # (experiments,)
    factor: float  # of the multiple, relative to that of the other runs


@dataclass(frozen=True)
class _Fit:
    """A speed as a multiple of a slope, by run; nan where noise hides the motion."""

    multiple: Array  # relative to that of the system file, (experiments,)
    explains: Array  # share of the power of the speed above the noise, (experiments,)
    #: Whether the residual is small for the speed of the usual run, (experiments,): noise where little moves.
    small: Mask
    clear: Mask  # whether the noise is small for the motion, (experiments,)

    @property
    def holds(self) -> Mask:
        """Return the runs, shape (experiments,), in which the speed is some positive multiple."""
        return np.asarray((self.explains >= 1.0 - REST**2) & (self.multiple > 0.0))

    @property
    def right(self) -> Mask:
        """Return the runs, shape (experiments,), in which it is the slope, as far as a sensor's gain."""
        size = np.maximum(self.multiple, np.finfo(float).tiny)
        return np.asarray(self.holds & (np.abs(np.log(size)) < np.log(FACTOR)))

    @property
    def fails(self) -> Mask:
        """Return the runs, shape (experiments,), in which the speed is no positive multiple."""
        return np.asarray(((self.explains < COMMON) | (self.multiple < 0.0)) & ~self.small)


def rates(system: System) -> tuple[Rate, ...]:
    """Return the outputs that are the rate of another one, times a number.

    Both are compared at random points: to simplify their quotient takes minutes for a mechanism.
    """
    speeds = dict(zip(system.x, system.closed, strict=True))
    positions = [
        p
        for p, output in enumerate(system.outputs)
        if output.expression.free_symbols & set(speeds) and not output.expression.has(*system.u)
    ]
    slopes = [
        sp.Add(*(sp.diff(system.outputs[p].expression, x) * rate for x, rate in speeds.items()))
        for p in positions
    ]
    shown = [output.expression for output in system.outputs]
    rng = np.random.default_rng(0)
    x, u, c = (rng.uniform(0.1, 1.0, (POINTS, len(each))) for each in (system.x, system.u, system.c))
    program = Program.of_values(system, [*slopes, *shown])
    with np.errstate(all="ignore"):
        values = program.evaluate(np.array(0.0), x, u, np.array(system.values), c)
        ratios = values[:, None, len(slopes) :] / values[:, : len(slopes), None]
    found = []
    for k, p in enumerate(positions):
        for s in range(len(shown)):
            ratio = ratios[:, k, s]
            same = np.isfinite(ratio).all() and np.ptp(ratio) <= ROUNDING * abs(ratio[0])
            if s != p and same and ratio[0] != 0.0:
                found.append(Rate(p, s, float(ratio[0])))
    return tuple(found)


def rate_faults(system: System, logs: Logs, sensors: Sensors) -> Iterator[LogFault]:
    """Yield a fault for runs in which a speed and its position contradict each other beyond doubt."""
    pairs = rates(system)
    fits = {rate: _fit(system, sensors, rate.position, rate) for rate in pairs}
    told = np.zeros(len(logs), np.bool_)
    if all(fit.holds.all() for fit in fits.values()):
        return
    for fault, runs in _exchanged(system, sensors, fits):
        told |= runs
        yield fault
    for rate, fit in fits.items():
        if not np.mean(fit.holds) > COMMON:
            continue  # the system file may be wrong, or the sensor
        still = {j: _still(logs, sensors, rate, j) for j in (rate.position, rate.speed)}
        for j, (runs, since) in still.items():
            if (runs := runs & (fit.explains < 1.0 - REST**2) & ~told).any():
                yield _stands(logs, rate, j, runs, since)
                told |= runs
        if (runs := fit.fails & (fit.explains < COMMON) & ~told).any():
            yield _apart(logs, rate, runs)
            told |= runs


def ratios(system: System, logs: Logs, sensors: Sensors) -> Iterator[Ratio]:
    """Yield runs, less than half of all, in which a speed is another multiple of the slope."""
    for rate in rates(system):
        fit = _fit(system, sensors, rate.position, rate)
        if not np.mean(fit.holds) > COMMON:
            continue
        usual = float(np.median(fit.multiple[fit.holds]))
        other = fit.holds & fit.clear & (np.abs(fit.multiple / usual - 1.0) > 2.0 * SAME)
        if 0 < other.sum() < COMMON * len(logs):
            factor = float(np.median(fit.multiple[other])) / usual
            if np.abs(fit.multiple[other] / (usual * factor) - 1.0).max() < SAME:
                yield Ratio(rate, other, factor)


def _fit(system: System, sensors: Sensors, position: int, rate: Rate, speed: int | None = None) -> _Fit:
    """Fit the speed of every run by the slope of an output and a constant.

    Power that the noise of the two explains does not count as a residual.
    """
    logs, speed = sensors.logs, rate.speed if speed is None else speed
    late = [output.delay for output in system.outputs]
    slope = rate.factor * sensors.slope(position, late[position])
    doubt = (rate.factor * sensors.slope_error(position)) ** 2
    shown, white = sensors.shown(speed, late[speed]), float(sensors.noise[speed]) ** 2
    multiple, explains, residual = np.zeros(len(logs)), np.ones(len(logs)), np.zeros(len(logs))
    clear = np.zeros(len(logs), np.bool_)
    power = np.array([shown[logs.rows(i)].var() for i in range(len(logs))])
    for i in range(len(logs)):
        s, v = (each[logs.rows(i)] - each[logs.rows(i)].mean() for each in (slope, shown))
        whole, own, error = float(v @ v), float(s @ s), float(doubt[logs.rows(i)].sum())
        residual[i] = float(np.mean((v - s) ** 2))
        multiple[i] = float(s @ v) / max(own - error, COMMON * own, np.finfo(float).tiny)
        if whole < 2.0 * white * len(v):
            multiple[i] = explains[i] = np.nan  # hardly more than noise
            continue
        clear[i] = REST**2 * whole > white * len(v) and REST**2 * own > error
        rest = v - multiple[i] * s
        left = float(rest @ rest) - white * len(v) - multiple[i] ** 2 * error
        explains[i] = 1.0 - max(left, 0.0) / (whole - white * len(v))
    return _Fit(multiple, explains, residual < REST * np.median(power), clear)


def _exchanged(system: System, sensors: Sensors, fits: dict[Rate, _Fit]) -> Iterator[tuple[LogFault, Mask]]:
    """Yield exchanges of two columns with which all speeds are the slopes that they should be."""
    logs = sensors.logs
    wrong = np.any([fit.fails for fit in fits.values()], axis=0)
    if not wrong.any():
        return
    found: list[tuple[tuple[int, int], Mask]] = []
    for pair in combinations(range(len(logs.outputs)), 2):
        read = {j: j for j in range(len(logs.outputs))} | dict((pair, pair[::-1]))
        if not any({rate.position, rate.speed} & {*pair} for rate in fits):
            continue
        cured = wrong.copy()
        for rate, fit in fits.items():
            other = _fit(system, sensors, read[rate.position], rate, read[rate.speed])
            touched = {rate.position, rate.speed} & {*pair}
            cured &= (other if touched else fit).right
        if cured.any():
            found.append((pair, cured))
    for k, (pair, runs) in enumerate(found):
        same = [each for each, others in found[k + 1 :] if (others == runs).all()]
        if not any((others & runs).any() for _, others in found[:k]):
            yield _of_exchange(logs, pair, runs, same), runs


def _of_exchange(logs: Logs, pair: tuple[int, int], runs: Mask, same: Sequence[tuple[int, int]]) -> LogFault:
    names = logs.outputs[pair[0]], logs.outputs[pair[1]]
    alike = tuple(((logs.outputs[a], logs.outputs[b]), EXCHANGED) for a, b in same)
    others = [f"{listed(channels)} ({problem})" for channels, problem in alike]
    also = f" These logs cannot distinguish it from {' or '.join(others)}." if others else ""
    said = (
        f"{listed(names)}{_of(logs, runs)} look as if their columns were exchanged: the other way round, "
        f"each speed is the slope of its position.{also} Check the headers, then diagnose again."
    )
    ids = () if runs.all() else _ids(logs, runs)
    return LogFault(names, EXCHANGED, None, ids, said, True, alike)


def _still(logs: Logs, sensors: Sensors, rate: Rate, output: int) -> tuple[Mask, float]:
    """Return the runs (experiments,) in which a column stands still to the end, and the first such time, s.

    The other column moves on there, by far more than its noise.
    """
    witness = sensors.slope(rate.position, 0.0) if output == rate.speed else logs.y[:, rate.speed]
    width = max(sensors.slopes[rate.position].width, int(1.0 / SAME))
    runs, first = np.zeros(len(logs), np.bool_), np.inf
    for i in range(len(logs)):
        y, other = logs.y[logs.rows(i), output], witness[logs.rows(i)]
        moves = np.flatnonzero(np.diff(y))
        start = int(moves[-1]) + 1 if len(moves) else 0
        if start and len(y) - start >= STILL * width:
            runs[i] = float(np.std(other[start:])) > COMMON * float(np.std(other[:start]))
            first = min(first, start * logs.period) if runs[i] else first
    return runs, first


def _stands(logs: Logs, rate: Rate, output: int, runs: Mask, since: float) -> LogFault:
    name = logs.outputs[output]
    (other,) = {logs.outputs[rate.position], logs.outputs[rate.speed]} - {name}
    said = (
        f"{name}{_of(logs, runs)} stands still from {on_clock(since, logs.clock)} to the end, while {other} "
        "moves on. Repair the recording, or cut it there, then diagnose again."
    )
    return LogFault((name,), STANDS, None, _ids(logs, runs), said, True)


def _apart(logs: Logs, rate: Rate, runs: Mask) -> LogFault:
    """Return the fault that a speed and its position do not belong together."""
    position, speed = logs.outputs[rate.position], logs.outputs[rate.speed]
    said = (
        f"{speed}{_of(logs, runs)} is not the slope of {position}, as it is in the other runs: one of the "
        "two columns is wrong there. Check whether it comes from another run or sensor, then diagnose again."
    )
    alike = (((position,), APART),)
    return LogFault((speed,), APART, None, _ids(logs, runs), said, True, alike)


def _of(logs: Logs, runs: Mask) -> str:
    return "" if runs.all() else f" of {listed(_ids(logs, runs))}"


def _ids(logs: Logs, runs: Mask) -> tuple[str, ...]:
    return tuple(logs.ids[i] for i in np.flatnonzero(runs).tolist())
