"""Registers of a drive that are read as unsigned numbers: a bit for the sign, or two's complement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.logs.inspection.counts import count_of
from unmodelled.logs.inspection.signal import Finding, Run, Signal

KIND = "register"
#: Numbers of bits that a register can have.
SHORTEST, LONGEST = 8, 32
#: Fewest levels of either sign: a converter at its end repeats one number.
LEVELS = 16
#: Step where the sign changes, in the largest step of one sign: a course goes on where it passes zero.
GOES_ON = 2.0
#: Relative error of a count that was found from rounded values.
ROUNDING = 1e-6
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Register:
    """Numbers with a sign, read as numbers without one."""

    bits: int
    bit: float  # value of the bit that turns the sign, or of 2**bits for two's complement, SI
    complement: bool  # two's complement; otherwise the highest bit is the sign
    zero: float  # value of a number that is zero, SI

    def negative(self, values: Array) -> Mask:
        """Return the mask (samples,) of values that stand for negative numbers."""
        return np.asarray(values - self.zero >= (0.5 if self.complement else 1.0 - ROUNDING) * self.bit)

    def decoded(self, values: Array) -> Array:
        """Return the values (samples,) with their signs."""
        size = values - self.zero - self.bit
        return np.where(self.negative(values), self.zero + (size if self.complement else -size), values)

    @property
    def words(self) -> str:
        """Return what such a channel looks like."""
        if self.complement:
            return f"a signed number of {self.bits} bits that is read as unsigned"
        return f"a register whose bit {self.bits - 1} is the sign"

    @property
    def counts(self) -> int:
        """Return the number of counts by which values jump where the sign changes."""
        return int(2 ** (self.bits if self.complement else self.bits - 1))


def register(runs: Sequence[Run]) -> tuple[list[Run], list[Finding]]:
    """Decode registers in all runs alike: which number a value stands for does not depend on the run.

    Such a channel is never negative, and jumps by a power of two counts wherever it would change its sign;
    with the signs it does not jump.
    """
    found, runs = list[Finding](), list(runs)
    for signal in runs[0].signals:
        parts = [run.values[signal.column] for run in runs]
        kind = register_of(parts, signal)
        if kind is None:
            continue
        runs = [run.with_values(signal, kind.decoded(part)) for run, part in zip(runs, parts, strict=True)]
        size = "" if signal.unit.strip() in ("", "1", "-") else f" ({kind.bit:.4g} {signal.unit})"
        by = f"jumps by {kind.counts} counts{size} where it would change its sign"
        what = f"{by} {{count}} times, as {kind.words},"
        cure = "its values were decoded in all runs; log the signed number"
        for run, part in zip(runs, parts, strict=True):
            changes = np.flatnonzero(np.diff(kind.negative(part)))
            if len(changes):
                first = float(run.t[changes[0] + 1] - run.t[0])
                found.append(Finding(KIND, signal.name, run.name, len(changes), first, what, cure))
    return runs, found


def register_of(parts: Sequence[Array], signal: Signal) -> Register | None:
    """Return how numbers of all runs (samples,) are to be read; None where they are right.

    In other runs a channel may be logged with its sign: decoding leaves such numbers as they are.
    """
    signed, unsigned = list[Array](), list[Array]()
    for part in parts:
        (signed if float(part.min()) < signal.zero else unsigned).append(part)
    if not unsigned or np.ptp(np.concatenate(unsigned)) == 0.0:
        return None
    for kind in _likely(np.concatenate(unsigned), signal):
        if _is(kind, unsigned, signal) and not any(kind.negative(part).any() for part in signed):
            return kind
    return None


def registers_of_steps(values: Array, signal: Signal) -> Iterator[Register]:
    """Yield how the few levels (samples,) of an input in steps may be numbers with a sign.

    Nothing but a model tells whether they are: they jump anyway. The unit of the levels is a power of two
    counts times the count, so that numbers of bits are unknown.
    """
    levels = np.unique(np.append(values, signal.zero))
    if len(levels) > 2 and len(levels) < 2 * LEVELS and levels[0] == signal.zero:
        for kind in _registers(float(levels[-1] - signal.zero), _common(levels), signal, 1):
            if kind.negative(levels).any() and not kind.negative(values).all():
                yield kind


def _common(levels: Array) -> float:
    """Return the largest unit of which all levels (levels,) are whole multiples, by Euclid's algorithm."""
    unit, least = 0.0, ROUNDING * float(levels[-1])
    for rest in levels.tolist():
        while rest > least:
            unit, rest = rest, unit % rest if unit % rest < rest - least else 0.0
    return unit


def _likely(values: Array, signal: Signal) -> Iterator[Register]:
    """Yield the registers that the largest value allows."""
    levels = np.unique(values)
    low = levels[: int(np.argmax(np.diff(levels))) + 1]  # below the widest gap: positive numbers
    unit = count_of(low) if len(low) >= LEVELS else 0.0
    yield from _registers(float(levels[-1] - signal.zero), unit, signal, SHORTEST)


def _registers(highest: float, unit: float, signal: Signal, shortest: int) -> Iterator[Register]:
    """Yield registers of counts (SI) by the highest value: the powers of two below and above it."""
    if unit <= 0.0:
        return
    top = highest / unit
    for power in range(shortest - 1, LONGEST + 1):
        below, above = 2.0**power <= top * (1.0 + ROUNDING), top <= 2.0**power * (1.0 + ROUNDING)
        if below and power < LONGEST and top < 2.0 ** (power + 1):
            yield Register(power + 1, unit * 2.0**power, False, signal.zero)
        if above and power >= shortest and top > 2.0 ** (power - 1):
            yield Register(power, unit * 2.0**power, True, signal.zero)


def _is(kind: Register, parts: Sequence[Array], signal: Signal) -> bool:
    """Return whether values jump where the sign changes, and do not jump once they are decoded."""
    negative = np.concatenate([kind.negative(part) for part in parts])
    values = np.concatenate(parts)
    if min(len(np.unique(values[negative])), len(np.unique(values[~negative]))) < LEVELS:
        return False
    if float(kind.decoded(values[negative]).mean()) > kind.zero:
        return False  # the bit is close to another kind's
    changes = np.concatenate([np.diff(kind.negative(part)) for part in parts])
    raw, decoded = (
        np.abs(np.concatenate([np.diff(each) for each in courses]))
        for courses in (parts, [kind.decoded(part) for part in parts])
    )
    if not changes.any() or changes.all():
        return False
    step = float(raw[~changes].max())
    if signal.unit.strip() == "rad" and abs(kind.bit - TURN) < GOES_ON * step:
        return False  # a wrapped angle
    return float(raw[changes].min()) > step and float(decoded[changes].max()) <= GOES_ON * step
