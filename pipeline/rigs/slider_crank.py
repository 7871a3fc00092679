"""Virtual slider-crank bench (section 4.2.2): rigid bodies in a closed loop (MuJoCo), logged by a drive.

The bench replaces the real machine: it shares no code with the models identified from its logs and uses
another simulation engine. It has effects that these models leave out: a progressive compression spring and
dry friction on the slider, torque ripple, encoder steps and a jittering clock. The crank turns in a vertical
plane, the slider moves horizontally. The coordinate d is the distance of the slider from its position closest
to the shaft; the spring pushes the slider towards the shaft.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import exp, sin, tanh
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd

from pipeline.rigs.slider_crank_profiles import PROFILES, Profile
from pipeline.rigs.virtual import VirtualCampaign
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import track

TURN = 2 * float(np.pi)
STARTS = {"a": 0.3, "b": 2.2}  # crank angle (rad) at which a run is released
_SUBSTEPS = 20  # integration steps per sample: keeps the loop closed to some micrometres at full speed
_POINT = 1e-9  # moment of inertia (kg m^2) that counts as zero
_LAYOUT = """
<mujoco model="slider_crank">
  <compiler angle="radian" autolimits="false"/>
  <option timestep="{step}" gravity="0 -{gravity} 0" integrator="Euler" tolerance="1e-14">
    <flag energy="enable" contact="disable"/>
  </option>
  <worldbody>
    <body name="crank">
      <joint name="crank" axis="0 0 1" armature="{armature}" damping="{damping}"/>
      <inertial pos="{half_crank} 0 0" mass="{crank_mass}" diaginertia="{point} {point} {point}"/>
      <body name="rod" pos="{crank_length} 0 0">
        <joint name="rod" axis="0 0 1"/>
        <site name="end" pos="{rod_length} 0 0"/>
        <inertial pos="{half_rod} 0 0" mass="{rod_mass}" diaginertia="{point} {rod_inertia} {rod_inertia}"/>
      </body>
    </body>
    <body name="slider" pos="{closest} 0 0">
      <joint name="slider" type="slide" axis="1 0 0"/>
      <site name="pin"/>
      <inertial pos="0 0 0" mass="{slider_mass}" diaginertia="{point} {point} {point}"/>
    </body>
  </worldbody>
  <equality>
    <connect site1="end" site2="pin" solref="5e-4 1" solimp="0.9999 0.9999 0.001"/>
  </equality>
