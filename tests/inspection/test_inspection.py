"""Faults of logs are found and cured without a model, or are the answer before any search; twins are not."""

import re
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import unmodelled as um
from tests.inspection.machines import (
    MACHINES,
    PENDULUM,
    SCREW,
    TWINS,
    Frames,
    Machine,
    coarse,
    dropped,
    emptied,
    ended,
    frozen,
    registered,
    spiked,
    wrapped,
)
from tests.machines.folders import Array, changed, system_of
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.faults.fits import owners
from unmodelled.diagnosis.faults.look import without_copies
from unmodelled.diagnosis.faults.suspects import LIMITS, slowed
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.logs.inspection.inspect import inspect
from unmodelled.logs.inspection.signal import Run, Signal, signals_of
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Words of a note on a fault.
FOUND = re.compile("spikes|falls to 0|overflows|freezes|would change its sign|stands at its")


@pytest.fixture(scope="module")
def systems(tmp_path_factory: pytest.TempPathFactory) -> dict[str, System]:
    folder = tmp_path_factory.mktemp("systems")
    return {name: system_of(machine.system, folder) for name, machine in MACHINES.items()}


def looked(system: System, frames: Frames) -> tuple[Logs, list[str]]:
    logs = Logs.from_frames(frames, system)
    return logs, [note for note in logs.notes if FOUND.search(note)]


#: Machine, fault, words of the one note, error that may remain in nearly all samples.
CASES = {
    "garbage of an encoder": ("screw", (spiked, "s", 3.0), "s has .* spikes", 1e-4),
    "small spikes of an angle": ("swing", (spiked, "phi", 0.5), "phi has .* spikes", 0.01),
    "small spikes of a speed": ("swing", (spiked, "tacho", 1.5), "tacho has .* spikes", 0.1),
    "garbage of a thermocouple": ("heater", (spiked, "T", 4e3), "T has .* spikes", 0.6),
    "dropouts of an angle": ("swing", (dropped, "phi"), "phi falls to 0 in", 0.1),
    "dropouts of a command": ("heater", (dropped, "power", 0.01), "power falls to 0 in", 50.0),
    "counter of 16 bits": ("screw", (wrapped, "s", 2e-6, 16), "s jumps by 65536 counts", 1e-9),
    "counter that empties": ("screw", (emptied, "s", 2e-6, 16), "s jumps by 32767 counts", 1e-9),
    "current of 16 bits, read as unsigned": (
        *("screw", (registered, "force", 0.00269, 16)),
        *(r"force jumps by 65536 counts \(176.3 N\) .* a signed number of 16 bits", 0.0027),
    ),
    "byte, read as unsigned": (
        "swing",
        (registered, "torque", 0.01, 8),
        ".* a signed number of 8 bits",
        0.01,
    ),
    "32 bits, read as unsigned": (
        "heater",
        (registered, "T", 0.05, 32),
        ".* a signed number of 32 bits",
        1e-5,
    ),
    "sign bit of an input": (
        *("heater", (registered, "power", 0.3, 12, True)),
        *("power jumps by 2048 counts .* a register whose bit 11 is the sign", 0.3),
    ),
    "sign bit of an output": ("swing", (registered, "tacho", 0.01, 11, True), ".* bit 10 is the sign", 0.01),
    "frozen encoder": ("screw", (frozen, "s", 60), "s freezes 4 times", 0.0),
    "frozen angle": ("swing", (frozen, "phi", 40), "phi freezes [34] times", 0.0),
    "frozen tachometer": ("swing", (frozen, "tacho", 40), "tacho freezes 4 times", 0.0),
    "frozen command": ("heater", (frozen, "power", 50), "power freezes [34] times", 0.0),
}


@pytest.mark.parametrize("case", CASES)
def test_a_fault_is_found_and_cured(case: str, systems: dict[str, System]) -> None:
    name, (spoil, *how), words, error = CASES[case]
    frames = MACHINES[name].frames()
    logs, found = looked(systems[name], spoil(frames, *how))
    assert len(found) == 1 and re.match(words, found[0]), logs.notes
    assert re.search(r"\(the first one at t = [\d.]+ s of run1\)", found[0])
    if "freezes" in found[0]:
        count = re.search(r"freezes (\d) times", found[0])
        assert count and len(logs) == len(frames) + int(count[1])  # cut there
        return
    right, _ = looked(systems[name], frames)
    off = np.concatenate([logs.y - right.y, logs.u - right.u], axis=1)
    assert np.mean(np.abs(off - off[0]) > error) < 0.003


