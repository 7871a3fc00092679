"""Small machines, faults of their logs, and faultless logs that look like them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from tests.machines.folders import Array, motion, text_of


@dataclass(frozen=True)
class Machine:
    system: str  # text of the system file
    rates: Callable[[Array, Array], Array]  # of the states, at states (states, runs) and inputs (runs,)
    states: int
    force: float  # size of the input
    period: float  # s
    #: Columns (runs, samples) of states (states, runs, samples) and a random generator.
    logged: Callable[[Array, np.random.Generator], dict[str, Array]]
    drive: str  # column of the input
    start: float = 0.0  # of the first state, at the beginning of the runs
    inputs: Callable[[Array], Array] = lambda u: u  # those that are used, of inputs (runs, samples)

    def frames(self, seed: int = 0, runs: int = 4, samples: int = 1200) -> dict[str, pd.DataFrame]:
        """Return faultless logs of runs with inputs of several sines."""
        rng, t = np.random.default_rng(seed), self.period * np.arange(samples)
        u = self.inputs(self.force * np.array([_sines(t, rng) for _ in range(runs)]))
        columns = {self.drive: u, **self.logged(self.states_at(u), rng)}
        return {
            f"run{k + 1}": pd.DataFrame({"t": t, **{name: values[k] for name, values in columns.items()}})
            for k in range(runs)
        }

    def states_at(self, u: Array) -> Array:
        """Return states (states, runs, samples) for inputs (runs, samples)."""
        x = np.zeros((self.states, len(u)))
        x[0] = self.start * np.linspace(0.5, 1.0, len(u))
        return np.moveaxis(motion(self.rates, x, u.T, self.period), 0, -1)


def _sines(t: Array, rng: np.random.Generator) -> Array:
    f, phase = np.exp(rng.uniform(np.log(0.2), np.log(2.0), 6)), rng.uniform(0.0, 2.0 * np.pi, 6)
    return np.asarray(np.sin(2.0 * np.pi * np.outer(f, t) + phase[:, None]).sum(axis=0) / 3.0)


def rounded(values: Array, step: float) -> Array:
    return step * np.round(values / step)


#: Ball screw with an encoder of 2 um a count.
SCREW = Machine(
    text_of("screw.yaml"),
    lambda x, u: np.array([x[1], (u - 40.0 * x[1]) / 12.0]),
    states=2,
    force=40.0,
    period=0.004,
    logged=lambda x, rng: {"s": rounded(x[0], 2e-6)},
    drive="force",
)
#: Pendulum with a noisy angle and a tachometer.
PENDULUM = Machine(
    text_of("swing.yaml"),
    lambda x, u: np.array([x[1], (u - 2.0 * np.sin(x[0]) - 0.05 * x[1]) / 0.05]),
    states=2,
    force=0.6,
    period=0.005,
    logged=lambda x, rng: {
        "phi": x[0] + 1e-3 * rng.standard_normal(x[0].shape),
        "tacho": x[1] + 0.02 * rng.standard_normal(x[1].shape),
    },
    drive="torque",
)
#: Heater with a thermocouple behind a converter of 0.05 K, and no position.
HEATER = Machine(
    text_of("heater.yaml"),
    lambda x, u: np.array([(u - 2.0 * x[0]) / 20.0]),
    states=1,
    force=200.0,
    period=0.02,
    logged=lambda x, rng: {"T": rounded(x[0] + 0.1 * rng.standard_normal(x[0].shape), 0.05)},
    drive="power",
)
MACHINES = {"screw": SCREW, "swing": PENDULUM, "heater": HEATER}
Frames = dict[str, pd.DataFrame]


def _each(frames: Frames, column: str, change: Callable[[Array, int], Array]) -> Frames:
    return {
        name: frame.assign(**{column: change(frame[column].to_numpy().copy(), k)})
        for k, (name, frame) in enumerate(frames.items())
    }


def spiked(frames: Frames, column: str, size: float, seed: int = 1, share: float = 0.01) -> Frames:
    """Add garbage in a share of the samples, every other time two samples long."""

    def spoil(values: Array, run: int) -> Array:
        rng = np.random.default_rng([seed, run])
        at = 20 + np.flatnonzero(rng.random(len(values) - 40) < share)
        values[at] += rng.uniform(0.8, 3.0, len(at)) * size * rng.choice([-1.0, 1.0], len(at))
        values[at[::2] + 1] = values[at[::2]]
        return values

    return _each(frames, column, spoil)


def dropped(frames: Frames, column: str, share: float = 0.05, seed: int = 2) -> Frames:
    def spoil(values: Array, run: int) -> Array:
        values[np.random.default_rng([seed, run]).random(len(values)) < share] = 0.0
        return values

    return _each(frames, column, spoil)


def wrapped(frames: Frames, column: str, count: float, bits: int) -> Frames:
    """Let the counter of a channel overflow, from its largest to its smallest number."""
    half = 2 ** (bits - 1)
    over = lambda v, _: count * (np.remainder(np.round(v / count) + half, 2 * half) - half)  # noqa: E731
    return _each(frames, column, over)


def emptied(frames: Frames, column: str, count: float, bits: int) -> Frames:
    """Let the counter of a channel fall to zero where it overflows."""
    top = 2 ** (bits - 1) - 1
    over = lambda v, _: count * np.sign(v) * np.remainder(np.abs(np.round(v / count)), top)  # noqa: E731
    return _each(frames, column, over)


def frozen(frames: Frames, column: str, samples: int, start: int = 400) -> Frames:
    def spoil(values: Array, run: int) -> Array:
        first = start + 60 * run
        values[first : first + samples] = values[first]
        return values

    return _each(frames, column, spoil)


def registered(frames: Frames, column: str, count: float, bits: int, sign_bit: bool = False) -> Frames:
    """Let a channel be read as unsigned: two's complement, or a register with a bit for the sign."""

    def spoil(values: Array, run: int) -> Array:
        counts = np.round(values / count)
        bit = 2.0 ** (bits - 1) if sign_bit else 2.0**bits
        return np.asarray(
            count * np.where(counts < 0.0, bit + (np.abs(counts) if sign_bit else counts), counts)
        )

    return _each(frames, column, spoil)


