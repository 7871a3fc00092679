"""Logs that are read wrongly: the answer is what is wrong with them, and right logs raise no alarm."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter, savgol_filter

from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.rigs.withheld.campaign import WithheldCampaign
from pipeline.rigs.withheld.chain.campaign import write_measured
from pipeline.rigs.withheld.chain.drawing import measured_cases
from tests.diagnosis.benches import Bench, pendulum
from tests.machines.folders import changed, logs_of, motion, read_case, system_of, text_of
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.faults.copies import copies
from unmodelled.diagnosis.faults.duplicates import different
from unmodelled.diagnosis.faults.look import log_faults, without_copies
from unmodelled.diagnosis.faults.trials import Trials
from unmodelled.diagnosis.where.where import where
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

HORIZON = 0.1
SYSTEM = Path("systems/pendulum.yaml")
Spoil = Callable[[pd.DataFrame, str], pd.DataFrame]


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of a pendulum with a dry friction that systems/pendulum.yaml does not know."""
    folder = tmp_path_factory.mktemp("pendulum") / "logs"
    PendulumCampaign(runs=6, duration=2.0).write(folder, 0)
    return folder


def scaled(column: str, factor: float, only: str = "") -> Spoil:
    return lambda log, name: log.assign(**{column: log[column] * (factor if only in ("", name) else 1.0)})


def shifted(by: float, only: str) -> Spoil:
    return lambda log, name: log.assign(theta=log["theta"] + (by if name == only else 0.0))


def stretched(by: float, only: str) -> Spoil:
    """A run of which the motion goes `by` times as fast as its column of time says."""

    def spoil(log: pd.DataFrame, name: str) -> pd.DataFrame:
        if name != only:
            return log
        t = log["t"][log["t"] * by <= log["t"].max()]
        return pd.DataFrame({c: np.interp(t * by, log["t"], log[c]) for c in log}).assign(t=t)

    return spoil


def spoilt(right: Path, folder: Path, spoil: Spoil, known: Path = SYSTEM) -> tuple[System, Logs]:
    """The system, and logs that went through `spoil` before they were written."""
    folder.mkdir(exist_ok=True)
    table = pd.read_csv(right / "experiments.csv")
    table.to_csv(folder / "experiments.csv", index=False)
    for name, file in zip(table["id"], table["file"], strict=True):
        spoil(pd.read_csv(right / file), name).to_csv(folder / file, index=False)
    system = read_system(known)
    return system, read_logs(folder, system)


def read_right(folder: Path) -> tuple[System, Logs]:
    system = read_system(SYSTEM)
    return system, read_logs(folder, system)


def only(faults: tuple[LogFault, ...]) -> LogFault:
    (fault,) = faults
    assert fault.decides
    return fault


