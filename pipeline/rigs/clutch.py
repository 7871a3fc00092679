"""Virtual wet-clutch bench (section 3.3): 108 engagements from neutral to first gear, logged at 2 kHz.

The spring's threshold and the touch point of the plates change after each engagement; their scales are drawn
from a clipped normal distribution (section 3.3.3).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv as pa_csv
from scipy.stats import norm

from pipeline.rigs import clutch_rig
from pipeline.rigs.clutch_rig import ClutchRig, Setting
from pipeline.rigs.virtual import VirtualCampaign
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json

_EDGE = 0.002  # duration (s) of a step: the amplifier limits the rate of its current


@dataclass(frozen=True)
class Profiles:
    """A full factorial of fill pulses and ramps."""

    pulse: float  # level of the fill pulse, A
    u1: Sequence[float]  # widths of the pulse, s
    u2: Sequence[float]  # levels from which the ramp starts, A
    u3: Sequence[float]  # slopes of the ramp, A/s
    highest: float = 0.6  # level at which the ramp ends, A

    @property
    def settings(self) -> list[tuple[float, float, float]]:
        """Settings (u1, u2, u3) of every profile; u3 varies fastest."""
        return list(product(self.u1, self.u2, self.u3))

    def current(self, t: Array, u1: float, u2: float, u3: float) -> Array:
        """Return the current (n,), A, at t (n,), s: 0, the pulse until u1, then a ramp from u2, slope u3."""
        top = u1 + (self.highest - u2) / u3
        times = [0.0, _EDGE, u1, u1 + _EDGE, top]
        levels = [0.0, self.pulse, self.pulse, u2 + u3 * _EDGE, self.highest]
        return np.interp(t, times, levels)


MILD = Profiles(0.35, (0.108, 0.172, 0.236), (0.097, 0.121, 0.146), (0.116, 0.231))
SHARP = Profiles(0.45, (0.092, 0.144, 0.2), (0.084, 0.105, 0.126), (0.097, 0.194))


SPEEDS = (1200, 1350, 1500)  # of the motor, rpm
BRAKES = (10.0, 60.0)  # N m
BOX = ((0.7, 1.3), (0.4, 1.15))  # of the scales of threshold and touch point; in there every clutch locks
PERIOD = 5e-4  # s
DURATION = 4.0  # s
PASCAL = 1e5  # per bar: the logs are in SI units
NOISE = {"pressure": 2000.0, "omega_1": 0.2, "omega_2": 0.1}  # rms, Pa and rad/s
DECIMALS = {"pressure": -2, "omega_1": 2, "omega_2": 2}


@dataclass(frozen=True)
class ClutchCampaign(VirtualCampaign):
    """The full factorial of 18 current profiles, 3 motor speeds and 2 brakes, as a log folder.

    experiments.csv has the columns of `table`. One CSV file per engagement has t (s), current (A), pressure
    (Pa), omega_1 and omega_2 (rad/s). Theta and noise depend on the seed and the engagement only. bench.json
    contains alpha, box, constants, and theta and shifting time (s) of every engagement; only the assessment
    may read it.

    Attributes:
        sharp: whether the bench is the one whose shifting time is the more sensitive.
        alpha: means and standard deviations (mu_1, mu_2, sigma_1, sigma_2) of the scales theta of the spring
            threshold and the touch point, before they are clipped to the box.

    Raises:
        BadInput: when alpha is not four numbers with means in the box and positive standard deviations.
    """

    sharp: bool = False
    alpha: Sequence[float] = (0.91, 0.55, 0.081, 0.046)

    description = (
        "simulated logs of a virtual wet-clutch bench, parameters invented but plausible, not measurements"
    )

    def __post_init__(self) -> None:
        try:
            mu_1, mu_2, *sigmas = map(float, self.alpha)
        except (TypeError, ValueError):
            raise BadInput(f"source.alpha must be four numbers, got {self.alpha}") from None
        inside = all(low <= mu <= high for mu, (low, high) in zip((mu_1, mu_2), BOX, strict=True))
        if len(sigmas) != 2 or not inside or not all(0.0 < sigma < np.inf for sigma in sigmas):
            raise BadInput(
                f"source.alpha must be two means within {BOX[0]} and {BOX[1]} and two positive standard "
                f"deviations, got {list(self.alpha)}"
            )

    @property
    def rig(self) -> ClutchRig:
        """Bench of this campaign."""
        return clutch_rig.SHARP if self.sharp else clutch_rig.MILD

    @property
    def profiles(self) -> Profiles:
        """Current profiles of this campaign."""
        return SHARP if self.sharp else MILD

    def table(self) -> pd.DataFrame:
        """Return engagements, with u1 (s), u2 (A), u3 (A/s), omega_m (rad/s), T_b0 (N m), rpm, profile."""
        rows = product(enumerate(self.profiles.settings, start=1), SPEEDS, BRAKES)
        return pd.DataFrame(
            [
                (f"E{k}", f"E{k}.csv", *setting, round(rpm * np.pi / 30.0, 4), brake, rpm, profile)
                for k, ((profile, setting), rpm, brake) in enumerate(rows, start=1)
            ],
            columns=["id", "file", "u1", "u2", "u3", "omega_m", "T_b0", "rpm", "profile"],
        )

    def make(self, out: Path, seed: int) -> int:
        table = self.table()
        sources = [np.random.default_rng([seed, number]) for number in range(1, len(table) + 1)]
        theta = np.array([self.draw(source) for source in sources])
        current, run = self.simulate(table, theta)
        for i, (file, source) in enumerate(zip(table["file"], sources, strict=True)):
            true = {"pressure": PASCAL * run["p"], "omega_1": run["omega_1"], "omega_2": run["omega_2"]}
            _write_csv(out / file, current[:, i], {name: x[:, i] for name, x in true.items()}, source)
        table.to_csv(out / "experiments.csv", index=False, lineterminator="\n")
        bench = {"alpha": list(self.alpha), "box": BOX, "parameters": asdict(self.rig)}
        bench["theta"] = dict(zip(table["id"], theta.tolist(), strict=True))
        bench["shifting_time"] = dict(zip(table["id"], run["shift"].tolist(), strict=True))
        write_json(out / "bench.json", bench)
        return len(table)

    def simulate(self, table: pd.DataFrame, theta: Array) -> tuple[Array, dict[str, Array]]:
        """Simulate engagements without noise.

        Args:
            table: rows of `table()`.
            theta: scales of the spring threshold and the touch point, shape (n, 2).

        Returns:
            Currents, A, shape (samples, n), and the signals of `ClutchRig.simulate`.
        """
        t = PERIOD * np.arange(round(DURATION / PERIOD) + 1, dtype=np.float64)
        settings = table[["u1", "u2", "u3"]].itertuples(index=False)
        profiles = np.stack([self.profiles.current(t, *setting) for setting in settings], axis=1)
        current: Array = np.round(profiles, 5)  # as the amplifier gets it
        return current, self.rig.simulate(current, PERIOD, self.setting(table, theta))

    def setting(self, table: pd.DataFrame, theta: Array) -> Setting:
        """Return the settings that differ between engagements.

        Args:
            table: rows of `table()`.
            theta: scales of the spring threshold and the touch point, shape (n, 2).
        """
        threshold, touch = self.rig.p_hc0 * theta[:, 0], self.rig.z_p * theta[:, 1]
        return Setting(table["omega_m"].to_numpy(float), table["T_b0"].to_numpy(float), threshold, touch)

    def draw(self, source: np.random.Generator) -> Array:
        """Draw theta from the clipped normal distribution, eq. 3.12.

        Args:
            source: random generator.

        Returns:
            Scales of the spring threshold and the touch point, shape (2,).
        """
        means, deviations = np.reshape(list(self.alpha), (2, 2))
        low, high = norm.cdf((np.transpose(BOX) - means) / deviations)
        return np.asarray(means + deviations * norm.ppf(low + source.uniform(size=2) * (high - low)))


def _write_csv(path: Path, current: Array, true: dict[str, Array], source: np.random.Generator) -> None:
    columns = {"t": np.round(PERIOD * np.arange(len(current)), 4), "current": current}
    for name, values in true.items():
        noise = NOISE[name] * source.standard_normal(len(values))
        columns[name] = np.round(values + noise, DECIMALS[name])
    pa_csv.write_csv(pa.table(columns), path)