def ended(frames: Frames, column: str, share: float, noise: float, digits: int = 9) -> Frames:
    """Let a noisy sensor end where a share of all samples lies beyond, in its text of so many digits."""
    rng = np.random.default_rng(3)
    noisy = {name: frame[column] + noise * rng.standard_normal(len(frame)) for name, frame in frames.items()}
    end = round(float(np.quantile(np.abs(np.concatenate([*noisy.values()])), 1.0 - share)), digits)
    return {
        name: frame.assign(**{column: np.clip(np.round(noisy[name], digits), -end, end)})
        for name, frame in frames.items()
    }


def coarse(frames: Frames, column: str, step: float) -> Frames:
    return _each(frames, column, lambda values, _: rounded(values, step))


def _screw(
    force: Callable[[Array, np.random.Generator], Array],
    rates: Callable[[Array, Array], Array] = SCREW.rates,
    count: float = 2e-6,
) -> Frames:
    rng, t = np.random.default_rng(5), SCREW.period * np.arange(1600)
    u = np.array([force(t, rng) for _ in range(4)])
    s = rounded(replace(SCREW, rates=rates).states_at(u)[0], count)
    return {f"run{k + 1}": pd.DataFrame({"t": t, "force": u[k], "s": s[k]}) for k in range(4)}


def _slow(t: Array, rng: np.random.Generator) -> Array:
    return np.asarray(40.0 * np.sin(2.0 * np.pi * rng.uniform(0.4, 0.8) * t))


def _quick(t: Array, rng: np.random.Generator) -> Array:
    beat = 1.0 + 0.8 * np.sin(2.0 * np.pi * 0.1 * t)
    return np.asarray(40.0 * beat * np.sin(2.0 * np.pi * rng.uniform(1.0, 1.4) * t))