#: Machine, fault, how it is spoiled, and runs that have it while the others are logged with their sign.
SOME_RUNS = {
    "input of 16 bits": ("screw", (registered, "force", 0.01, 16), (0, 2), "force", 0.005),
    "output of 16 bits": ("swing", (registered, "tacho", 0.01, 16), (1,), "tacho", 0.005),
    "sign bit": ("screw", (registered, "force", 0.1, 12, True), (1,), "force", 0.05),
    "32 bits": ("heater", (registered, "T", 0.05, 32), (0, 3), "T", 1e-6),
    "counter": ("screw", (wrapped, "s", 2e-6, 16), (0,), "s", 1e-9),
}


@pytest.mark.parametrize("case", SOME_RUNS)
def test_a_fault_of_some_runs_is_cured_alike_in_all(case: str, systems: dict[str, System]) -> None:
    name, (spoil, *how), which, channel, error = SOME_RUNS[case]
    frames = MACHINES[name].frames()
    spoiled = spoil(frames, *how)
    mixed = {run: (spoiled if k in which else frames)[run] for k, run in enumerate(frames)}
    (logs, found), (right, _) = looked(systems[name], mixed), looked(systems[name], frames)
    assert len(found) == 1 and found[0].startswith(f"{channel} jumps by"), found
    assert f" in {' and '.join(f'run{k + 1}' for k in which)} (" in found[0]
    assert np.abs(np.concatenate([logs.y - right.y, logs.u - right.u], axis=1)).max() <= error * (1.0 + 1e-9)


#: Machine, fault of a channel, and its shares of the samples in four runs.
TOO_MANY = {
    "zeros in all runs": ("swing", "tacho", dropped, (0.3, 0.3, 0.3, 0.3)),
    "zeros in one run": ("swing", "phi", dropped, (0.03, 0.15, 0.0, 0.03)),
    "garbage in one run": ("screw", "s", spiked, (0.01, 0.2, 0.01, 0.0)),
}


@pytest.mark.parametrize("case", TOO_MANY)
def test_spikes_that_are_too_many_in_one_run_stay_in_all(case: str, systems: dict[str, System]) -> None:
    name, channel, spoil, shares = TOO_MANY[case]
    frames = MACHINES[name].frames()
    spoiled = dict(frames)
    for run, share in zip(frames, shares, strict=True):
        if share:
            how = (channel, share) if spoil is dropped else (channel, 3.0, 1, share)
            spoiled[run] = spoil({run: frames[run]}, *how)[run]
    logs, (note,) = looked(systems[name], spoiled)
    assert note.endswith("nothing was changed; leave that run out, or repair the sensor")
    logged = np.concatenate([frame[channel] for frame in spoiled.values()])
    assert np.array_equal(logs.y[:, logs.outputs.index(channel)], logged)


def test_no_counter_is_unwrapped_whose_start_nobody_knows(systems: dict[str, System]) -> None:
    """A register of few levels is none; where a run begins in its range is unknown."""
    frames = coarse(SCREW.frames(), "force", 10.0)
    mixed = frames | {"run2": registered(frames, "force", 10.0, 16)["run2"]}
    assert looked(systems["screw"], mixed)[1] == []


@pytest.mark.parametrize("start", [300, "lowest"])
def test_a_channel_that_freezes_to_the_end_is_told(start: int | str, systems: dict[str, System]) -> None:
    """Also for most of a run, and at the smallest value of it, which it reaches only once."""
    frames = MACHINES["swing"].frames()
    values = frames["run2"]["tacho"].to_numpy().copy()
    first = start if isinstance(start, int) else int(np.argmin(values[:900]))
    values[first:] = values[first]
    assert start == 300 or values[first] == values.min()
    _, (note,) = looked(systems["swing"], frames | {"run2": frames["run2"].assign(tacho=values)})
    assert note.startswith("tacho freezes once, for up to") and "of run2)" in note


@pytest.mark.parametrize("name", MACHINES)
def test_faultless_logs_raise_no_alarm(name: str, systems: dict[str, System]) -> None:
    for seed in range(5):
        assert looked(systems[name], MACHINES[name].frames(seed))[1] == []


@pytest.mark.parametrize("twin", TWINS)
def test_what_looks_like_a_fault_is_none(twin: str, systems: dict[str, System]) -> None:
    assert looked(systems["screw"], TWINS[twin]())[1] == []


