"""Training inside the compiled loop: gradient of a mini-batch, step of Adam, next mini-batch."""

# mypy: ignore-errors

import math

import numpy as np
from numba import types

from unmodelled.engine.compiled import loops
from unmodelled.engine.compiled.layout import LANES, Array, Block, LayoutType, entry, jit
from unmodelled.engine.compiled.loops import COMMON, ONE, WIDE, Indices, Rows, f, i, place


@jit()
def adjoint_of_loss(at, xs, gs, zs, gz, first, Xd, left, steps, share, C_x, penalty):
    """Return the loss of the first `left` lanes of a block by eq. 4.9; its gradients go to gs and gz."""
    loss, counted, n, m = 0.0, place(left), place(at.states), place(at.networks)
    for a in range(n * WIDE):
        gs[a] = 0.0
    for k in range(ONE, place(steps) + ONE):
        for j in range(n):
            for lane in range(WIDE):
                a = (k * n + j) * WIDE + lane
                weight = C_x[j] * share if lane < counted else 0.0
                error = xs[a] - Xd[place(first[lane]) + k, j]
                gs[a] = 2.0 * weight * error
                loss += weight * error * error
    for k in range(place(steps)):
        for j in range(m):
            for lane in range(WIDE):
                a = (k * m + j) * WIDE + lane
                weight = penalty[j] * share if lane < counted else 0.0
                loss += weight * zs[a] * zs[a]
                gz[a] = 2.0 * weight * zs[a]
    return loss


@jit()
def adam(value, gradient, m, v, rate, count):
    """Take one step of Adam with the usual constants 0.9, 0.999 and 1e-8; `count` is its number from 1."""
    root = math.sqrt(1.0 - 0.999**count)
    a = rate * root / (1.0 - 0.9**count)
    for j in range(len(value)):
        m[j] += 0.1 * (gradient[j] - m[j])
        v[j] += 0.001 * (gradient[j] * gradient[j] - v[j])
        value[j] -= a * m[j] / (math.sqrt(v[j]) + 1e-8 * root)


@jit()
def limit_norm(gp, gW, unit, clip):
    """Scale gp to the gradient by xi, and shorten the whole gradient to the norm `clip` if it is longer."""
    total = 0.0
    for j in range(len(gp)):
        gp[j] *= unit[j]
        total += gp[j] * gp[j]
    for j in range(len(gW)):
        total += gW[j] * gW[j]
    if total > clip * clip:
        for j in range(len(gp)):
            gp[j] *= clip / math.sqrt(total)
        for j in range(len(gW)):
            gW[j] *= clip / math.sqrt(total)


@jit()
def batch_gradient(evaluate, pull, at, w, room, gp, gW, starts, owner, Xd, driven, how, p, C_x, penalty):
    """Return the loss of a mini-batch; its gradients by parameters and weights go to gp and gW.

    `w` is a block with the weights, `room` its arrays, `starts` (windows,) the first measured samples.
    `driven` is U, C, T, and `how` is steps, substeps, period, hold, stages; for all arguments see `train`.
    """
    U, C, T = driven
    steps, substeps, period, hold, stages = how
    xs, gs, zs, gz, trace = room
    gp[:], gW[:] = 0.0, 0.0
    loss, B, first = 0.0, len(starts), np.empty(LANES, np.int64)
    for block in range(0, B, LANES):
        for lane in range(LANES):
            first[lane] = starts[min(block + lane, B - 1)]
            for j in range(at.states):
                xs[j * LANES + lane] = Xd[first[lane], j]
        loops.load_constants(w, at, C, first, owner)
        loops.forward(evaluate, at, w, xs, zs, trace, first, U, T, steps, substeps, period, hold, stages, p)
        left = min(LANES, B - block)
        share = 1.0 / (B * steps)
        loss += adjoint_of_loss(at, xs, gs, zs, gz, first, Xd, left, steps, share, C_x, penalty)
        loops.backward(pull, at, w, trace, gs, gz, first, U, T, steps, substeps, period, hold, stages, p)
        loops.collect(w, at, gp, gW)
    return loss


@jit()
def keep_within(xi, p, index, unit, low, high):
    """Cut the scaled parameters xi at their bounds, and write them to p in their units."""
    for j in range(len(xi)):
        xi[j] = min(max(xi[j], low[j] / unit[j]), high[j] / unit[j])
        p[index[j]] = unit[j] * xi[j]


@entry(
    Array(
        *(Block, Block, LayoutType, Rows.copy(dtype=types.int64), Array, Array, i, f, Indices, Rows),
        *COMMON,
        *(Indices, Array, Array, Array, Array, Array, Array, Rows, Rows),
    )
)
def train(
    evaluate,
    pull,
    at,
    starts,
    rates,
    physics_rates,
    count,
    clip,
    owner,
    Xd,
    U,
    C,
    T,
    steps,
    substeps,
    period,
    hold,
    stages,
    p,
    weights,
    scale,
    gain,
    index,
    unit,
    low,
    high,
    C_x,
    penalty,
    xi,
    moments_p,
    moments_W,
):
    """Take one step of Adam per mini-batch; return the losses (batches,), nan after one that is not finite.

    p, weights, xi and the moments of Adam change in place. Takes, beside arguments of `simulate`: starts
    (batches, windows), first samples; rates (batches,) of the weights and physics_rates of the scaled
    parameters xi (trained,), p[index] = unit * xi; count, number of mini-batches before; clip, largest norm
    of a gradient; Xd (samples, states), measured states; bounds low and high (trained,); C_x (states,),
    diagonal of C of eq. 4.9; penalty (networks,), price of the mean squared effort; first and second moments
    of the gradients (2, trained) and (2, weights).
    """
    driven, how = (U, C, T), (steps, substeps, period, hold, stages)
    w, room = loops.new_block(at, weights, scale, gain), loops.new_room(at, steps, substeps, stages)
    gp, gW = np.empty(at.trained), np.empty(at.size)
    losses = np.full(len(starts), np.nan)
    for b in range(len(starts)):
        loops.fill(w, at.weights, weights)
        losses[b] = batch_gradient(
            evaluate, pull, at, w, room, gp, gW, starts[b], owner, Xd, driven, how, p, C_x, penalty
        )
        if not math.isfinite(losses[b]):
            break
        limit_norm(gp, gW, unit, clip)
        adam(weights, gW, moments_W[0], moments_W[1], rates[b], count + b + 1)
        adam(xi, gp, moments_p[0], moments_p[1], physics_rates[b], count + b + 1)
        keep_within(xi, p, index, unit, low, high)
    return losses
