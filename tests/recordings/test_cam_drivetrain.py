"""The cam drivetrain: runs become a log folder, and its system files are the physics of the bench."""

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.kernels import numpy_function
from pipeline.recordings.cam_drivetrain import CamDrivetrainRecording
from pipeline.stages.acquire import acquire
from tests.machines.known import Array, runge_kutta
from tests.recordings.published import fits
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.logs.folder import read_logs
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[2] / "systems" / "cam_drivetrain"
CAMS = list(product((0.01, 0.03, 0.05, 0.07), (0.75 * np.pi, 1.25 * np.pi)))
#: In the order of `physics.MOTOR_PARAMETERS`.
MOTOR = {"J": 0.006, "k_V": 0.24, "k_omega": 0.07, "T_c": 0.5, "T_s": 0.2, "omega_s": 4.0}
SAMPLES, PERIOD = 1500, 0.001
GUIDE = {"b_0": 0.5, "b_1": 12.0}
ACCELERATION = numpy_function(
    physics.MOTOR_ACCELERATION.subs(physics.T_d, 0),
    (
        *(physics.theta, physics.omega, physics.dh, physics.d2h, physics.m, physics.V),
        *(*physics.CAM_CONSTANTS, *physics.MOTOR_PARAMETERS, *physics.CONSTANTS),
    ),
)


def curve(mechanism: CamFollower, H: float, beta: float) -> CubicSpline:
    """Lift over the angle, m."""
    lift = mechanism.cam(H, beta).pitch_curve(720)[0]
    return CubicSpline(np.arange(721) * TURN / 720, np.append(lift, lift[0]), bc_type="periodic")


@pytest.fixture(scope="module")
def known() -> System:
    return read_system(SYSTEMS / "nothing_withheld.yaml")


@pytest.fixture(scope="module")
def rate(known: System) -> Callable[..., Array]:
    """Acceleration that the system file says, rad/s^2."""
    return numpy_system_function(known, [known.dynamics[1]], efforts_zero=True)


@pytest.fixture(scope="module")
def mechanism() -> CamFollower:
    return CamFollower()


@pytest.mark.parametrize(("H", "beta"), CAMS)
def test_the_system_file_is_the_mechanism(
    H: float, beta: float, known: System, rate: Callable[..., Array], mechanism: CamFollower
) -> None:
    theta, omega = np.linspace(-3.0, 25.0, 200), np.linspace(1.0, 15.0, 200)
    x, c = np.stack([theta, omega], axis=1), np.tile([H, beta, 0.9, 6.0], (200, 1))
    p = np.array(known.with_values({**MOTOR, **GUIDE}).values)
    ours = rate(0.0, x, np.zeros((200, 0)), np.empty(0), p, c)[:, 0]
    theirs = motion(mechanism, H, beta, np.array(0.9), 6.0)(theta, omega)
    assert np.abs(ours - theirs).max() < 0.02 * np.ptp(theirs)
    assert np.std(ours - theirs) < 0.004 * np.std(theirs)


def motion(mechanism: CamFollower, H: float, beta: float, m: Array, V: float) -> Callable[..., Array]:
    """Acceleration of the bench over angle and speed, by the equations of chapter 6."""
    lift, cam = curve(mechanism, H, beta), mechanism.cam(H, beta)
    own = (*mechanism.cam_constants(cam), *MOTOR.values(), *mechanism.constants)

    def acceleration(theta: Array, omega: Array) -> Array:
        phi = np.mod(theta, TURN)
        return np.asarray(ACCELERATION(theta, omega, lift(phi, 1), lift(phi, 2), m, V, *own))

    return acceleration


def angle(acceleration: Callable[..., Array], runs: int) -> Array:
    """(samples, runs) rad, from a start with 3 rad/s."""
    start = np.array([np.zeros(runs), np.full(runs, 3.0)])
    return runge_kutta(lambda _, x: np.array([x[1], acceleration(*x)]), start, PERIOD * np.arange(SAMPLES))[
        :, 0
    ]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What ingest writes, of a virtual bench; only the runs that are to be chosen are real motions."""
    rng, mechanism, beta, masses = np.random.default_rng(0), CamFollower(), 0.75 * np.pi, (0.7, 1.3)
    rows, angles = [], []
    for H, middle in ((0.03, 5.0), (0.07, 7.0)):
        moved = angle(motion(mechanism, H, beta, np.array(masses), middle), 2)
        for (k, m), V in product(enumerate(masses), (middle - 1.0, middle, middle + 1.0)):
            real = moved[:, k] + 5e-5 * rng.standard_normal(SAMPLES)
            angles.append(np.linspace(0.0, 9.0, SAMPLES) if middle != V else real)
            rows.append((len(rows) + 1, H, beta, m, V, "contact"))
    table = pd.DataFrame(rows, columns=["exp", "H", "beta", "m", "V", "label"])
    # of two runs the one with the lower voltage
    table.loc[9, ["V", "label"]] = 4.0, "jump"
    signals = {"t": np.tile(np.arange(SAMPLES) * PERIOD, len(rows)), "theta": np.concatenate(angles)}
    folder = tmp_path_factory.mktemp("store") / "cam_follower"
    Campaign(table, signals, np.arange(len(rows) + 1) * SAMPLES, {"data": "virtual"}).write(folder)
    return folder


def recording(store: Path, **changes: object) -> CamDrivetrainRecording:
    levels = {"H": [0.03, 0.07], "beta": [0.75 * np.pi], "m": [0.7, 1.3]}
    return CamDrivetrainRecording(str(store), **{**levels, **changes})  # type: ignore[arg-type]


def test_the_contact_run_of_the_median_voltage_of_every_combination(store: Path, tmp_path: Path) -> None:
    acquire(recording(store, start=0.2, period=0.005), 0, tmp_path / "logs")
    table = pd.read_csv(tmp_path / "logs" / "experiments.csv")
    assert table["V"].tolist() == [5.0, 5.0, 7.0, 7.0] and table["m"].tolist() == [0.7, 1.3] * 2
    assert table["group"].nunique() == 2
    logs = read_logs(tmp_path / "logs", read_system(SYSTEMS / "nothing_withheld.yaml"))
    assert logs.period == pytest.approx(0.005) and np.diff(logs.offsets).tolist() == [260] * 4
    assert logs.provenance["data"] == "virtual" and logs.provenance["experiments"] == 4
    raw = Campaign.read(store)[1]["theta"]
    assert np.abs(logs.y[logs.rows(0), 0] - raw[200::5]).max() < 5e-4


def test_the_system_files_fit_the_bench(store: Path, tmp_path: Path) -> None:
    acquire(recording(store), 0, tmp_path / "logs")
    found = fits(SYSTEMS, tmp_path / "logs")
    # T_s and omega_s of the complete model together describe a small friction: its fit creeps
    assert all(fit.converged for name, fit in found.items() if name != "nothing")
    assert found["nothing"].values["b_1"] == pytest.approx(12.0, rel=0.1)
    assert found["nothing"].values["J"] == pytest.approx(0.006, rel=0.1)
    left = {name: fit.gap.value for name, fit in found.items()}
    assert 3.0 * left["nothing"] < min(left["friction"], left["inertia"])


def test_levels_without_a_contact_run_are_named(store: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"no contact run with H = 0\.02, beta = 2\.35619, m = 0\.7"):
        acquire(recording(store, H=[0.02]), 0, tmp_path / "logs")
    with pytest.raises(BadInput, match="no such file"):
        acquire(recording(tmp_path / "nowhere"), 0, tmp_path / "logs")
    assert not (tmp_path / "logs").exists()