WRONG = {
    "angle in degrees": (scaled("theta", 180.0 / np.pi), "theta", "degrees", ()),
    "sign of the input turned round": (scaled("torque", -1.0), "torque", "sign", ()),
    "one run's angle + 1e6": (shifted(1e6, "run3"), "theta", "offset", ("run3",)),
    "one run's angle + 1e9": (shifted(1e9, "run3"), "theta", "offset", ("run3",)),
    "one run's angle + 1": (shifted(1.0, "run3"), "theta", "offset", ("run3",)),
    "one run's angle in degrees": (scaled("theta", 180.0 / np.pi, "run3"), "theta", "degrees", ("run3",)),
    "one run's sign turned round": (scaled("torque", -1.0, "run2"), "torque", "sign", ("run2",)),
    "torque in mN m": (scaled("torque", 1e3), "torque", "milli", ()),
    "torque in kN m": (scaled("torque", 1e-3), "torque", "kilo", ()),
    "time in ms": (scaled("t", 1e3), "t", "milliseconds", ()),
    "time in us": (scaled("t", 1e6), "t", "microseconds", ()),
    "time twice": (scaled("t", 2.0), "t", "clock", ()),
    "time halved": (scaled("t", 0.5), "t", "clock", ()),
    "one run's clock twice too slow": (stretched(2.0, "run3"), "t", "clock", ("run3",)),
    "one run's clock 20 % off": (stretched(1.2, "run3"), "t", "clock", ("run3",)),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_with_the_logs_is_the_answer(what: str, right: Path, tmp_path: Path) -> None:
    spoil, channel, problem, experiments = WRONG[what]
    fault = only(log_faults(*spoilt(right, tmp_path, spoil), HORIZON))
    assert (fault.channels, fault.problem, fault.experiments) == ((channel,), problem, experiments)
    assert fault.explains is not None and fault.explains > (0.5 if experiments else 0.98)
    assert channel in fault.sentence and fault.sentence.endswith("then diagnose again.")


@pytest.mark.parametrize(("by", "runs"), [(0.2, ()), (1.0, ("run3",))])
def test_whole_turns_of_a_shaft_are_no_offset(
    by: float, runs: tuple[str, ...], right: Path, tmp_path: Path
) -> None:
    """Most runs begin a turn later; what is left of an offset must be larger than the motion."""
    spoil: Spoil = lambda log, name: log.assign(  # noqa: E731
        theta=log["theta"] + (by if name == "run3" else 2.0 * np.pi * (name != "run1"))
    )
    faults = log_faults(*spoilt(right, tmp_path, spoil), HORIZON)
    assert [(f.problem, f.experiments) for f in faults] == [("offset", runs)] * len(runs[:1])
    assert all("shifted by 1.0" in f.sentence or "shifted by 0.9" in f.sentence for f in faults)


def test_a_turned_sign_may_be_that_of_the_other_channel(right: Path, tmp_path: Path) -> None:
    fault = only(log_faults(*spoilt(right, tmp_path, scaled("torque", -1.0)), HORIZON))
    assert fault.indistinguishable == ((("theta",), "sign"),)


@pytest.fixture(scope="module")
def frictionless(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of a pendulum that systems/pendulum.yaml knows all about."""
    folder = tmp_path_factory.mktemp("frictionless") / "logs"
    PendulumCampaign(runs=6, duration=2.0, coulomb=0.0).write(folder, 0)
    return folder


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (scaled("t", 2.0), "ran 2 times too fast: multiplied by 0.4"),
        (stretched(1.05, "run3"), "t of run3 looks as if its clock ran 4.8 % slow: multiplied by 1.05"),
        (stretched(0.8, "run3"), "t of run3 looks as if its clock ran 1.25 times too fast: multiplied by 0."),
    ],
    ids=["all twice", "one 5 % slow", "one 25 % fast"],
)
def test_how_far_a_clock_is_off(spoil: Spoil, said: str, frictionless: Path, tmp_path: Path) -> None:
    assert said in only(log_faults(*spoilt(frictionless, tmp_path, spoil), HORIZON)).sentence


def test_a_clock_of_one_run_beside_wrong_numbers(frictionless: Path, tmp_path: Path) -> None:
    """Numbers 30 % off leave errors in all runs; this one stands out once they are fitted."""
    system = pendulum(tmp_path).with_values({"J": 0.014, "mgl": 0.7})
    _, logs = spoilt(frictionless, tmp_path, stretched(0.8, "run3"))
    fault = only(log_faults(system, prepare(system, logs), HORIZON))
    assert (fault.channels, fault.problem, fault.experiments) == (("t",), "clock", ("run3",))


def test_a_delay_that_depends_on_the_flow_is_no_wrong_clock(tmp_path: Path) -> None:
    """The front comes after 0.45 s in one run and after 1 s in the others; the file knows the latter."""
    rng, t, logs = np.random.default_rng(0), np.arange(0.0, 12.0, 0.05), list[pd.DataFrame]()
    for run in range(6):
        valve = np.repeat(rng.uniform(0.0, 1.0, 6), 40)
        late = np.interp(t - (0.45 if run == 5 else 1.0), t, valve)
        level = lfilter([0.05 / 0.3], [1.0, 0.05 / 0.3 - 1.0], late) + 1e-3 * rng.standard_normal(len(t))
        logs.append(pd.DataFrame({"t": t, "u": valve, "y": level}))
    system = system_of(text_of("pipe.yaml"), tmp_path)
    assert log_faults(system, logs_of(system, tmp_path / "logs", logs), 1.0) == ()


@pytest.mark.parametrize(("inertia", "dry", "clock"), [(0.19, 3.0, 1.0), (0.1, 0.0, 1.4)])
def test_inertia_and_friction_are_no_wrong_clock(
    inertia: float, dry: float, clock: float, tmp_path: Path
) -> None:
    """A wheel with an eccentric mass, whose file lacks inertia and dry friction, swings slower."""
    rng, t, waves = np.random.default_rng(4), 0.005 * np.arange(1000), []
    for _ in range(6):
        tones = (2.0 * np.pi * f * t for f in rng.uniform(0.2, 2.0, 6))
        wave = sum(rng.uniform(0.4, 1.0) * np.sin(tone + rng.uniform(0.0, 6.0)) for tone in tones)
        waves.append(13.0 * wave / np.abs(wave).max())
    T = np.array(waves)

    def rates(x: np.ndarray, torque: np.ndarray) -> list[np.ndarray]:
        rub = 0.4 * x[1] + dry * np.tanh(x[1] / 0.01)
        return [x[1], (torque - rub - 5.0 * np.sin(x[0])) / inertia]

    q = motion(rates, np.zeros((2, 6)), T.T, 0.005, substeps=10)[:, 0].T
    noisy = q + 1e-4 * rng.standard_normal((6, 1000))
    tables = [pd.DataFrame({"t": clock * t, "T": T[k], "q": noisy[k]}) for k in range(6)]
    system = system_of(text_of("wheel.yaml"), tmp_path)
    logs = logs_of(system, tmp_path / "logs", tables)
    found = log_faults(system, logs, default_horizon(logs))
    assert [fault.problem for fault in found] == ["clock"] * (dry == 0.0)


def spiked(seed: int) -> Spoil:
    """Two neighbouring samples at each of four places of a run, off by 30 % of the motion."""

    def spoil(log: pd.DataFrame, name: str) -> pd.DataFrame:
        rng, theta = np.random.default_rng([seed, int(name[3:])]), log["theta"].to_numpy().copy()
        for i in rng.integers(10, len(theta) - 10, 4):
            theta[i : i + 2] += 0.3 * theta.std() * rng.choice([-1.0, 1.0])
        return log.assign(theta=theta)

    return spoil


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.long) for k in range(2, 6))])
def test_a_window_that_starts_at_bad_samples_is_no_wrong_clock(
    seed: int, frictionless: Path, tmp_path: Path
) -> None:
    assert log_faults(*spoilt(frictionless, tmp_path, spiked(seed)), HORIZON) == ()


def test_another_clock_of_one_run_leaves_the_windows_of_the_others(frictionless: Path) -> None:
    trials = Trials(*read_right(frictionless), HORIZON)
    steps, clock = trials.steps(trials.none), np.array([1.0, 0.98, 1.0, 1.0, 1.0, 1.0])
    before, after = (trials.square(c, steps) for c in (trials.none, replace(trials.none, clock=clock)))
    np.testing.assert_array_equal(np.flatnonzero(before != after), [1])


@pytest.mark.long
def test_a_stiffening_spring_is_no_wrong_clock_of_the_run_that_moves_furthest(tmp_path: Path) -> None:
    """A clock 6 % fast would explain 96 % of the error of this run, and more than half of all error."""
    belt = measured_cases("single", 8, 125)[-1]
    write_measured(belt, tmp_path / "case")
    assert [effect.family for effect in belt.effects] == ["nonlinear_spring"]
    system, logs, _ = without_copies(*read_case(tmp_path / "case"), 0.13)
    assert log_faults(system, logs, 0.13) == ()


def test_a_longer_horizon_shows_what_a_short_one_does_not(right: Path, tmp_path: Path) -> None:
    logs = spoilt(right, tmp_path, scaled("theta", 180.0 / np.pi))
    assert only(log_faults(*logs, 0.01)).problem == "degrees"


@pytest.fixture
def two_outputs(tmp_path: Path) -> Path:
    """systems/pendulum.yaml with the speed as another output."""
    both = ("  theta: {unit: rad}\nparam", "  theta: {unit: rad}\n  omega: {unit: rad/s}\nparam")
    (tmp_path / "system.yaml").write_text(changed(SYSTEM.read_text(), both))
    return tmp_path / "system.yaml"


def difference(over: int) -> Spoil:
    return lambda log, name: log.assign(
        omega=(log["theta"] - log["theta"].shift(over).bfill()) / (over * log["t"][1])
    )


def low_pass(log: pd.DataFrame, name: str) -> pd.DataFrame:
    log = difference(1)(log, name)
    return log.assign(omega=log["omega"].ewm(alpha=0.2, adjust=False).mean())


def smoothed(log: pd.DataFrame, name: str) -> pd.DataFrame:
    return log.assign(omega=savgol_filter(log["theta"], 21, 3, 1, log["t"][1]))


def second_sensor(log: pd.DataFrame, name: str) -> pd.DataFrame:
    log = smoothed(log, name)
    late = log["omega"].shift(10).bfill()
    return log.assign(omega=late + 0.02 * np.random.default_rng(len(name)).standard_normal(len(late)))


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (difference(4), "omega is computed from theta: difference over 5 samples, 4 ms late."),
        (smoothed, "omega is computed from theta: difference over 21 samples, without delay."),
        (low_pass, "samples, 9 ms late."),
        (difference(40), "difference over 41 samples, 40 ms late."),
    ],
    ids=["difference", "smoothed", "low-pass", "late"],
)
def test_a_computed_speed_is_left_out(
    spoil: Spoil, said: str, right: Path, two_outputs: Path, tmp_path: Path
) -> None:
    known, read = spoilt(right, tmp_path / "logs", spoil, two_outputs)
    system, logs, (fault,) = without_copies(known, read, HORIZON)
    assert (fault.channels, fault.problem, fault.decides) == (("omega",), "copy", False)
    assert said in fault.sentence and fault.sentence.endswith("was left out of the outputs.")
    assert logs.outputs == ("theta",) == tuple(output.name for output in system.outputs)
    np.testing.assert_array_equal(logs.y[:, 0], read.y[:, read.outputs.index("theta")])


def test_a_late_sensor_with_noise_of_its_own_is_no_copy(
    right: Path, two_outputs: Path, tmp_path: Path
) -> None:
    known, read = spoilt(right, tmp_path / "logs", second_sensor, two_outputs)
    assert without_copies(known, read, HORIZON) == (known, read, ())


@pytest.mark.parametrize("turned", [False, True])
def test_the_later_of_two_same_columns_is_the_copy(turned: bool, right: Path) -> None:
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(400)
    first = np.concatenate([np.sin(3.0 * t) + 1e-4 * rng.standard_normal(400) for _ in range(3)])
    y = np.column_stack([first, np.roll(first, 3)])
    _, known = read_right(right)
    y, offsets = y[:, ::-1] if turned else y, np.arange(0, 1201, 400)
    logs = replace(known, y=y, outputs=("a", "b"), ids=("1", "2", "3"), offsets=offsets, period=0.01)
    (copy,) = copies(logs)
    assert (copy.target, copy.source, copy.slope) == ((0, 1, False) if turned else (1, 0, False))
    assert copy.delay == pytest.approx(0.03)


def still(folder: Path) -> Path:
    """Logs of a pendulum that swings freely."""
    PendulumCampaign(runs=4, duration=2.0, torque=0.0, coulomb=0.0).write(folder / "free", 0)
    return folder / "free"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_constant_input_is_noted(sign: float, tmp_path: Path) -> None:
    free = still(tmp_path)
    (fault,) = log_faults(*spoilt(free, tmp_path / "logs", scaled("torque", sign)), HORIZON)
    assert (fault.channels, fault.problem, fault.decides) == (("torque",), "constant", False)
    assert fault.sentence.startswith("torque is 0 in all samples of all experiments")


def test_a_wrong_clock_of_a_system_without_inputs(tmp_path: Path) -> None:
    free = still(tmp_path)
    driven = ("inputs:\n  torque: {unit: N m}\n", ""), ("(torque - b", "(-b")
    (tmp_path / "free.yaml").write_text(changed(SYSTEM.read_text(), *driven))
    logs = spoilt(free, tmp_path / "logs", stretched(1.5, "run1"), tmp_path / "free.yaml")
    fault = only(log_faults(*logs, HORIZON))
    assert (fault.channels, fault.problem, fault.experiments) == (("t",), "clock", ("run1",))


def test_an_input_that_has_nothing_to_do_with_the_motion(right: Path, tmp_path: Path) -> None:
    """As large and as fast as the one that acts."""

    def other(log: pd.DataFrame, name: str) -> pd.DataFrame:
        rng, spectrum = np.random.default_rng(len(name)), np.fft.rfft(log["torque"])
        turned = spectrum * np.exp(2j * np.pi * rng.uniform(size=len(spectrum)))
        return log.assign(torque=np.fft.irfft(turned, len(log)))

    fault = only(log_faults(*spoilt(right, tmp_path, other), HORIZON))
    assert (fault.channels, fault.problem) == (("torque",), "no_effect")
    assert "nothing to do with the outputs" in fault.sentence and "Check that the column" in fault.sentence


@pytest.mark.parametrize(
    "spoil",
    [
        *(scaled("t", 1.0), scaled("torque", 0.7), scaled("torque", 0.2), scaled("theta", 1.2)),
        *(shifted(0.1, "run3"), lambda log, name: log.assign(theta=log["theta"] + 0.2)),
        lambda log, name: log.assign(torque=log["torque"] + 0.3),
    ],
    ids=["right", "gain", "weak", "sensor gain", "small offset", "sensor offset", "load"],
)
def test_true_effects_raise_no_alarm(spoil: Spoil, right: Path, tmp_path: Path) -> None:
    assert log_faults(*spoilt(right, tmp_path, spoil), HORIZON) == ()


@pytest.mark.parametrize("limit", [pytest.param(0.03, marks=pytest.mark.long), 0.1, 0.3])
def test_a_drive_that_saturates_is_no_wrong_unit(limit: float, tmp_path: Path) -> None:
    """Of commands that are up to thirty times too large, a thousandth predicts better than all."""
    system = pendulum(tmp_path)
    assert log_faults(system, Bench(limit=limit, friction=0.0).logs(tmp_path / "logs", system), HORIZON) == ()


def test_wrong_parameters_raise_no_alarm(right: Path, tmp_path: Path) -> None:
    system = pendulum(tmp_path)
    assert log_faults(system, read_logs(right, system), HORIZON) == ()
    far = system.with_values({"J": 0.05, "mgl": 0.3, "b": 0.09})
    assert log_faults(far, read_logs(right, far), HORIZON) == ()


@pytest.mark.long
@pytest.mark.parametrize(("kind", "count"), [("single", 6), ("local", 3), ("null", 3), ("outside", 3)])
def test_withheld_machines_raise_no_alarm(kind: str, count: int, tmp_path: Path) -> None:
    WithheldCampaign(kind, count, 37).write(tmp_path / "cases", 0)
    for case in sorted((tmp_path / "cases").glob("[!.]*")):
        assert log_faults(*read_case(case), HORIZON) == (), case


def copied(right: Path, runs: list[int]) -> tuple[System, Logs]:
    """Experiments a, b, c and d, which are some of the runs."""
    system, logs = read_right(right)
    logs = logs.among(runs)
    return system, replace(logs, ids=tuple("abcd"), experiments=logs.experiments.assign(id=list("abcd")))


def test_one_file_under_four_names(right: Path) -> None:
    system, logs = copied(right, [0, 0, 0, 0])
    fault = only(log_faults(system, logs, HORIZON))
    assert (fault.problem, fault.experiments, fault.explains) == ("identical", ("a", "b", "c", "d"), None)
    found = diagnose_gap(system, logs, HORIZON, 0, faults=(fault,))
    assert (found.verdict, found.effects) == ("check_logs", ())
    told = sentences(summary(found, where(found)))
    assert found.confidence > 0.9 and told[1].startswith("The logs of a, b, c and d are identical")


def test_some_copies_count_as_one_experiment(right: Path) -> None:
    system, logs = copied(right, [0, 1, 2, 1])
    (fault,) = log_faults(system, logs, HORIZON)
    assert fault.experiments == ("b", "d") and not fault.decides
    assert different(logs).ids == ("a", "b", "c")
    assert np.array_equal(different(logs).y, logs.y[: logs.offsets[3]])


@pytest.mark.parametrize("factor", [np.pi / 180.0, 180.0 / np.pi])
def test_corrected_logs_leave_the_errors_of_right_ones(factor: float, tmp_path: Path) -> None:
    """Also of an experiment near rest, whose motion is small beside that of the others."""
    system, logs = Bench(samples=150).recorded(tmp_path)
    assert np.ptp(logs.y[logs.rows(1)]) < 0.2 * np.ptp(logs.y[logs.rows(0)])
    wrong = prepare(system, replace(logs, y=logs.y / factor))
    none = Trials(system, logs, 0.1).none
    correction = replace(none, gain=np.full_like(none.gain, factor))
    right, corrected = Trials(system, logs, 0.1), Trials(system, wrong, 0.1)
    steps = right.steps(none)
    np.testing.assert_allclose(corrected.square(correction, steps), right.square(none, steps), rtol=1e-2)