def _levels(t: Array, rng: np.random.Generator) -> Array:
    """Return a smooth command that rests at a level of its own now and then, as of a plant at night."""
    night = np.remainder(t + 3.0 * rng.random(), 2.0) < 0.5
    return np.where(night, rng.uniform(5.0, 20.0), 20.0 * np.sin(2.0 * np.pi * rng.uniform(0.4, 0.8) * t))


def _stop(x: Array, u: Array) -> Array:
    """Rates of the screw between stiff ends at 8 mm, from which it bounces."""
    deep = np.maximum(np.abs(x[0]) - 0.008, 0.0)
    return np.array([x[1], (u - 40.0 * x[1] - 1e6 * np.sign(x[0]) * deep) / 12.0])


def _walled(frames: Frames) -> Frames:
    """Replace the motion by that between walls at 8 mm, which stop the screw: it leaves them from rest."""
    force = np.array([frame["force"] for frame in frames.values()])
    path, x, v, h = np.zeros_like(force), np.zeros(len(force)), np.zeros(len(force)), SCREW.period / 20.0
    for k in range(1, force.shape[1]):
        for _ in range(20):
            v = v + h * (force[:, k] - 40.0 * v) / 12.0
            v, x = np.where(np.abs(x + h * v) >= 0.008, 0.0, v), np.clip(x + h * v, -0.008, 0.008)
        path[:, k] = x
    return {name: frame.assign(s=s) for s, (name, frame) in zip(path, frames.items(), strict=True)}


def _sticking(x: Array, u: Array) -> Array:
    """Rates of the screw with a dry friction in which it sticks."""
    still = (np.abs(x[1]) < 1e-4) & (np.abs(u) < 25.0)
    free = (u - 40.0 * x[1] - 25.0 * np.sign(x[1] + 1e-12 * u)) / 12.0
    return np.array([np.where(still, 0.0, x[1]), np.where(still, -x[1] / SCREW.period, free)])


#: Makers of faultless logs that could be taken for faulty ones.
TWINS: dict[str, Callable[[], Frames]] = {
    "faultless": SCREW.frames,
    "encoder of low resolution": lambda: _screw(_slow, count=5e-4),
    "rest, then motion": lambda: _screw(lambda t, rng: np.where(t < 2.0, 0.0, _slow(t, rng))),
    "rest": lambda: {**_screw(_slow), "still": _screw(lambda t, rng: 1e-3 * _slow(t, rng))["run1"]},
    "saturated command": lambda: _screw(lambda t, rng: np.clip(2.0 * _slow(t, rng), -40.0, 40.0)),
    "square wave": lambda: _screw(lambda t, rng: 40.0 * np.sign(_slow(t, rng))),
    "steps": lambda: _screw(lambda t, rng: rng.uniform(-40.0, 40.0, 60)[(t / 0.12).astype(np.int64)]),
    "levels of a smooth command": lambda: _screw(_levels),
    "counts without a sign": lambda: {
        name: f.assign(force=np.round(600.0 + 10.0 * f["force"])) for name, f in _screw(_slow).items()
    },
    "modulated width": lambda: _screw(
        lambda t, rng: 40.0 * (rng.random(len(t)) < 0.5 + 0.01 * _slow(t, rng))
    ),
    "blows of a hammer": lambda: _screw(lambda t, rng: 900.0 * (rng.random(len(t)) < 0.01)),
    "ramp, held": lambda: _screw(lambda t, rng: 20.0 * np.clip(t - 1.0, 0.0, 1.0) * (t < 3.0)),
    "end stops": lambda: _screw(_slow, _stop),
    "end stops without counts": lambda: _screw(_slow, _stop, 1e-15),
    "walls": lambda: _walled(_screw(_slow)),
    "walls of counts": lambda: coarse(_walled(_screw(_slow)), "s", 2e-6),
    "walls of large counts": lambda: coarse(_walled(_screw(_slow)), "s", 2e-4),
    "dry friction": lambda: _screw(_slow, _sticking),
    "few samples a period": lambda: {name: frame[::27] for name, frame in _screw(_quick).items()},
    "coarse dry friction": lambda: _screw(_slow, _sticking, 2e-4),
}
