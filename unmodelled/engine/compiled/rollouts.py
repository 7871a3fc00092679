"""Trajectories of windows, and their gradients: what a kernel computes for a stack of windows."""

# mypy: ignore-errors

import numpy as np
from numba import types

from unmodelled.engine.compiled import loops
from unmodelled.engine.compiled.layout import LANES, Array, Block, LayoutType, entry
from unmodelled.engine.compiled.loops import COMMON, Cubes, Indices


@entry(types.Tuple((Cubes, Cubes))(Block, LayoutType, Cubes, Indices, Indices, *COMMON))
def simulate(
    evaluate, at, x0, start, owner, U, C, T, steps, substeps, period, hold, stages, p, weights, scale, gain
):
    """Return trajectories (windows, steps + 1, states), and efforts (windows, steps, networks), SI.

    Takes initial states x0 (windows, 1, states); start (windows,), first samples; owner (samples,),
    experiment of every sample; inputs U (samples, inputs), constants C (experiments, constants) and times T
    (samples,); numbers of steps and of substeps in each; period in s; hold, 1 for inputs that run straight to
    the next sample and 0 for inputs that are held; stages (see the module); p (parameters,); of the networks
    weights, factors `scale` on inputs and `gain` on outputs, flat.
    """
    B = len(start)
    X, Z = np.empty((B, steps + 1, at.states)), np.empty((B, steps, at.networks))
    w = loops.new_block(at, weights, scale, gain)
    xs, zs = np.empty((steps + 1) * at.states * LANES), np.empty(steps * at.networks * LANES)
    trace, first = np.empty(0), np.empty(LANES, np.int64)
    for block in range(0, B, LANES):
        for lane in range(LANES):
            first[lane] = start[min(block + lane, B - 1)]
        loops.gather(xs, x0, block, 1)
        loops.load_constants(w, at, C, first, owner)
        loops.forward(evaluate, at, w, xs, zs, trace, first, U, T, steps, substeps, period, hold, stages, p)
        loops.scatter(X, xs, block, steps + 1)
        loops.scatter(Z, zs, block, steps)
    return X, Z


@entry(
    types.Tuple((Cubes, Array, Array))(
        Block, Block, LayoutType, Cubes, Cubes, Cubes, Indices, Indices, *COMMON
    )
)
def pullback(
    evaluate,
    pull,
    at,
    x0,
    GX,
    GZ,
    start,
    owner,
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
):
    """Return gradients by initial states (windows, 1, states), trained parameters and weights.

    Takes, beside the arguments of `simulate`, gradients GX (windows, steps + 1, states) by the trajectories
    and GZ (windows, steps, networks) by the efforts.
    """
    B = len(start)
    gx0, gp, gW = np.empty((B, 1, at.states)), np.zeros(at.trained), np.zeros(at.size)
    w = loops.new_block(at, weights, scale, gain)
    xs, gs, zs, gz, trace = loops.new_room(at, steps, substeps, stages)
    first = np.empty(LANES, np.int64)
    for block in range(0, B, LANES):
        for lane in range(LANES):
            first[lane] = start[min(block + lane, B - 1)]
        loops.gather(xs, x0, block, 1)
        loops.gather(gs, GX, block, steps + 1)
        loops.gather(gz, GZ, block, steps)
        for lane in range(B - block, LANES):
            for a in range(lane, len(gs), LANES):
                gs[a] = 0.0
            for a in range(lane, len(gz), LANES):
                gz[a] = 0.0
        loops.load_constants(w, at, C, first, owner)
        # once more: the stages of all windows at once would take much memory
        loops.forward(evaluate, at, w, xs, zs, trace, first, U, T, steps, substeps, period, hold, stages, p)
        loops.backward(pull, at, w, trace, gs, gz, first, U, T, steps, substeps, period, hold, stages, p)
        loops.collect(w, at, gp, gW)
        loops.scatter(gx0, gs, block, 1)
    return gx0, gp, gW
