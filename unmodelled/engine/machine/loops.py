"""Loops of the register machine, for any program; they are compiled once."""

# mypy: ignore-errors

import numpy as np

from unmodelled.engine.compiled.layout import jit
from unmodelled.engine.machine.interpreter import execute
from unmodelled.engine.machine.opcodes import LANES

#: Lanes are filled up to a multiple of this, so that loops over them have no rest outside vector registers.
FULL = 16


@jit()
def filled(lanes):
    """Return the number of lanes to compute, a multiple of `FULL`, where `lanes` of them count."""
    return -(-lanes // FULL) * FULL


@jit()
def fill_numbers(w, row, numbers):
    for j in range(len(numbers)):
        for i in range(LANES):
            w[row + j, i] = numbers[j]


@jit()
def fill_samples(w, row, values, first, lanes):
    """Write samples from `first` on, shape (samples, columns), to the lanes; the last one fills the rest."""
    for i in range(filled(lanes)):
        k = first + min(i, lanes - 1)
        for j in range(values.shape[1]):
            w[row + j, i] = values[k, j]


@jit()
def at_share(w, lanes, at, now, slope, clock, share, period):
    """Write inputs and time at a share (0 to 1) of a period after the last sample into the registers w."""
    for j in range(len(now)):
        for i in range(lanes):
            w[at.u + j, i] = now[j, i] + share * slope[j, i]
    for i in range(lanes):
        w[at.t, i] = clock[i] + share * period


@jit()
def at_sample(lanes, now, slope, after, clock, windows, k, start, steps, shift, hold):
    """Read the inputs and slopes of every lane at sample k of its window, after its end at the last one."""
    for i in range(lanes):
        clock[i] = windows.t[start[i] + min(k, steps[i])]
    for j in range(len(now)):
        if k == 0:
            for i in range(lanes):
                after[j, i] = windows.u[shift[i] + start[i], j]
        for i in range(lanes):
            now[j, i] = after[j, i]
            after[j, i] = windows.u[shift[i] + start[i] + min(k + 1, steps[i]), j]
            slope[j, i] = hold[j] * (after[j, i] - now[j, i])


@jit()
def advance_state(lanes, rate, now, total, last, weight, part, stage):
    """Advance one state by one stage, see `advance`; all arrays have the shape (lanes,)."""
    if stage == 0:
        for i in range(lanes):
            total[i] = last[i] + weight * rate[i]
            now[i] = last[i] + part * rate[i]
    elif stage == 3:
        for i in range(lanes):
            last[i] = total[i] + weight * rate[i]
            now[i] = last[i]
    else:
        for i in range(lanes):
            total[i] += weight * rate[i]
            now[i] = last[i] + part * rate[i]


@jit()
def advance(w, lanes, rates, k1, total, last, stage, h):
    """Write the state of the next stage of Runge and Kutta's method, or of the next step."""
    weight = h / 3.0 if stage == 1 or stage == 2 else h / 6.0
    part = h if stage == 2 else 0.5 * h
    n = len(rates)
    # the rate of one state may be the register of another, which is about to change
    for j in range(n):
        if rates[j] < n:
            for i in range(lanes):
                k1[j, i] = w[rates[j], i]
    for j in range(n):
        if rates[j] < n:
            advance_state(lanes, k1[j], w[j], total[j], last[j], weight, part, stage)
        else:
            advance_state(lanes, w[rates[j]], w[j], total[j], last[j], weight, part, stage)


@jit()
def begin(w, at, windows, p, c, x0, first, lanes, start, steps, shift, last):
    """Write parameters, constants and first states of the lanes; return the steps of the longest window."""
    sets, longest, wide = x0.shape[1], 0, filled(lanes)
    for i in range(wide):
        lane = first + min(i, lanes - 1)
        m, b = lane // sets, lane % sets
        start[i], steps[i] = windows.start[m], windows.steps[m]
        shift[i], owner = windows.shift[b], windows.owner[m]
        longest = max(longest, steps[i])
        for j in range(p.shape[2]):
            w[at.p + j, i] = p[owner, b, j]
        for j in range(c.shape[1]):
            w[at.c + j, i] = c[owner, j]
        for j in range(x0.shape[2]):
            last[j, i] = w[j, i] = x0[m, b, j]
    return longest


@jit()
def simulate(program, windows, p, c, x0, substeps, period, hold, y):
    """Write the observed values of all windows for all sets to y (windows, sets, samples, observed).

    Samples after a window stay as they are. Takes parameters p (experiments, sets, parameters), constants c
    (experiments, constants), initial states x0 (windows, sets, states); period in s; hold (inputs,), 1 for an
    input that runs straight to its next sample, 0 for one that is held.
    """
    at, code, curves = program.at, program.code, program.curves
    n, m = x0.shape[2], windows.u.shape[1]
    h = period / substeps
    w = np.zeros((at.rows, LANES))
    fill_numbers(w, at.numbers, program.numbers)
    for i in range(LANES):
        w[at.step, i] = h
    start, steps, shift = np.empty(LANES, np.int64), np.empty(LANES, np.int64), np.empty(LANES, np.int64)
    last, total, k1 = np.empty((n, LANES)), np.empty((n, LANES)), np.empty((n, LANES))
    now, slope, after = np.empty((m, LANES)), np.empty((m, LANES)), np.empty((m, LANES))
    clock, shown = np.empty(LANES), program.shown
    count = len(windows.start) * x0.shape[1]
    # a run in every row
    runs = y.reshape(count, y.shape[2], y.shape[3])
    for first in range(0, count, LANES):
        lanes = min(LANES, count - first)
        wide = filled(lanes)
        longest = begin(w, at, windows, p, c, x0, first, lanes, start, steps, shift, last)
        execute(w, wide, code, at.prologue, at.driven, curves)
        for k in range(longest + 1):
            at_sample(wide, now, slope, after, clock, windows, k, start, steps, shift, hold)
            at_share(w, wide, at, now, slope, clock, 0.0, period)
            execute(w, wide, code, at.driven, at.observed, curves)
            execute(w, wide, code, at.observed, at.rates, curves)
            for j in range(len(shown)):
                for i in range(lanes):
                    if k <= steps[i]:
                        runs[first + i, k, j] = w[shown[j], i]
            if k == longest:
                break
            for sub in range(substeps):
                for stage in range(4):
                    if stage == 1 or stage == 3:
                        share = (sub + (0.5 if stage == 1 else 1.0)) / substeps
                        at_share(w, wide, at, now, slope, clock, share, period)
                        execute(w, wide, code, at.driven, at.observed, curves)
                    execute(w, wide, code, at.rates, at.end, curves)
                    advance(w, wide, program.rates, k1, total, last, stage, h)


@jit()
def evaluate(program, t, x, u, p, c, y):
    """Write the observed values y (samples, observed) at given times, states, inputs and parameters.

    t (samples, 1), x (samples, states), u (samples, inputs), p (samples, parameters), c (samples, constants).
    """
    at, code, curves = program.at, program.code, program.curves
    w = np.zeros((at.rows, LANES))
    fill_numbers(w, at.numbers, program.numbers)
    for first in range(0, len(t), LANES):
        lanes = min(LANES, len(t) - first)
        wide = filled(lanes)
        fill_samples(w, at.t, t, first, lanes)
        fill_samples(w, 0, x, first, lanes)
        fill_samples(w, at.u, u, first, lanes)
        fill_samples(w, at.p, p, first, lanes)
        fill_samples(w, at.c, c, first, lanes)
        execute(w, wide, code, at.prologue, at.rates, curves)
        for i in range(lanes):
            for j in range(len(program.shown)):
                y[first + i, j] = w[program.shown[j], i]


@jit()
def evaluate_sets(program, t, u, p, c, owner, y):
    """Write the values y (samples, sets, observed) of equations without states, 0 where they are not finite.

    t (samples, 1), u (samples, inputs), p (sets, parameters), c (experiments, constants), owner (samples,),
    number of the experiment.
    """
    at, code, curves = program.at, program.code, program.curves
    w = np.zeros((at.rows, LANES))
    fill_numbers(w, at.numbers, program.numbers)
    for first in range(0, len(t), LANES):
        lanes = min(LANES, len(t) - first)
        wide = filled(lanes)
        fill_samples(w, at.t, t, first, lanes)
        fill_samples(w, at.u, u, first, lanes)
        for i in range(wide):
            for j in range(c.shape[1]):
                w[at.c + j, i] = c[owner[first + min(i, lanes - 1)], j]
        for s in range(len(p)):
            fill_numbers(w, at.p, p[s])
            execute(w, wide, code, at.prologue, at.rates, curves)
            for j in range(len(program.shown)):
                shown = w[program.shown[j]]
                for i in range(lanes):
                    y[first + i, s, j] = shown[i] if np.isfinite(shown[i]) else 0.0