#: Machine, text of its system file, channel that ends, share of its samples beyond, noise, digits.
ENDS = {
    "tachometer": ("swing", ("", ""), "tacho", 0.08, 0.02, 9),
    "rounded tachometer": ("swing", ("", ""), "tacho", 0.03, 0.02, 2),
    "measured force": ("screw", ("{unit: N}}", "{unit: N, commanded: false}}"), "force", 0.05, 0.2, 4),
}


@pytest.mark.parametrize("case", ENDS)
def test_samples_at_the_end_of_a_range_are_left_out(case: str, tmp_path: Path) -> None:
    name, change, channel, share, noise, digits = ENDS[case]
    machine = MACHINES[name]
    system = system_of(changed(machine.system, change), tmp_path)
    frames = ended(machine.frames(), channel, share, noise, digits)
    logs, notes = looked(system, frames)
    assert len(notes) == 1 and notes[0].startswith(f"{channel} stands at its smallest or largest value"), (
        notes
    )
    told = re.search(r"in ([\d.]+) % of the samples, \d+ of them .*: these are left out", notes[0])
    assert told and float(told[1]) == pytest.approx(100 * share, rel=0.1)
    end = max(float(frame[channel].max()) for frame in frames.values())
    if channel in logs.inputs:  # nobody knows what it was there
        assert np.mean(np.abs(logs.u[:, 0]) >= end) < 0.1 * share and len(logs) > len(frames)
        return
    assert logs.left_out is not None and len(logs) == len(frames)
    assert logs.left_out[:, 1].mean() == pytest.approx(share, rel=0.1) and not logs.left_out[:, 0].any()
    logs.write(tmp_path / "store")
    assert um.read_logs(tmp_path / "store", system).limits == logs.limits
    horizon = default_horizon(logs)
    recording = Recording.of(logs, horizon)
    assert not logs.left_out[recording.start].any() and recording.steps.max() == round(horizon / logs.period)
    assert recording.compared.sum() == pytest.approx((2.0 - share) * recording.steps.sum(), rel=0.005)
    # other sensors show as much as without this end
    simulation = Simulation(system, recording)
    errors = simulation(simulation.values[None, None]).errors(recording.scale)
    beyond = np.abs(logs.y[recording.rows, 1]) >= end
    assert not errors[beyond, 1].any() and errors[beyond, 0].any()


#: Machine, changes of its system file, channel, share of its samples beyond the end, step of its converter.
COARSE_ENDS = {
    "tachometer": ("swing", ("", ""), "tacho", 0.08, 0.1),
    "measured force": ("screw", ("{unit: N}}", "{unit: N, commanded: false}}"), "force", 0.05, 0.5),
}


@pytest.mark.parametrize(("step", "share"), [(1e-15, 0.08), (2e-6, 0.08), (2e-3, 0.08), (2e-6, 0.5)])
def test_a_position_that_comes_back_at_its_pace_was_beyond_its_end(
    step: float, share: float, systems: dict[str, System]
) -> None:
    """Without any noise: a machine that leaves a stop starts slowly."""
    quiet = replace(PENDULUM, logged=lambda x, rng: {"phi": x[0], "tacho": x[1]})
    frames = coarse(quiet.frames(), "phi", step)
    assert looked(systems["swing"], frames)[1] == []
    logs, (note,) = looked(systems["swing"], ended(frames, "phi", share, 0.0, 15))
    end = float(re.search(r"smallest or largest value \(-([\d.]+) rad", note)[1])  # type: ignore[index]
    if share < 0.5:
        assert "these are left out" in note
        assert len(logs) > len(frames) and np.abs(logs.y[:, 0]).max() < end + 1e-4
    else:
        assert "too little remains without these" in note and len(logs) == len(frames)


@pytest.mark.parametrize("case", COARSE_ENDS)
def test_an_end_is_told_where_steps_hide_the_noise(case: str, tmp_path: Path) -> None:
    """Nobody knows whether the sensor or the machine ends there, so that nothing is left out."""
    name, change, channel, share, step = COARSE_ENDS[case]
    system = system_of(changed(MACHINES[name].system, change), tmp_path)
    frames = coarse(ended(MACHINES[name].frames(), channel, share, 0.0), channel, step)
    logs, (note,) = looked(system, frames)
    assert note.startswith(f"{channel} stands at its smallest or largest value")
    assert note.endswith("if the sensor ends there, leave these times out or measure with a larger range")
    assert logs.limits == {} and len(logs) == len(frames)


