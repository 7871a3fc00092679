"""Virtual benches of the tutorial (chapter 2): efficiency measurements of a motor, and a swinging pendulum.

The motor of the dissertation is fictitious. The motor of this bench has more physics than the two-parameter
model of Fig. 2.4a: a warming winding, voltage drop of the brushes, dry friction, field weakening, and a fan.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import expit

from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.rigs.virtual import VirtualCampaign
from unmodelled.base.arrays import Array
from unmodelled.base.files import write_json


@dataclass(frozen=True)
class MotorBench:
    """A separately excited DC motor in steady state at a constant voltage."""

    voltage: float = 200.0  # of the armature, V
    resistance: float = 3.4  # of the cold winding, ohm
    brushes: float = 2.0  # voltage drop, V
    constant: float = 1.25  # motor constant K without load, V s/rad
    dry: float = 0.55  # friction, N m
    viscous: float = 0.006  # friction, N m s/rad
    nominal: float = 15.0  # current, A
    warming: float = 0.3  # relative rise of the winding's resistance at the nominal current
    reaction: float = 0.08  # relative fall of the motor constant at the nominal current
    fan: float = 120.0  # power, W
    fan_starts: float = 9.0  # current above which the fan runs, A; the transition is about one ampere wide

    def efficiency(self, current: Array) -> Array:
        """Return the ratio of mechanical to electrical power. Takes current (n,) in A; gives (n,)."""
        load = current / self.nominal
        resistance = self.resistance * (1.0 + self.warming * load**2)
        constant = self.constant * (1.0 - self.reaction * load**1.5)
        speed = (self.voltage - self.brushes - resistance * current) / constant
        torque = constant * current - self.dry - self.viscous * speed
        fan = self.fan * expit((current - self.fan_starts) / 0.5)
        return np.asarray(torque * speed / (self.voltage * current + fan))


@dataclass(frozen=True)
class TutorialCampaign(VirtualCampaign):
    """Efficiencies of a motor between two currents, and runs of a pendulum with small and large torques.

    training.csv has the current (A) and the efficiency. The log folder `pendulum` has t, torque and theta,
    with the groups explored and unseen. Three files are for the assessment only: new.csv (test samples),
    truth.csv (a wider range without noise) and bench.json (the motor, the range of the measured currents and
    their noise).

    Attributes:
        samples: number of evenly spaced training samples.
        new: number of test samples at random currents.
        lowest: lowest measured current, A.
        highest: highest measured current, A.
        noise: standard deviation of the noise of an efficiency.
        runs: number of runs of the pendulum in the group "explored".
        far_runs: number of runs of the pendulum in the group "unseen".
        small: amplitude of the torque in the group "explored", N m.
        large: amplitude of the torque in the group "unseen", N m.
        coulomb: dry friction torque of the pendulum, N m.
        motor: constants of the motor.
    """

    samples: int = 16
    new: int = 200
    lowest: float = 4.0
    highest: float = 15.0
    noise: float = 0.01
    runs: int = 10
    far_runs: int = 6
    small: float = 0.2
    large: float = 0.5
    coulomb: float = 0.04
    motor: MotorBench = field(default_factory=MotorBench)

    description = (
        "a virtual DC motor and a virtual pendulum for the tutorial, parameters invented but plausible, not "
        "measurements"
    )

    def make(self, out: Path, seed: int) -> int:
        rng = np.random.default_rng(seed)
        sets = {
            "training": np.linspace(self.lowest, self.highest, self.samples),
            "new": np.sort(rng.uniform(self.lowest, self.highest, self.new)),
        }
        grid = np.linspace(0.4 * self.lowest, 1.5 * self.highest, 210)
        for name, current in {**sets, "truth": grid}.items():
            noise = 0.0 if name == "truth" else rng.normal(0.0, self.noise, len(current))
            table = {"current": current, "efficiency": self.motor.efficiency(current) + noise}
            pd.DataFrame(table).to_csv(out / f"{name}.csv", index=False, float_format="%.6g")
        bench = {"lowest": self.lowest, "highest": self.highest, "noise": self.noise}
        write_json(out / "bench.json", {**bench, "motor": asdict(self.motor)})
        runs = pd.concat(self._swings(out / "pendulum", seed), ignore_index=True)
        runs.to_csv(out / "pendulum" / "experiments.csv", index=False)
        return len(runs)

    def _swings(self, folder: Path, seed: int) -> Iterator[pd.DataFrame]:
        """Write the runs of both groups into folders of their own; their rows of experiments.csv."""
        groups = {"explored": (self.runs, self.small), "unseen": (self.far_runs, self.large)}
        for k, (group, (runs, torque)) in enumerate(groups.items()):
            campaign = PendulumCampaign(runs=runs, torque=torque, coulomb=self.coulomb)
            campaign.write(folder / group, seed + k)
            table = pd.read_csv(folder / group / "experiments.csv")
            (folder / group / "experiments.csv").unlink()
            yield table.assign(id=f"{group}_" + table["id"], file=f"{group}/" + table["file"], group=group)