</mujoco>
"""


@dataclass(frozen=True)
class SliderCrankRig:
    """Constants of the bench (linkage of table 4.1).

    The crank's centre of mass is at half its length; the rod is slender. The force of the spring is preload +
    stiffness d + stiffening (d / 0.1 m)^4. Dry friction of the slider is regularised by tanh(v / stick). The
    torque ripple is ripple sin(6 theta) + ripple_share T sin(12 theta).
    """

    crank_mass: float = 0.23  # kg
    rod_mass: float = 0.35  # kg
    slider_mass: float = 0.77  # kg
    crank_length: float = 0.05  # m
    rod_length: float = 0.29  # m
    shaft_inertia: float = 0.0034  # of motor and crank, about the shaft, kg m^2
    damping: float = 0.007  # of the shaft, N m s/rad
    gravity: float = 9.81  # m/s^2
    preload: float = 1.0  # N
    stiffness: float = 60.0  # N/m
    stiffening: float = 55.0  # N
    coulomb: float = 3.0  # of the slider, N
    static: float = 4.5  # of the slider, N
    stribeck: float = 0.03  # speed, m/s
    viscous: float = 4.0  # of the slider, N s/m
    stick: float = 0.002  # m/s
    ripple: float = 0.02  # N m
    ripple_share: float = 0.01
    encoder_counts: int = 8192  # per turn
    torque_noise: float = 0.01  # root mean square, N m
    period: float = 5e-4  # s
    jitter: float = 1e-6  # root mean square, s

    def spring(self, d: Any) -> Any:
        """Return the force of the spring towards the shaft, N. Takes d (any shape)."""
        return self.preload + self.stiffness * d + self.stiffening * (10.0 * d) ** 4

    def friction(self, v: float) -> float:
        """Return the friction force against the motion of the slider, N. Takes v in m/s."""
        dry = self.coulomb + (self.static - self.coulomb) * exp(-((v / self.stribeck) ** 2))
        return dry * tanh(v / self.stick) + self.viscous * v

    def without_spring(self) -> "SliderCrankRig":
        """Return the same bench without the spring."""
        return replace(self, preload=0.0, stiffness=0.0, stiffening=0.0)

    def simulate(self, torque: Profile, start: float, samples: int = 800) -> dict[str, Array]:
        """Simulate a run without noise from rest.

        Args:
            torque: commanded torque, N m, as a function of time, s.
            start: angle of the crank at the start, rad.
            samples: number of samples; default 800.

        Returns:
            Signals by name, each of shape (samples,): theta (rad, unwrapped), omega (rad/s), d (m), v (m/s),
            drive (torque on the shaft with ripple, N m), spring and friction (N), energy (J; kinetic, of
            gravity and of the spring), gap (opening of the loop at the joint of rod and slider, m), t (s) and
            T (command, N m).
        """
        model = mujoco.MjModel.from_xml_string(self._layout())
        data = mujoco.MjData(model)
        angles, speeds, loads = data.qpos, data.qvel, data.qfrc_applied  # crank, rod on crank, slider
        angles[:] = self._assembled(start)
        commands = torque(np.linspace(0.0, samples * self.period, samples * _SUBSTEPS, endpoint=False))
        rows = np.empty((samples, 9))
        for k, command in enumerate(commands.tolist()):
            mujoco.mj_step1(model, data)
            theta, d, v = float(angles[0]), float(angles[2]), float(speeds[2])
            drive = command + self.ripple * sin(6 * theta) + self.ripple_share * command * sin(12 * theta)
            spring, friction = self.spring(d), self.friction(v)
            loads[0], loads[2] = drive, -spring - friction
            if k % _SUBSTEPS == 0:
                stored = data.energy[0] + data.energy[1] + self._stored(d)
                row = (theta, speeds[0], d, v, drive, spring, friction, stored, self._gap(angles))
                rows[k // _SUBSTEPS] = row
            mujoco.mj_step2(model, data)
        names = ("theta", "omega", "d", "v", "drive", "spring", "friction", "energy", "gap")
        run: dict[str, Array] = dict(zip(names, rows.T, strict=True))
        return run | {"t": np.arange(samples, dtype=np.float64) * self.period, "T": commands[::_SUBSTEPS]}

    def log(self, true: dict[str, Array], noise: np.random.Generator) -> dict[str, Array]:
        """Return the log of the drive for a simulated run.

        theta has the steps of the encoder and lies in [0, 2 pi). The drive computes omega from theta by
        central differences over two samples, including the steps.

        Takes true (samples,); gives (samples,).
        """
        samples = len(true["t"])
        delay = self.jitter * np.append(0.0, noise.standard_normal(samples - 1))
        counts = np.round((true["theta"] + true["omega"] * delay) * self.encoder_counts / TURN)
        theta = np.mod(counts, self.encoder_counts) * TURN / self.encoder_counts
        omega = np.gradient(counts) * (TURN / self.encoder_counts / self.period)
        signal = true["T"] + self.torque_noise * noise.standard_normal(samples)
        return {"t": true["t"] + delay, "theta": theta, "omega": omega, "T": signal}

    def _layout(self) -> str:
        """The bodies and joints for MuJoCo; those it cannot turn have a negligible inertia of their own."""
        own = self.crank_mass * (self.crank_length / 2) ** 2
        return _LAYOUT.format(
            step=self.period / _SUBSTEPS, gravity=self.gravity, damping=self.damping, point=_POINT,
            armature=self.shaft_inertia - own - _POINT, crank_mass=self.crank_mass, rod_mass=self.rod_mass,
            slider_mass=self.slider_mass, crank_length=self.crank_length, half_crank=self.crank_length / 2,
            rod_length=self.rod_length, half_rod=self.rod_length / 2,
            rod_inertia=self.rod_mass * self.rod_length**2 / 12, closest=self.rod_length - self.crank_length,
        )  # fmt: skip

    def _assembled(self, theta: float) -> tuple[float, float, float]:
        """Joint positions of the closed loop: crank angle, angle of the rod on the crank, d."""
        rod = -float(np.arcsin(self.crank_length / self.rod_length * np.sin(theta)))
        reach = self.crank_length * np.cos(theta) + self.rod_length * np.cos(rod)
        return theta, rod - theta, float(reach) - (self.rod_length - self.crank_length)

    def _gap(self, joints: Array) -> float:
        """Distance (m) between the end of the rod and the slider."""
        crank, rod = np.exp(1j * joints[0]), np.exp(1j * (joints[0] + joints[1]))
        tip = self.crank_length * crank + self.rod_length * rod
        return float(abs(tip - joints[2] - (self.rod_length - self.crank_length)))

    def _stored(self, d: float) -> float:
        """Energy (J) in the spring."""
        return d * (self.preload + self.stiffness * d / 2 + self.stiffening * (10.0 * d) ** 4 / 5)


@dataclass(frozen=True)
class SliderCrankCampaign(VirtualCampaign):
    """Runs of the bench: every torque profile from two starting angles, sampled at 2 kHz, as a log folder.

    experiments.csv has the columns id, file, profile and start (rad). One CSV file per experiment has t (s),
    theta (rad), omega (rad/s) and T (N m), with noise that depends on the seed, profile and start only. Three
    files are for the assessment only: bench.json (constants of the bench), spring.csv (d in m and F in N of
    the spring at 60 points) and truth.parquet (id, t, d, v, F: the load on the slider in every run).

    Attributes:
        spring: whether the bench has its spring.
        profiles: numbers of the torque profiles, 1 to 10; default: all profiles.
        samples: number of samples per run.

    Raises:
        BadInput: when a profile does not exist or is named twice, or there are too few samples for a log.
    """

    spring: bool = True
    profiles: Sequence[int] | None = None
    samples: int = 800

    def __post_init__(self) -> None:
        known = range(1, len(PROFILES) + 1)
        for number in self.chosen:
            if number not in known or self.chosen.count(number) > 1:
                raise BadInput(
                    f"source.profiles: {number} is not one of 1 to {len(PROFILES)}, each once at most"
                )
        if not self.chosen:
            raise BadInput("source.profiles is empty")
        if self.samples < 50:
            raise BadInput(f"source.samples must be at least 50, got {self.samples}")

    @property
    def chosen(self) -> list[int]:
        """Numbers of the torque profiles to run."""
        return list(range(1, len(PROFILES) + 1)) if self.profiles is None else list(self.profiles)

    @property
    def rig(self) -> SliderCrankRig:
        """Bench of this campaign."""
        return SliderCrankRig() if self.spring else SliderCrankRig().without_spring()

    @property
    def description(self) -> str:
        how = "with" if self.spring else "without"
        return f"simulated logs of a virtual slider-crank bench {how} spring, not measurements"

    def make(self, out: Path, seed: int) -> int:
        rig, table, truth = self.rig, self._table(), []
        for row in track(table.itertuples(), len(table), "virtual bench"):
            noise = np.random.default_rng([seed, row.profile, round(1e6 * row.start)])
            true = rig.simulate(PROFILES[row.profile - 1], row.start, self.samples)
            _write_csv(out / row.file, pd.DataFrame(rig.log(true, noise)))
            load = {"F": true["spring"] + true["friction"]}
            truth.append(pd.DataFrame({"id": row.id, **{k: true[k] for k in ("t", "d", "v")}, **load}))
        write_parquet(pd.concat(truth), out / "truth.parquet")
        _write_csv(out / "experiments.csv", table)
        d = np.linspace(0.0, 2 * rig.crank_length, 60)
        _write_csv(out / "spring.csv", pd.DataFrame({"d": d, "F": rig.spring(d)}))
        write_json(out / "bench.json", asdict(rig))
        return len(table)

    def _table(self) -> pd.DataFrame:
        runs = [(number, mark, start) for number in self.chosen for mark, start in STARTS.items()]
        return pd.DataFrame(
            [(f"T{number}{mark}", f"T{number}{mark}.csv", number, start) for number, mark, start in runs],
            columns=["id", "file", "profile", "start"],
        )


def _write_csv(path: Path, table: pd.DataFrame) -> None:
    table.to_csv(path, index=False, float_format="%.9g", lineterminator="\n")