#: Ramps of speed by steps of a torque, which end at its steps.
RAMPS = replace(
    PENDULUM,
    inputs=lambda u: np.tile(0.05 * np.repeat([0.0, 1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0], 150), (len(u), 1)),
    rates=lambda x, u: np.array([x[1], u / 0.005]),
    logged=lambda x, rng: {"phi": x[0] + 1e-3 * rng.standard_normal(x[0].shape), "tacho": x[1]},
)
#: A speed that settles after steps of the torque.
SETTLES = replace(
    RAMPS,
    inputs=lambda u: np.repeat(np.random.default_rng(1).choice([-0.5, 0.0, 0.5], (len(u), 8)), 150, axis=1),
    rates=lambda x, u: np.array([x[1], (u - 0.05 * x[1]) / 0.005]),
)


@pytest.mark.parametrize("step", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("machine", [PENDULUM, RAMPS, SETTLES], ids=["sines", "ramps", "settles"])
def test_a_coarse_speed_without_an_end_is_not_told(
    machine: Machine, step: float, systems: dict[str, System]
) -> None:
    assert looked(systems["swing"], coarse(machine.frames(), "tacho", step))[1] == []


@pytest.mark.parametrize("name", ["swing", "screw"])
def test_a_command_that_saturates_and_a_stop_are_no_ends(name: str, systems: dict[str, System]) -> None:
    frames = MACHINES[name].frames()
    command = MACHINES[name].drive
    assert looked(systems[name], ended(frames, command, 0.08, 0.01 * MACHINES[name].force))[1] == []
    if name == "screw":  # an encoder has no noise, and an axis may stand at its end
        assert looked(systems[name], ended(frames, "s", 0.08, 0.0))[1] == []


def test_runs_are_cut_at_short_peaks_beyond_the_range_of_an_input(tmp_path: Path) -> None:
    """Nobody knows a peak of four samples: nothing is read straight across it."""
    measured = changed(SCREW.system, ("{unit: N}}", "{unit: N, commanded: false}}"))
    rng, frames, true = np.random.default_rng(8), SCREW.frames(), []
    for name, frame in frames.items():
        force = frame["force"].to_numpy() + 0.2 * rng.standard_normal(len(frame))
        for start in range(150, 1100, 150):
            force[start : start + 4] += 120.0
        true.append(force)
        frames[name] = frame.assign(force=np.minimum(force, 60.0))
    logs, (note,) = looked(system_of(measured, tmp_path), frames)
    assert note.startswith("force stands at its largest value (60 N)")
    assert len(logs) == len(frames) * 8 and logs.u.max() < 59.0


def test_an_input_that_no_equation_uses_is_not_looked_at(tmp_path: Path) -> None:
    text = changed(SCREW.system, ("inputs: {force", "inputs: {spare: {unit: V}, force"))
    frames = {name: f.assign(spare=np.sin(f["t"])) for name, f in frozen(SCREW.frames(), "force", 60).items()}
    spoiled = spiked(frozen(frames, "spare", 60), "spare", 1e4)
    notes = looked(system_of(text, tmp_path), spoiled)[1]
    assert notes and not any("spare" in note for note in notes)


def test_a_mapping_turns_cures_off(tmp_path: Path) -> None:
    system = system_of(SCREW.system, tmp_path)
    frames = wrapped(registered(SCREW.frames(), "force", 0.01, 16), "s", 2e-6, 16)
    (tmp_path / "logs").mkdir()
    for name, frame in frames.items():
        frame.to_csv(tmp_path / f"logs/{name}.csv", index=False)
    text = 'schema: mapping/1\nfiles: ["*.csv"]\ntime: t\nsignals: {s: s, force: force}\n'
    off = {}
    for cure in ("true", "false"):
        (tmp_path / "logs/mapping.yaml").write_text(f"{text}cure: {cure}\n")
        logs = um.read_logs(tmp_path / "logs", system)
        told = [note for note in logs.notes if FOUND.search(note)]
        assert len(told) == 2
        assert all(note.endswith("says cure: false") == (cure == "false") for note in told)
        logged = np.concatenate([frame["force"] for frame in frames.values()])
        off[cure] = float(np.abs(logs.u[:, 0] - logged).max())
    assert off["false"] == 0.0 < off["true"]
    (fault,) = without_copies(system, logs, 0.1)[2]  # of the logs that were left as they are
    assert (fault.problem, fault.decides) == ("register", True)
    assert fault.sentence.startswith("force jumps by 65536 counts where it would change its sign")


def test_channels_of_other_units_have_the_same_faults(systems: dict[str, System]) -> None:
    """Findings do not depend on scale: a screw in nanometres."""
    small = {name: f.assign(s=1e-9 * f["s"]) for name, f in spiked(SCREW.frames(), "s", 3.0).items()}
    whole = looked(systems["screw"], spiked(SCREW.frames(), "s", 3.0))[1]
    assert looked(systems["screw"], small)[1] == whole != []


def test_looks_take_less_than_a_second(systems: dict[str, System]) -> None:
    frames, signals = PENDULUM.frames(samples=1200), signals_of(systems["swing"])
    values = {name: np.tile(frames["run1"][name], 50) for name in ("phi", "tacho", "torque")}
    start = time.perf_counter()
    inspect([Run("long", 0.005 * np.arange(60_000), values, signals, dict.fromkeys(values, 1.0))])
    assert time.perf_counter() - start < 1.0


def test_a_servo_that_is_logged_rarely_may_be_quick_where_its_goal_jumps() -> None:
    """Out and back within three samples of 20 ms: a spike away from the goal's jumps, and motion at them."""
    t = 0.02 * np.arange(400)
    s = 0.1 * np.sin(0.8 * t)
    s[200:202] -= 0.03
    for jumps, spikes in ((198, 0), (300, 1)):
        goal = 0.1 * np.sin(0.8 * t)
        goal[jumps : jumps + 2] -= 0.06
        values = {"s": s, "goal": goal}
        signals = (Signal("s", "s", "m", "position"), Signal("goal", "goal", "m", "input"))
        found = inspect([Run("run1", t, values, signals, dict.fromkeys(values, 0.2))])[1]
        assert len([each for each in found if each.channel == "s"]) == spikes


#: Machines with a dry friction that their system files leave out.
SWING = replace(
    PENDULUM,
    rates=lambda x, u: np.array(
        [x[1], (u - 2.0 * np.sin(x[0]) - 0.05 * x[1] - 0.06 * np.tanh(100.0 * x[1])) / 0.05]
    ),
)
SLIDE = replace(
    SCREW, rates=lambda x, u: np.array([x[1], (u - 40.0 * x[1] - 4.0 * np.tanh(200.0 * x[1])) / 12.0])
)
#: Samples for which a command is held.
HELD = 20


def scaled(columns: str, factor: float) -> Callable[[Frames], Frames]:
    return lambda frames: {
        name: f.assign(**{column: factor * f[column] for column in columns.split()})
        for name, f in frames.items()
    }


def swapped(column: str) -> Callable[[Frames], Frames]:
    def spoil(frames: Frames) -> Frames:
        names = list(frames)
        own = dict(zip(names, [*names[1:], names[0]], strict=True))
        return {name: f.assign(**{column: frames[own[name]][column]}) for name, f in frames.items()}

    return spoil


def held(column: str, samples: int) -> Callable[[Frames], Frames]:
    """Log a channel only every so many samples."""
    return lambda frames: {
        name: f.assign(**{column: f[column].to_numpy()[np.arange(len(f)) // samples * samples]})
        for name, f in frames.items()
    }


def as_measurement(output: str, command: str) -> Callable[[Frames], Frames]:
    return lambda frames: {name: f.assign(**{output: 0.01 * f[command] - 2.0}) for name, f in frames.items()}


@pytest.mark.parametrize(
    ("fits", "owner"),
    [
        ({(0, 1): 0.01, (1, 0): 0.02}, [1, 0, 2, 3]),
        ({(0, 1): 0.01, (1, 3): 0.02, (3, 0): 0.01}, [1, 3, 2, 0]),
        ({(0, 3): 0.01, (1, 3): 0.02}, [0, 1, 2, 3]),  # of a drive that follows late: no file belongs to two
        ({(0, 1): 0.01, (1, 2): 0.02}, [0, 1, 2, 3]),
    ],
    ids=["two", "three", "one for two", "no circle"],
)
def test_files_are_exchanged_in_circles(fits: dict[tuple[int, int], float], owner: list[int]) -> None:
    share = np.full((4, 4), 3.0)
    np.fill_diagonal(share, 1.0)
    for pair, left in fits.items():
        share[pair] = left
    assert owners(share, 0.1).tolist() == owner


def test_inputs_of_a_slow_drive_change_no_faster_than_their_limits(systems: dict[str, System]) -> None:
    logs = Logs.from_frames(MACHINES["swing"].frames(2, runs=3), systems["swing"])
    slow = slowed(logs)
    first, change = logs.offsets[:-1], np.diff(logs.u, axis=0)
    within = np.setdiff1d(np.arange(1, len(logs.u)), first) - 1
    most = LIMITS * np.abs(change[within]).max()
    assert np.array_equal(slow[:, first], np.repeat(logs.u[None, first], len(LIMITS), axis=0))
    assert np.abs(np.diff(slow, axis=1)[:, within, 0]).max(axis=1) == pytest.approx(most)
    left = np.abs(slow - logs.u).mean(axis=(1, 2))
    assert np.all(np.diff(left) < 0.0) and left[-1] > 0.0  # the larger the limit, the closer


#: Machine, damage, fault with its channels and whether it decides.
DAMAGED = {
    "electrical speed": (SWING, scaled("tacho", 4.0), "slope", ("tacho",), True),
    "time in millions of seconds": (SLIDE, scaled("t", 1e-6), "megaseconds", ("t",), True),
    "angles in nanoradians": (SWING, scaled("phi tacho", 1e9), "nano", None, True),
    "inputs of other runs": (SWING, swapped("torque"), "other_run", ("torque",), True),
    "command logged rarely": (SWING, held("torque", HELD), "slow", ("torque",), True),
    "no command": (SWING, scaled("torque", 0.0), "constant", ("torque",), True),
    "command as measurement": (SLIDE, as_measurement("s", "force"), "command", ("s",), True),
    "command as one of two": (SWING, as_measurement("tacho", "torque"), "command", ("tacho",), False),
}


def found(machine: Machine, frames: Frames, folder: Path) -> tuple[System, Logs, tuple[LogFault, ...]]:
    system = system_of(machine.system, folder)
    logs = Logs.from_frames(frames, system)
    return without_copies(system, logs, default_horizon(logs))


@pytest.mark.long
@pytest.mark.parametrize("case", DAMAGED)
def test_a_damage_is_the_answer(case: str, tmp_path: Path) -> None:
    machine, spoil, problem, channels, decides = DAMAGED[case]
    system, logs, (fault,) = found(machine, spoil(machine.frames(3, runs=6)), tmp_path)
    assert (fault.problem, fault.decides) == (problem, decides), fault.sentence
    assert channels is None or fault.channels == channels
    if not decides:
        assert logs.outputs == ("phi",) == tuple(output.name for output in system.outputs)


def _stairs(u: Array) -> Array:
    return u[:, np.arange(u.shape[1]) // HELD * HELD]


FAULTLESS = {
    "swing": lambda: (SWING, SWING.frames(3, runs=6)),
    "slide": lambda: (SLIDE, SLIDE.frames(3, runs=6)),
    "command that is really held": lambda: (SWING, replace(SWING, inputs=_stairs).frames(3, runs=6)),
    "free motion": lambda: (SWING, replace(SWING, inputs=np.zeros_like, start=1.0).frames(3, runs=6)),
    "sensor with a gain of 1.3": lambda: (SWING, scaled("tacho", 1.3)(SWING.frames(3, runs=6))),
}


@pytest.mark.long
@pytest.mark.parametrize("twin", FAULTLESS)
def test_a_faultless_twin_is_diagnosed(twin: str, tmp_path: Path) -> None:
    _, _, told = found(*FAULTLESS[twin](), tmp_path)
    assert not any(fault.decides for fault in told), told


@pytest.mark.long
@pytest.mark.parametrize("garbage", [0.0, 2.0])
def test_garbage_does_not_change_the_effect(garbage: float, tmp_path: Path) -> None:
    """The dry friction of the pendulum is named with and without spikes in its angle."""
    system = system_of(SWING.system, tmp_path)
    frames = SWING.frames(4, runs=6, samples=800)
    logs = Logs.from_frames(spiked(frames, "phi", garbage) if garbage else frames, system)
    assert any("spikes" in note for note in logs.notes) == bool(garbage)
    answer = um.diagnose(system, logs, workers=1)
    assert answer.verdict == "effect"
    assert answer.effects[0].family == "coulomb_friction"
    assert answer.table()["value"][0] == pytest.approx(0.06, rel=0.15)
