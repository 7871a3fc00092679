"""Columns of some runs that are wrong: what outputs say about each other, and what the known physics says."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.inspection.machines import PENDULUM, SCREW, Frames, Machine, registered
from tests.machines.folders import changed, system_of, text_of
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.faults.look import without_copies
from unmodelled.diagnosis.faults.questions import moves_with_constant_inputs
from unmodelled.diagnosis.faults.rates import Rate, rates
from unmodelled.logs.inspection.pairs import commands_as_outputs
from unmodelled.logs.logs import Logs

#: Pendulum with a dry friction that its system file does not know.
SWING = replace(
    PENDULUM,
    rates=lambda x, u: np.array(
        [x[1], (u - 2.0 * np.sin(x[0]) - 0.05 * x[1] - 0.08 * np.tanh(x[1] / 0.05)) / 0.05]
    ),
)
#: The same without a tachometer.
ANGLE = changed(SWING.system, (", tacho: {unit: rad/s, expression: rate}", ""))
#: Two masses at the ends of a shaft, whose angles are logged.
SHAFT = Machine(
    text_of("two_masses.yaml"),
    lambda x, u: np.array(
        [x[1], (u - 45.0 * (x[0] - x[2])) / 0.01, x[3], 45.0 * (x[0] - x[2]) / 0.03],
    ),
    states=4,
    force=0.6,
    period=0.005,
    logged=lambda x, rng: {f"q{k}": x[2 * k - 2] + 1e-4 * rng.standard_normal(x[0].shape) for k in (1, 2)},
    drive="u",
)
Spoil = Callable[[Frames], Frames]


@pytest.fixture(scope="module")
def frames() -> Frames:
    return SWING.frames(3, 6, 900)


def told(frames: Frames, folder: Path, text: str = SWING.system) -> list[LogFault]:
    system = system_of(text, folder)
    logs = Logs.from_frames(frames, system)
    return list(without_copies(system, logs, default_horizon(logs))[2])


def scaled(column: str, factor: float, *runs: str) -> Spoil:
    return lambda frames: (
        frames | {run: frames[run].assign(**{column: factor * frames[run][column]}) for run in runs}
    )


def exchanged(*runs: str) -> Spoil:
    headers = {"phi": "tacho", "tacho": "phi"}
    return lambda frames: frames | {run: frames[run].rename(columns=headers) for run in runs}


def of_other(column: str) -> Spoil:
    return lambda frames: frames | {"run4": frames["run4"].assign(**{column: frames["run2"][column]})}


def of_unlogged(frames: Frames) -> Frames:
    """The speed of a run that is not among the logs."""
    return frames | {"run4": frames["run4"].assign(tacho=SWING.frames(8, 1, 900)["run1"]["tacho"])}


def faster(by: float, *runs: str) -> Spoil:
    def fast(frame: pd.DataFrame) -> pd.DataFrame:
        t = frame["t"][frame["t"] * by <= frame["t"].max()]
        return pd.DataFrame({c: np.interp(t * by, frame["t"], frame[c]) for c in frame}).assign(t=t)

    return lambda frames: frames | {run: fast(frames[run]) for run in runs}


def still(frames: Frames) -> Frames:
    """An angle without noise, which the look for frozen channels with noise does not see."""
    known = {
        run: frame.assign(phi=frame["phi"].rolling(9, 1, True).mean().round(3))
        for run, frame in frames.items()
    }
    angle = known["run3"]["phi"].where(known["run3"].index < 600, known["run3"]["phi"][600])
    return known | {"run3": known["run3"].assign(phi=angle)}


def ended_at(column: str, end: float) -> Spoil:
    """A sensor whose range ends early."""
    return lambda frames: {run: f.assign(**{column: f[column].clip(-end, end)}) for run, f in frames.items()}


EVERY = tuple(f"run{k}" for k in range(1, 7))
FAULTS: dict[str, tuple[Spoil, str, tuple[str, ...], tuple[str, ...]]] = {
    "angle ten times": (scaled("phi", 10.0, "run2", "run4"), "factor", ("phi",), ("run2", "run4")),
    "speed a third": (scaled("tacho", 0.3, "run3"), "factor", ("tacho",), ("run3",)),
    "exchanged": (exchanged(*EVERY), "exchanged", ("phi", "tacho"), ()),
    "exchanged in two": (exchanged("run1", "run5"), "exchanged", ("phi", "tacho"), ("run1", "run5")),
    "speed of another run": (of_other("tacho"), "unrelated_rate", ("tacho",), ("run4",)),
    "speed of a run elsewhere": (of_unlogged, "unrelated_rate", ("tacho",), ("run4",)),
    "clocks": (faster(1.1, "run2", "run5"), "clock", ("t",), ("run2", "run5")),
    "standing": (still, "frozen", ("phi",), ("run3",)),
    "half of the angles": (ended_at("phi", 0.2), "clipped", ("phi",), ()),
    "no input": (scaled("torque", 0.0, "run1", "run3"), "constant", ("torque",), ("run1", "run3")),
}


@pytest.mark.parametrize("what", FAULTS)
def test_a_wrong_column_is_the_answer(what: str, frames: Frames, tmp_path: Path) -> None:
    spoil, problem, channels, runs = FAULTS[what]
    long = SWING.frames(3, 6, 1800) if problem == "constant" else frames  # it has to swing on
    (fault,) = told(spoil(long), tmp_path)
    assert (fault.problem, fault.channels, fault.experiments, fault.decides) == (
        problem,
        channels,
        runs,
        True,
    )
    assert fault.sentence.endswith("then diagnose again.")
    assert fault.explains is None  # samples show it, so that the answer is as sure with a small error


def test_right_columns_raise_no_alarm(frames: Frames, tmp_path: Path) -> None:
    slow = frames["run1"].assign(torque=0.0)
    rng = np.random.default_rng(0)
    slow["tacho"] = 0.02 * rng.standard_normal(len(slow))
    slow["phi"] = 1e-3 * rng.standard_normal(len(slow))
    assert told(frames, tmp_path) == told(frames | {"at_rest": slow}, tmp_path) == []


def test_the_physics_tells_a_factor_in_two_runs(frames: Frames, tmp_path: Path) -> None:
    """Without a speed beside the angle."""
    (fault,) = told(scaled("phi", 10.0, "run2", "run4")(frames), tmp_path, ANGLE)
    assert (fault.problem, fault.channels, fault.experiments) == ("factor", ("phi",), ("run2", "run4"))
    assert "numbers were 10" in fault.sentence or "numbers were 9.9" in fault.sentence


def test_the_physics_tells_a_factor_of_an_input_in_a_run(frames: Frames, tmp_path: Path) -> None:
    """Without a speed beside the angle."""
    (fault,) = told(scaled("torque", 3.0, "run2")(frames), tmp_path, ANGLE)
    assert (fault.problem, fault.channels, fault.experiments) == ("factor", ("torque",), ("run2",))


def test_an_input_that_was_not_recorded_in_a_run(tmp_path: Path) -> None:
    """Zero in one run and frozen in another; a free swing is no such run, not even if a hand pushes it."""
    right = SWING.frames(3, 6, 900)
    swing = replace(SWING, force=0.0, start=1.5).frames(5, 1, 900)["run1"]
    assert told(right | {"free": swing}, tmp_path, ANGLE) == []
    by_hand = replace(SWING, start=1.5, inputs=lambda u: 0.0 * u + 1.0 * (abs(np.arange(900) - 250) < 20))
    pushed = by_hand.frames(5, 1, 900)["run1"].assign(torque=0.0)
    assert not [fault for fault in told(right | {"free": pushed}, tmp_path, ANGLE) if fault.decides]
    kept = right["run5"].assign(torque=right["run5"]["torque"][100])
    (fault,) = told(scaled("torque", 0.0, "run3")(right) | {"run5": kept, "free": swing}, tmp_path, ANGLE)
    assert (fault.problem, fault.channels, fault.decides) == ("constant", ("torque",), True)
    assert fault.experiments == ("run3", "run5")


def test_an_input_that_was_not_recorded_in_half_of_the_runs(tmp_path: Path) -> None:
    runs = ("run1", "run4", "run6")
    (fault,) = told(scaled("force", 0.0, *runs)(SCREW.frames(3, 6, 900)), tmp_path, SCREW.system)
    assert (fault.problem, fault.channels, fault.experiments) == ("constant", ("force",), runs)


@pytest.mark.parametrize("form", ["%.17g", "%.6g", "%.4f", "%.3f"])
@pytest.mark.parametrize("step", [0.0, 10.0])
def test_a_multiple_of_an_input_is_no_measurement(form: str, step: float, tmp_path: Path) -> None:
    """Of a smooth input or of one in steps, which both columns write in a few digits."""
    inputs = (
        (lambda u: step * np.round(u[:, np.arange(u.shape[1]) // 40 * 40] / step)) if step else SCREW.inputs
    )
    frames = replace(SCREW, inputs=inputs).frames(3, 4, 900)
    shown = {run: f.assign(s=0.4 * f["force"]).map(lambda v: float(form % v)) for run, f in frames.items()}
    shown = {run: f.assign(t=frames[run]["t"]) for run, f in shown.items()}
    (fault,) = told(shown, tmp_path, SCREW.system)
    assert (fault.problem, fault.channels, fault.decides) == ("command", ("s",), True)
    assert "s is the input force times 0.4 in all samples" in fault.sentence


def test_an_output_that_shows_its_input_is_a_measurement(tmp_path: Path) -> None:
    system = system_of(
        changed(SCREW.system, ("s: {unit: m}}\nparam", "s: {expression: s + 0.4*force, unit: m}}\nparam")),
        tmp_path,
    )
    force = np.concatenate([f["force"] for f in SCREW.frames(3, 2, 900).values()])
    offsets = np.array([0, 900, 1800])
    assert commands_as_outputs(system, 0.4 * force[:, None], force[:, None], offsets) == {}


@pytest.mark.parametrize("runs", [EVERY, ("run2", "run4")])
def test_the_physics_tells_an_input_that_is_exchanged_with_an_output(
    runs: tuple[str, ...], tmp_path: Path
) -> None:
    frames = SHAFT.frames(3, 6, 900)
    wrong = frames | {run: frames[run].rename(columns={"u": "q2", "q2": "u"}) for run in runs}
    (fault,) = told(wrong, tmp_path, SHAFT.system)
    assert (fault.problem, fault.channels, fault.decides) == ("exchanged", ("u", "q2"), True)
    assert fault.experiments == (() if runs == EVERY else runs)


def test_an_output_of_another_run_is_told_without_a_speed_beside_it(tmp_path: Path) -> None:
    """Copied to one run, where the samples show it; exchanged between two, where the physics does."""
    frames = SHAFT.frames(3, 6, 900)
    one, other = frames["run2"]["q1"], frames["run5"]["q1"]
    copied = frames | {"run2": frames["run2"].assign(q1=other)}
    (fault,) = told(copied, tmp_path, SHAFT.system)
    assert (fault.problem, fault.channels, fault.experiments) == ("copied", ("q1",), ("run2", "run5"))
    (fault,) = told(copied | {"run5": frames["run5"].assign(q1=one)}, tmp_path, SHAFT.system)
    assert (fault.problem, fault.channels, fault.decides) == ("other_run", ("q1",), True)
    assert "given to run2 that of run5, run5 that of run2" in fault.sentence


@pytest.mark.parametrize("sign_bit", [False, True])
def test_the_physics_tells_signed_levels_that_were_read_as_unsigned(sign_bit: bool, tmp_path: Path) -> None:
    """An input in steps jumps anyway, so that the samples alone say nothing."""
    levels = replace(SCREW, inputs=lambda u: 15.0 * np.round(u[:, np.arange(u.shape[1]) // 40 * 40] / 15.0))
    frames = levels.frames(3, 6, 900)
    assert told(frames, tmp_path, SCREW.system) == []
    (fault,) = told(registered(frames, "force", 0.05, 12, sign_bit), tmp_path, SCREW.system)
    assert (fault.problem, fault.channels, fault.decides) == ("register", ("force",), True)
    assert "decoded, from -45 N to 60 N, the known" in fault.sentence


@pytest.mark.parametrize("runs", [(), ("run2", "run4")])
def test_a_factor_of_an_input_is_no_other_factor_of_outputs(runs: tuple[str, ...], tmp_path: Path) -> None:
    """On a linear machine it is the inverse factor of the only output."""
    wrong = scaled("force", 10.0, *(runs or EVERY))(SCREW.frames(3, 6, 900))
    (fault,) = told(wrong, tmp_path, SCREW.system)
    assert fault.channels == ("force",) and fault.experiments == runs
    assert fault.problem == "deci" or (
        runs and fault.problem == "factor" and "numbers were 10 times too large" in fault.sentence
    )


@pytest.mark.parametrize("runs", [(), ("run2", "run4")])
def test_the_physics_tells_exchanged_outputs(runs: tuple[str, ...], tmp_path: Path) -> None:
    """Angles of both ends of a shaft, without a speed beside them."""
    frames = SHAFT.frames(3, 6, 900)
    headers = {"q1": "q2", "q2": "q1"}
    wrong = frames | {run: frames[run].rename(columns=headers) for run in runs or EVERY}
    assert told(frames, tmp_path, SHAFT.system) == []
    (fault,) = told(wrong, tmp_path, SHAFT.system)
    assert (fault.problem, fault.channels, fault.experiments) == ("exchanged", ("q1", "q2"), runs)


def test_which_output_is_the_rate_of_another(tmp_path: Path) -> None:
    geared = changed(SWING.system, ("phi: {unit: rad}, tacho", "phi: {unit: rad, expression: 3*phi}, tacho"))
    assert rates(system_of(geared, tmp_path)) == (Rate(0, 1, pytest.approx(1.0 / 3.0)),)
    assert rates(system_of(text_of("two_masses.yaml"), tmp_path)) == ()


def test_a_stuck_input_is_told_beside_a_large_gap(tmp_path: Path) -> None:
    """A friction as large as the drive hides what the model says; a free swing is no such run."""
    heavy = replace(
        SWING,
        rates=lambda x, u: np.array(
            [x[1], (u - 2.0 * np.sin(x[0]) - 0.05 * x[1] - 0.2 * np.tanh(x[1] / 0.05)) / 0.05]
        ),
    )
    right = heavy.frames(4, 6, 1200)
    swing = replace(heavy, force=0.0, start=1.5).frames(5, 1, 1200)["run1"]
    stuck = {run: right[run].assign(torque=right[run]["torque"][50]) for run in ("run3", "run5")}
    system = system_of(ANGLE, tmp_path)
    for frames, runs in ((right | {"free": swing}, ()), (right | stuck, ("run3", "run5"))):
        logs = Logs.from_frames(frames, system)
        driven = moves_with_constant_inputs(logs)
        assert tuple(name for name, is_one in zip(logs.ids, driven, strict=True) if is_one) == runs
    (fault,) = told(right | stuck, tmp_path, ANGLE)
    assert (fault.problem, fault.channels, fault.experiments) == ("constant", ("torque",), ("run3", "run5"))
