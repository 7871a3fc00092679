"""Virtual wet clutch between converter and flywheel (appendix 3.8), many engagements side by side.

The bench of the dissertation was never published; all constants are invented but plausible. The bench
replaces the real machine: it shares no code with the models identified from its logs.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from unmodelled.base.arrays import Array, Mask

_START = 0.999  # speed of the idle input shaft over the motor's


@dataclass(frozen=True)
class Setting:
    """Settings of n engagements."""

    omega_m: Array  # (n,), speed of the motor, rad/s
    brake: Array  # (n,), N m
    threshold: Array  # (n,), threshold pressure of the return spring, bar
    touch: Array  # (n,), touch point of the plates, mm

    def only(self, i: int) -> "Setting":
        """Return the setting of one engagement, with arrays of shape (1,)."""
        one = slice(i, i + 1)
        return Setting(self.omega_m[one], self.brake[one], self.threshold[one], self.touch[one])


@dataclass(frozen=True)
class ClutchRig:
    """Constants of the bench.

    Valve and chamber follow eq. 3.16, the piston eq. 3.17. The torque ratio of the converter is max(1, ratio
    - slope nu) and its capacity C0 (1 - nu^4), with nu = omega_1 / omega_m.
    """

    wn: float = 30.0  # natural frequency of the valve, rad/s
    zeta: float = 0.9  # damping ratio of the valve
    Kp: float = 20.0  # gain of the valve, bar/A
    p_rest: float = 0.2  # pressure without current, bar
    b2: float = 40.0  # gain of the current's slope, bar/(A s)
    Kz: float = 1.0  # gain of the piston, mm/bar
    tau_z: float = 0.25  # time constant of the piston, s
    c2: float = 0.0  # gain of the pressure's slope, mm/bar
    p_hc0: float = 2.05  # threshold pressure of the return spring, bar
    z_M: float = 2.0  # stroke of the piston, mm
    z_p: float = 1.5  # touch point of the plates, mm
    w_delta: float = 0.1  # half width of the transition from film to plates, mm
    gamma: float = 0.04  # drag of the oil film, N m mm s/rad
    gap: float = 0.05  # smallest gap of the oil film, mm
    alpha: float = 22.0  # friction torque of the plates per pressure, N m/bar
    R: float = 2.5  # gear ratio between the shafts
    J1: float = 0.25  # inertia of the input shaft, kg m^2
    J2: float = 2.5  # inertia of the output shaft, kg m^2
    b: float = 0.05  # viscous friction of the output shaft, N m s/rad
    ratio: float = 2.0  # torque ratio of the converter at standstill
    slope: float = 1.15  # slope of the torque ratio over the speed ratio
    C0: float = 0.00487  # capacity of the converter at standstill, N m s^2/rad^2

    def converter(self, omega_1: Array, omega_m: Array) -> Array:
        """Return the torque T_1 (n,), N m, of the converter on the input shaft, at speeds in rad/s."""
        nu = omega_1 / omega_m
        return omega_m**2 * np.maximum(1.0, self.ratio - self.slope * nu) * self.C0 * (1.0 - nu**4)

    def clutch(self, p: Array, z: Array, slip: Array, touch: Array) -> Array:
        """Return the torque T_c (n,), N m, of the clutch that slips with `slip` rad/s."""
        z = np.clip(z, 0.0, self.z_M)
        x = np.clip(0.5 + (z - touch) / (2.0 * self.w_delta), 0.0, 1.0)
        contact = x * x * (3.0 - 2.0 * x)
        plates = np.maximum(0.0, (z - touch) / (self.z_M - touch)) * p
        film = self.gamma / np.maximum(self.z_M - z, self.gap) * slip
        return contact * self.alpha * plates + (1.0 - contact) * film

    def rates(self, x: Array, u: Array, du: Array, setting: Setting, locked: Mask) -> Array:
        """Return the time derivatives of the states x (5, n) at u (n,), A, with slope du, A/s."""
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

    def step(self, x: Array, u: Array, du: Array, h: float, setting: Setting, locked: Mask) -> Array:
        """Integrate x (5, n) over a Runge-Kutta step of h s with a linear course of the current u (n,), A."""
        k1 = self.rates(x, u, du, setting, locked)
        k2 = self.rates(x + 0.5 * h * k1, u + 0.5 * h * du, du, setting, locked)
        k3 = self.rates(x + 0.5 * h * k2, u + 0.5 * h * du, du, setting, locked)
        k4 = self.rates(x + h * k3, u + h * du, du, setting, locked)
        after = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        after[4] = np.maximum(after[4], 0.0)
        return after

    def simulate(self, current: Array, period: float, setting: Setting) -> dict[str, Array]:
        """Simulate engagements without noise, from the steady state without current.

        Args:
            current: current at every sample, A, zero at the first sample, linear between samples, shape (N,
                n).
            period: sampling period, s.
            setting: settings of the n engagements.

        Returns:
            Signals by name, each of shape (N, n): p (bar), its slope dp (bar/s), z (mm, limited to the
            stroke), omega_1 and omega_2 (rad/s); and shift of shape (n,): time at which the shafts first turn
            together, s, nan if never.
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
        """Return the time, s, within a step of `h` s at which speeds are equal, and the state at its end."""
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
