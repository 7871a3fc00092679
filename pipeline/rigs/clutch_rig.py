"""The virtual wet clutch between converter and flywheel (appendix 3.8), many engagements side by side.

The bench of the dissertation was never published; all constants here are invented but plausible. It plays the
part of reality: it shares no code with the models identified from its logs.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
_START = 0.999  # speed of the idle input shaft over the motor's


@dataclass(frozen=True)
class Setting:
    """What differs between n engagements, each (n,): motor speed `omega_m` (rad/s), torque of the `brake`
    (N m), `threshold` of the return spring (bar) and `touch` point of the plates (mm).
    """

    omega_m: Array
    brake: Array
    threshold: Array
    touch: Array

    def only(self, i: int) -> "Setting":
        """Return the setting of engagement `i` alone."""
        one = slice(i, i + 1)
        return Setting(self.omega_m[one], self.brake[one], self.threshold[one], self.touch[one])


@dataclass(frozen=True)
class ClutchRig:
    """All constants of the bench, in bar, mm, A, s, rad, N m and kg m^2.

    Valve and chamber (3.16): natural frequency `wn`, damping ratio `zeta`, gain `Kp`, pressure `p_rest`
    without current, `b2`. Piston (3.17): `Kz`, `tau_z`, `c2`, threshold `p_hc0` of the spring, stroke `z_M`.
    Plates: touch point `z_p`, half width `w_delta` of the transition, drag `gamma` of the oil film with its
    least `gap`, friction `alpha`. Shafts: `R`, `J1`, `J2`, viscous brake `b`. Converter: torque ratio
    max(1, `ratio` - `slope` nu), capacity `C0` (1 - nu^4).
    """

    wn: float = 30.0
    zeta: float = 0.9
    Kp: float = 20.0
    p_rest: float = 0.2
    b2: float = 40.0
    Kz: float = 1.0
    tau_z: float = 0.25
    c2: float = 0.0
    p_hc0: float = 2.05
    z_M: float = 2.0
    z_p: float = 1.5
    w_delta: float = 0.1
    gamma: float = 0.04
    gap: float = 0.05
    alpha: float = 22.0
    R: float = 2.5
    J1: float = 0.25
    J2: float = 2.5
    b: float = 0.05
    ratio: float = 2.0
    slope: float = 1.15
    C0: float = 0.00487

    def converter(self, omega_1: Array, omega_m: Array) -> Array:
        """Return the torque T_1 of the converter on the input shaft, N m."""
        nu = omega_1 / omega_m
        return omega_m**2 * np.maximum(1.0, self.ratio - self.slope * nu) * self.C0 * (1.0 - nu**4)

    def clutch(self, p: Array, z: Array, slip: Array, touch: Array) -> Array:
        """Return the torque T_c of the slipping clutch, N m, at pressure `p` (bar) and piston position `z`
        (mm).
        """
        z = np.clip(z, 0.0, self.z_M)
        x = np.clip(0.5 + (z - touch) / (2.0 * self.w_delta), 0.0, 1.0)
        contact = x * x * (3.0 - 2.0 * x)
        plates = np.maximum(0.0, (z - touch) / (self.z_M - touch)) * p
        film = self.gamma / np.maximum(self.z_M - z, self.gap) * slip
        return contact * self.alpha * plates + (1.0 - contact) * film

    def rates(self, x: Array, u: Array, du: Array, setting: Setting, locked: Flags) -> Array:
        """Return the time derivatives of `x` (5, n): p, p', z~, omega_1, omega_2; at current `u` (A) of slope
        `du`.
        """
        p, dp, z, omega_1, omega_2 = x
        ddp = self.wn**2 * (self.Kp * u + self.p_rest - p) - 2.0 * self.zeta * self.wn * dp + self.b2 * du
        dz = (self.Kz * (p - setting.threshold) - z) / self.tau_z + self.c2 * dp
        driving = self.converter(omega_1, setting.omega_m)
        braking = setting.brake + self.b * omega_2
        passed = self.clutch(p, z, omega_1 - self.R * omega_2, setting.touch)
        load = (self.R * passed - braking) / self.J2
        load = np.where(omega_2 > 0.0, load, np.maximum(load, 0.0))  # a brake holds, it does not turn back
        together = (driving - braking / self.R) / (self.J1 + self.J2 / self.R**2)
        d_omega_1 = np.where(locked, together, (driving - passed) / self.J1)
        return np.array([dp, ddp, dz, d_omega_1, np.where(locked, together / self.R, load)])

    def step(self, x: Array, u: Array, du: Array, h: float, setting: Setting, locked: Flags) -> Array:
        """Return the state (5, n) after `h` s by the method of Runge and Kutta; the current runs along a
        line.
        """
        k1 = self.rates(x, u, du, setting, locked)
        k2 = self.rates(x + 0.5 * h * k1, u + 0.5 * h * du, du, setting, locked)
        k3 = self.rates(x + 0.5 * h * k2, u + 0.5 * h * du, du, setting, locked)
        k4 = self.rates(x + h * k3, u + h * du, du, setting, locked)
        after = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        after[4] = np.maximum(after[4], 0.0)
        return after

    def simulate(self, current: Array, period: float, setting: Setting) -> dict[str, Array]:
        """Simulate noise-free engagements from the steady state without current.

        Args:
            current: A, every `period` s, straight lines in between, shape (N, n); starts at zero.

        Returns:
            p (bar), its slope dp (bar/s), z, shape (mm, truncated), omega_1 and omega_2 (rad/s), each shape
            (N, n), and shift, shape (n,): when the shafts first turn together, s, nan if never.
        """
        n = current.shape[1]
        rest = np.full(n, self.p_rest)
        piston = self.Kz * (self.p_rest - setting.threshold)
        x = np.array([rest, np.zeros(n), piston, _START * setting.omega_m, np.zeros(n)])
        path = np.empty((len(current), 5, n))
        path[0] = x
        shift, slopes = np.full(n, np.nan), np.diff(current, axis=0) / period
        for k, (u, du) in enumerate(zip(current, slopes, strict=False)):
            locked = np.isfinite(shift)
            before, x = x, self.step(x, u, du, period, setting, locked)
            for i in np.flatnonzero(~locked & (x[3] <= self.R * x[4])).tolist():
                one = slice(i, i + 1)
                moment, x[:, one] = self._lock(before[:, one], u[one], du[one], period, setting.only(i))
                shift[i] = k * period + moment
            path[k + 1] = x
        run = dict(zip(("p", "dp", "z", "omega_1", "omega_2"), path.transpose(1, 0, 2), strict=True))
        return run | {"z": np.clip(run["z"], 0.0, self.z_M), "shift": shift}

    def _lock(self, x: Array, u: Array, du: Array, h: float, setting: Setting) -> tuple[float, Array]:
        """When within a step of `h` the shafts meet (s after its start), and the state at its end."""
        slipping, turning = np.array([False]), np.array([True])

        def slip(after: float) -> float:
            at = self.step(x, u, du, after, setting, slipping)
            return float(at[3, 0] - self.R * at[4, 0])

        moment = float(brentq(slip, 0.0, h))
        met = self.step(x, u, du, moment, setting, slipping)
        met[4] = met[3] / self.R
        return moment, self.step(met, u + moment * du, du, h - moment, setting, turning)


MILD = ClutchRig()
SHARP = ClutchRig(Kz=1.2, c2=0.1, p_hc0=2.19, z_p=1.6, w_delta=0.2, alpha=18.0)
