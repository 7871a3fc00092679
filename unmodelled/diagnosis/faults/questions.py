"""Questions about logs: signs, units, inputs without effect, the unit of time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from unmodelled.base.arrays import Mask
from unmodelled.diagnosis.data.remark import listed
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.logs.inspection.pairs import multiples
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Name of the channel of time in a log, and of the problem of a factor that is no usual unit.
TIME_CHANNEL, FACTOR_PROBLEM = "t", "factor"
#: Base units whose channels a logger writes in the same unit: all angles and speeds in degrees, say.
BASES = "rad", "m"
#: Parts of a run whose first and last one are compared; ratio of their standard deviations above which a
#: motion lasts, and fewest crossings of the mean in the last part.
THIRDS, LASTING, CROSSINGS = 3, 0.7, 4
#: Relative difference up to which a multiple of a slope is another unit.
NEAR = 0.02


@dataclass(frozen=True)
class LogProblem:
    """A fault of a channel that a factor corrects."""

    name: str  # in diagnosis.json
    factor: float  # of the logged values, which corrects the fault
    base: str  # base unit of the channels that can have the fault; "" for any
    looks: str  # what follows "looks" in a sentence
    done: str  # the correction in words
    cure: str  # what to do, an imperative


_CONVERT = "Convert the column"
PROBLEMS = (
    LogProblem(
        "sign", -1.0, "", "as if its sign were reversed", "multiplied by -1", "Reverse the sign of the column"
    ),
    LogProblem(
        *("degrees", math.pi / 180.0, "rad", "like degrees", "multiplied by pi/180"),
        "Write `unit: deg` (or deg/s) in the system file, or convert the column",
    ),
    LogProblem(
        "radians", 180.0 / math.pi, "rad", "as if its unit were 57.3 rad", "multiplied by 180/pi", _CONVERT
    ),
    LogProblem("milli", 1e-3, "", "like thousandths of its unit", "multiplied by 1e-3", _CONVERT),
    LogProblem("kilo", 1e3, "", "like thousands of its unit", "multiplied by 1e3", _CONVERT),
)
#: Factors with which outputs and inputs are far off: no prediction by the known physics is of any use.
EXTREMES = tuple(
    LogProblem(*(name, float(by), "", f"like {word} of its unit", f"multiplied by {by}", _CONVERT))
    for name, by, word in (
        *(("deci", "0.1", "tenths"), ("deca", "10", "tens")),
        *(("centi", "0.01", "hundredths"), ("hecto", "100", "hundreds")),
        *(("micro", "1e-6", "millionths"), ("nano", "1e-9", "billionths")),
        *(("mega", "1e6", "millions"), ("giga", "1e9", "billions")),
    )
)
NO_EFFECT = LogProblem(
    *("no_effect", 0.0, "", "as if it had no effect", "replaced by zero"),
    "Check that the column is the input that drove the machine",
)
#: Names of the given factors of channels, but for the sign.
GIVEN = frozenset(problem.name for problem in (NO_EFFECT, *PROBLEMS, *EXTREMES)) - {"sign"}
UNRELATED = replace(
    NO_EFFECT,
    looks="as if it had nothing to do with the outputs: random signals of its spectrum predict them as well",
)
EXCHANGED = LogProblem(
    *("exchanged", 1.0, "", "as if their columns were exchanged", "read the other way round"),
    "Check the headers",
)
CLOCKS = (
    LogProblem("milliseconds", 1e-3, "", "like milliseconds", "multiplied by 1e-3", _CONVERT),
    LogProblem("microseconds", 1e-6, "", "like microseconds", "multiplied by 1e-6", _CONVERT),
    LogProblem("kiloseconds", 1e3, "", "like thousands of seconds", "multiplied by 1e3", _CONVERT),
    LogProblem("megaseconds", 1e6, "", "like millions of seconds", "multiplied by 1e6", _CONVERT),
)


@dataclass(frozen=True, eq=False)
class Question:
    """Ask whether a correction explains the gap."""

    problem: LogProblem
    channels: tuple[str, ...]  # outputs and inputs that may have the fault
    correction: Correction  # of all experiments


def questions(system: System, logs: Logs, useless: bool = True) -> Iterator[Question]:
    """Yield a question for every factor and every group of channels, the simplest ones first.

    Inputs without effect come first: a thousandth of an input has hardly any effect either. Inputs come
    before outputs: on a symmetric machine the sign of either can be wrong.
    """
    units = {item.name: item.unit for item in system.inputs}
    units |= {item.name: item.unit for item in system.outputs}
    for name in logs.inputs:
        yield _scaled(NO_EFFECT, (name,), logs)
    for channels in groups(system):
        for problem in (*PROBLEMS, *(EXTREMES if useless else ())):
            if not problem.base or {problem.base} == {_base(units[name]) for name in channels}:
                yield _scaled(problem, channels, logs)


def exchanged(logs: Logs) -> Iterator[Question]:
    """Yield the question whether two columns are exchanged, for every pair with an output."""
    for one, other in combinations(range(len(logs.outputs)), 2):
        names = logs.outputs[one], logs.outputs[other]
        yield Question(EXCHANGED, names, Correction.exchanged(logs, one, other))
    for (i, source), (j, output) in product(enumerate(logs.inputs), enumerate(logs.outputs)):
        yield Question(EXCHANGED, (source, output), Correction.exchanged_input(logs, i, j))


def without_inputs(logs: Logs) -> Question:
    """Return the question whether no input has anything to do with the outputs."""
    return _scaled(UNRELATED, logs.inputs, logs)


def multiplied(logs: Logs, channels: tuple[str, ...], factor: float) -> Question:
    """Return the question whether channels are to be multiplied by a factor."""
    size = f"{1.0 / factor:.3g} times too large" if factor < 1.0 else f"{factor:.3g} times too small"
    problem = LogProblem(
        *(FACTOR_PROBLEM, factor, "", f"as if its numbers were {size}", f"multiplied by {factor:.4g}"),
        "Check the unit and the range of the column in these runs",
    )
    return _scaled(problem, channels, logs)


def multiples_of_slopes(system: System, logs: Logs) -> Iterator[tuple[Question, Question, float]]:
    """Yield questions for every speed that is a multiple of the slope of its position in all runs.

    Of the speed, of the position, and how many times.
    """
    known = [abs(problem.factor) for problem in PROBLEMS if problem.factor != -1.0]
    for found in multiples(system, logs.y, logs.offsets, logs.period):
        if any(abs(found.factor * factor - 1.0) < NEAR for factor in known):
            continue  # a unit, which the next questions name
        looks = f"like {found.factor:.3g} times the slope of {logs.outputs[found.position]}"
        cure = "Convert the column (an electrical speed is that of the shaft times the pole pairs)"
        problem = LogProblem("slope", 1.0 / found.factor, "", looks, f"divided by {found.factor:.4g}", cure)
        speed, position = ((logs.outputs[k],) for k in (found.speed, found.position))
        yield _scaled(problem, speed, logs), multiplied(logs, position, found.factor), found.factor


def clocks(system: System, logs: Logs) -> Iterator[Question]:
    """Yield a question for every other unit of time in which known delays are shorter than experiments."""
    none = Correction.none(logs)
    delays = *(i.delay for i in system.inputs), *(o.delay for o in system.outputs)
    longest = max(map(abs, delays))
    shortest = logs.period * (float(np.diff(logs.offsets).min()) - 2.0)
    for problem in CLOCKS:
        if longest < problem.factor * shortest:
            yield Question(problem, (TIME_CHANNEL,), replace(none, clock=problem.factor * none.clock))


def constants(logs: Logs) -> Iterator[LogFault]:
    """Yield a fault for every input that is constant over all experiments; it decides nothing."""
    for name, values in zip(logs.inputs, logs.u.T, strict=True):
        if np.ptp(values) == 0.0:
            yield LogFault(
                *((name,), "constant", None, ()),
                sentence=f"{name} is {values[0] + 0.0:g} in all samples of all experiments: these data "
                "cannot show its effect. Check that the column is the input that drove the machine.",
                decides=False,
            )


def without_input(logs: Logs, runs: Mask) -> LogFault:
    """Return the fault that runs (experiments,) are driven although all their inputs are zero."""
    ids = tuple(logs.ids[i] for i in np.flatnonzero(runs))
    sentence = (
        f"{listed(logs.inputs)} of {listed(ids)} {'is' if len(logs.inputs) == 1 else 'are'} zero in all "
        "samples, but the outputs keep on swinging. Check that the column is the input that drove the "
        "machine in these runs, then diagnose again."
    )
    return LogFault(logs.inputs, "constant", None, ids, sentence, decides=True)


def moves_without_input(logs: Logs) -> Mask:
    """Return the runs, shape (experiments,), with inputs of zero in which the outputs keep on swinging.

    Free motion dies out: a machine that swings as much at the end of its runs as at their beginning is driven
    by something that the logs do not show.
    """
    rows = [logs.rows(i) for i in range(len(logs))]
    runs = np.array([bool(logs.inputs) and not np.any(logs.u[own]) for own in rows])
    if not runs.any():
        return runs
    ratios, crossings = [], []
    for own in (rows[i] for i in np.flatnonzero(runs).tolist()):
        first, *_, last = np.array_split(logs.y[own], THIRDS)
        ratios.append(last.std(axis=0) / np.maximum(first.std(axis=0), 1e-300))
        above = last > last.mean(axis=0)
        crossings.append(np.count_nonzero(above[1:] != above[:-1], axis=0))
    swings = (np.median(ratios, axis=0) > LASTING) & (np.median(crossings, axis=0) >= CROSSINGS)
    if not runs.all():  # at rest, the noise swings on: the others show how large a motion is
        size = np.array([logs.y[own].std(axis=0) for own in rows])
        swings &= np.median(size[runs], axis=0) > LASTING * np.median(size[~runs], axis=0)
    return runs & bool(swings.all())


def moves_with_constant_inputs(logs: Logs) -> Mask:
    """Return the runs, shape (experiments,), with constant inputs that swing as those with other inputs do.

    They swing about as far as one of these at least, and die out no more than one of these.
    """
    rows = [logs.rows(i) for i in range(len(logs))]
    still = np.array([np.ptp(logs.u[own], axis=0).max(initial=0.0) == 0.0 for own in rows])
    if still.all() or not still.any():
        return np.zeros(len(logs), np.bool_)
    parts = [np.array_split(logs.y[own], THIRDS) for own in rows]
    lasting = np.array(
        [last.std(axis=0) / np.maximum(first.std(axis=0), 1e-300) for first, *_, last in parts]
    )
    size = np.array([last.std(axis=0) for *_, last in parts])
    swings = [own >= LASTING * own[~still].min(axis=0) for own in (lasting, size)]
    return np.asarray(still & np.all(swings, axis=(0, 2)))


def unchanged_inputs(logs: Logs, runs: Mask) -> LogFault:
    """Return the fault, which decides nothing, that inputs are constant in some runs (experiments,)."""
    others = [np.ptp(logs.u[logs.rows(i)], axis=0) for i in np.flatnonzero(~runs).tolist()]
    names = tuple(np.array(logs.inputs)[np.max(others, axis=0) > 0.0].tolist())
    ids = tuple(logs.ids[i] for i in np.flatnonzero(runs))
    sentence = (
        f"{listed(names)} {'does' if len(names) == 1 else 'do'} not change in {listed(ids)} while outputs "
        "swing as in the other runs, and the known model needs an input for it. Check that the column is the "
        "input that drove the machine in these runs, or leave them out, then diagnose again."
    )
    return LogFault(names, "constant", None, ids, sentence, decides=False)


def groups(system: System) -> list[tuple[str, ...]]:
    """Return groups of channels that may share a fault.

    Every channel alone comes first, then a position with its speed, all inputs of one unit, all outputs of
    one base unit, and all channels of one base unit.
    """
    inputs = {item.name: item.unit for item in system.inputs}
    outputs = {item.name: item.unit for item in system.outputs}
    found: list[tuple[str, ...]] = [(name,) for name in (*inputs, *outputs)]
    for position, speed in zip(system.x, system.dynamics, strict=True):
        if speed in system.x:
            found.append(tuple(o.name for o in system.outputs if o.expression in (position, speed)))
    found += [tuple(n for n, unit in inputs.items() if unit == same) for same in inputs.values()]
    for base in BASES:
        for among in (outputs, {**inputs, **outputs}):
            found.append(tuple(n for n, u in among.items() if _base(u) == base))
    return list(dict.fromkeys(names for names in found if names))


def _base(unit: str) -> str:
    """Return the base unit of a rate: rad of rad/s and of rad/s^2."""
    return unit.split("/")[0].strip()


def _scaled(problem: LogProblem, channels: tuple[str, ...], logs: Logs) -> Question:
    none = Correction.none(logs)
    gain, drive = (
        np.where(np.isin(names, channels), problem.factor, ones)
        for names, ones in ((logs.outputs, none.gain), (logs.inputs, none.drive))
    )
    return Question(problem, channels, replace(none, gain=gain, drive=drive))
