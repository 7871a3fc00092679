"""Virtual cam-follower bench: an event-driven simulation with the logs of the real set-up.

The bench replaces the real machine: it shares no code with the models identified from its logs, and it has
effects that these models leave out (inductance, torque ripple, cam imbalance, side load on the guide,
wind-up, sensors).

In *contact* the shaft angle is the only mechanical degree of freedom and the contact force must stay
positive. In *flight* shaft and follower are independent and the gap must stay positive. The instant at which
the force or the gap becomes zero is bisected inside the integration step, so that no transition waits for a
sample. Dry friction is a steep tanh, so that one fixed-step scheme also holds at standstill; a stalled shaft
creeps (below 0.02 rad/s).
"""

from collections import namedtuple
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PPoly
from scipy.signal import lfilter, savgol_filter

from pipeline.rigs.profile import TURN, cam_spline, profile
from unmodelled.base.arrays import Array
from unmodelled.base.compiling import kept

State = tuple[float, float, float, float, float]  # angle, speed, current, y, velocity of y
_STICK = (0.005, 0.001)  # width of the friction tanh: shaft (rad/s), guide (m/s)
_SUBSTEPS = 8  # integration steps per sample: short enough for the stiff shaft friction at standstill
_PROGRESS = 0.1  # advance (rad) that shows a shaft is turning: a stalled one creeps much less
_TOUCH = 1e-12  # force (N) or gap (m) that counts as zero
_Plant = namedtuple(  # one experiment as the compiled code takes it; the moments are those of the cam plate
    "_Plant",
    "inertia mass gravity voltage torque_constant resistance inductance gear_friction gear_friction_drop "
    "gear_friction_speed ripple ripple_order sin_moment cos_moment guide_coulomb guide_viscous guide_side "
    "prime restitution merge_velocity",
)


@kept()
def _rates(contact: bool, s: State, spline: Array, p: _Plant) -> tuple[State, float]:
    """Time derivative of the state, and the contact force (vertical component, N)."""
    theta, omega, current, _, v = s
    friction = p.gear_friction - p.gear_friction_drop * np.exp(-abs(omega) / p.gear_friction_speed)
    weight = p.gravity * (p.sin_moment * np.cos(theta) - p.cos_moment * np.sin(theta))
    torque = p.torque_constant * current + p.ripple * np.sin(p.ripple_order * theta) - weight
    torque -= friction * np.tanh(omega / _STICK[0])
    surge = (p.voltage - p.resistance * current - p.torque_constant * omega) / p.inductance
    if not contact:
        drag = p.guide_coulomb * np.tanh(v / _STICK[1]) + p.guide_viscous * v
        return (omega, torque / p.inertia, surge, v, -p.gravity - drag / p.mass), 0.0
    h, slope, bend = profile(theta, spline)
    v = slope * omega
    sense = np.tanh(v / _STICK[1])
    jam = 1.0 / (1.0 - p.guide_side * sense * abs(slope) / (p.prime + h))
    load = p.mass * (bend * omega * omega + p.gravity) + p.guide_coulomb * sense + p.guide_viscous * v
    alpha = (torque - jam * load * slope) / (p.inertia + jam * p.mass * slope * slope)
    return (omega, alpha, surge, 0.0, 0.0), jam * (p.mass * slope * alpha + load)


@kept()
def _moved(s: State, r: State, dt: float) -> State:
    return s[0] + dt * r[0], s[1] + dt * r[1], s[2] + dt * r[2], s[3] + dt * r[3], s[4] + dt * r[4]


@kept()
def _step(contact: bool, dt: float, s: State, spline: Array, p: _Plant) -> State:
    """One Runge-Kutta 4 step within a phase; in contact the follower is placed on the cam."""
    a, _ = _rates(contact, s, spline, p)
    b, _ = _rates(contact, _moved(s, a, dt / 2), spline, p)
    c, _ = _rates(contact, _moved(s, b, dt / 2), spline, p)
    d, _ = _rates(contact, _moved(s, c, dt), spline, p)
    s = _moved(_moved(_moved(_moved(s, a, dt / 6), b, dt / 3), c, dt / 3), d, dt / 6)
    if contact:
        h, slope, _ = profile(s[0], spline)
        return s[0], s[1], s[2], h, slope * s[1]
    return s


@kept()
def _margin(contact: bool, s: State, spline: Array, p: _Plant) -> float:
    """Return the quantity that must stay positive: the force (N) in contact, the gap (m) in flight."""
    force: float = _rates(True, s, spline, p)[1]
    return force if contact else s[3] - profile(s[0], spline)[0]


@kept()
def _impact(restitution: float, s: State, spline: Array, p: _Plant) -> tuple[State, bool]:
    """State after the impulse on follower and shaft, and whether the follower stays on the cam."""
    theta, omega, current, _, v = s
    h, slope, _ = profile(theta, spline)
    approach = min(v - slope * omega, 0.0)
    if -approach < p.merge_velocity:
        restitution = 0.0
    impulse = -(1.0 + restitution) * approach / (1.0 / p.mass + slope * slope / p.inertia)
    s = (theta, omega - slope * impulse / p.inertia, current, h, v + impulse / p.mass)
    return s, restitution == 0.0 and _margin(True, s, spline, p) >= 0.0


@kept()
def _advance(contact: bool, dt: float, s: State, spline: Array, p: _Plant) -> tuple[State, bool]:
    """State and phase after dt seconds, through any lift-off and impact on the way."""
    while dt > 0.0:
        end = _step(contact, dt, s, spline, p)
        if _margin(contact, end, spline, p) >= 0.0:
            return end, contact
        if _margin(contact, s, spline, p) > _TOUCH:
            low, high = 0.0, dt
            while high - low > 1e-14:
                middle = 0.5 * (low + high)
                fine = _margin(contact, _step(contact, middle, s, spline, p), spline, p) >= 0.0
                low, high = (middle, high) if fine else (low, middle)
            s, dt = _step(contact, low, s, spline, p), dt - high
            s, contact = (s, False) if contact else _impact(p.restitution, s, spline, p)
        elif contact:
            contact = False
        else:  # a hop shorter than one step: the follower is back on the cam at its end
            s, contact = _impact(0.0, end, spline, p)
            break
    return s, contact


@kept()
def _trace(
    s: State, period: float, samples: int, stop: float, patience: float, spline: Array, p: _Plant
) -> Array:
    """Rows theta, omega, current, y, v, force, contact, h, slope; one per `period`, until the run ends."""
    out = np.empty((samples, 9))
    contact, best, since = _margin(True, s, spline, p) >= 0.0, s[0], 0
    for k in range(samples):
        for _ in range(_SUBSTEPS if k else 0):
            s, contact = _advance(contact, period / _SUBSTEPS, s, spline, p)
        h, slope, _ = profile(s[0], spline)
        force = _rates(contact, s, spline, p)[1]
        now = (s[0], s[1], s[2], s[3], s[4], force, 1.0 if contact else 0.0, h, slope)
        for i in range(len(now)):  # numba takes seconds to compile the assignment to a whole row
            out[k, i] = now[i]
        if s[0] > best + _PROGRESS:
            best, since = s[0], k
        if s[0] >= stop or (k - since) * period > patience:
            return out[: k + 1]
    return out


@dataclass(frozen=True)
class CamFollowerRig:
    """Constants of the bench at the cam shaft.

    The friction torque of the drive is gear_friction - gear_friction_drop exp(-|omega| /
    gear_friction_speed). The encoder is on the motor side of the drive shaft, and so measures the wind-up
    torque / shaft_stiffness too. Speed and acceleration are slopes of parabolas through `smoothing` samples.
    """

    torque_constant: float = 0.267  # including the gear ratio, N m/A
    resistance: float = 0.971  # resistance of the winding, ohm
    inductance: float = 3e-4  # inductance of the winding, H
    inertia: float = 0.0042  # of rotor and gear, kg m^2
    gear_friction: float = 0.79  # at high speed, N m
    gear_friction_drop: float = 0.2  # share of it that is lacking at standstill, N m
    gear_friction_speed: float = 5.0  # speed over which the friction torque rises, rad/s
    friction_scatter: float = 0.03  # standard deviation between assemblies, N m
    ripple: float = 0.01  # amplitude, N m
    ripple_order: float = 8.5  # periods per turn
    gravity: float = 9.81  # m/s^2
    guide_coulomb: float = 0.5  # N
    guide_viscous: float = 12.0  # N s/m
    guide_side: float = 0.2  # share of the side load
    restitution: float = 0.4
    merge_velocity: float = 0.005  # speed below which an impact has no rebound, m/s
    base_radius: float = 0.02  # of the cams, m
    roller_radius: float = 0.008  # m
    rounding: float = 0.01  # smoothing width of the pitch curve, rad
    plate_density: float = 13.6  # areal density of a cam, kg/m^2; solid PLA
    shaft_stiffness: float = 50.0  # N m/rad
    encoder_count: float = TURN / 40_000  # rad
    linear_count: float = 5e-7  # m; a 2 um grating read four times
    smoothing: int = 77  # samples in the parabola of the slopes
    form_error: float = 1.2e-3  # root mean square, as a share of H
    vibration: float = 1.5e-5  # of the follower's measurement at high speed, root mean square, m
    period: float = 4.9972e-4  # s
    jitter: float = 1e-6  # standard deviation of the sampling instants, s
    start_mean: float = -0.06  # angle, rad
    start_scatter: float = 0.09  # its standard deviation, rad
    stop_angle: float = 4 * TURN + 0.03  # rad
    patience: float = 1.5  # time without progress after which a run ends, s

    def simulate(
        self, H: float, beta: float, m: float, V: float, theta: float = 0.0, omega: float = 0.0,
        friction_offset: float = 0.0, duration: float = 15.0,
    ) -> dict[str, Array]:  # fmt: skip
        """Simulate a run without noise, starting with the follower on the cam.

        Args:
            H: stroke, m.
            beta: angle of the rise, rad.
            m: mass of the follower, kg.
            V: motor voltage, V.
            theta: angle at the start, rad; default 0.
            omega: speed at the start, rad/s; default 0.
            friction_offset: additional friction torque of the assembly, N m; default 0.
            duration: longest duration, s; default 15.

        Returns:
            Signals by name, each of shape (samples,): t (s), theta (rad, unwrapped), omega (rad/s), current
            (A), y (m), v (m/s), force (N), contact (0 or 1), h (m) and slope (m/rad) of the pitch curve, and
            energy (J), kinetic plus potential, of shaft, cam and follower.
        """
        spline, moments = cam_spline(H, beta, self.base_radius, self.roller_radius, self.rounding)
        polar, sine, cosine = (self.plate_density * moment for moment in moments)
        own = {
            "mass": m, "voltage": V, "inertia": self.inertia + polar, "sin_moment": sine,
            "cos_moment": cosine, "prime": self.base_radius + self.roller_radius,
            "gear_friction": self.gear_friction + friction_offset,
        }  # fmt: skip
        plant = _Plant(*(float(own[name] if name in own else getattr(self, name)) for name in _Plant._fields))
        h, slope, _ = profile(float(theta), spline)
        start, samples = (float(theta), float(omega), 0.0, h, slope * omega), int(duration / self.period)
        rows = _trace(start, self.period, samples, self.stop_angle, self.patience, spline, plant)
        names = ["theta", "omega", "current", "y", "v", "force", "contact", "h", "slope"]
        run: dict[str, Array] = dict(zip(names, rows.T, strict=True))
        height = m * run["y"] + cosine * np.cos(run["theta"]) + sine * np.sin(run["theta"])
        motion = 0.5 * (plant.inertia * run["omega"] ** 2 + m * run["v"] ** 2)
        return run | {"t": self.period * np.arange(len(rows)), "energy": motion + self.gravity * height}

    def run(self, H: float, beta: float, m: float, V: float, seed: int) -> dict[str, Array]:
        """Simulate one experiment, and return its log.

        Each source of scatter is seeded with `seed` and the factors that it belongs to (cam, assembly,
        experiment), so that a log does not depend on the other experiments.

        Takes H in m, beta in rad, m in kg, V in V; gives (samples,).
        """
        cam, assembly, own = (
            np.random.default_rng([seed, *(round(1e6 * value) for value in factors)])
            for factors in ((H, beta), (H, beta, m), (H, beta, m, V))
        )
        begin = self.start_mean + self.start_scatter * float(np.clip(own.standard_normal(), -3.0, 3.0))
        offset = self.friction_scatter * float(assembly.standard_normal())
        true = self.simulate(H, beta, m, V, begin, friction_offset=offset)
        n, speed = len(true["t"]), np.abs(true["omega"])
        delay = self.jitter * np.append(0.0, own.standard_normal(n - 1))
        angle = true["theta"] + true["omega"] * delay + true["force"] * true["slope"] / self.shaft_stiffness
        angle = self.encoder_count * np.round(angle / self.encoder_count)
        omega = savgol_filter(angle, self.smoothing, 2, deriv=1, delta=self.period)
        alpha = savgol_filter(omega, self.smoothing, 2, deriv=1, delta=self.period)
        waves = np.append(cam.standard_normal((6, 2)) @ [1.0, 1.0j] / np.sqrt(6), 0.0)  # six harmonics
        form = self.form_error * H * np.polyval(waves, np.exp(1j * true["theta"])).real
        pole = 0.96 * np.exp(2j * np.pi * 80.0 * self.period)  # the frame rings near 80 Hz
        noise = lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], own.standard_normal(n))
        shake = self.vibration * speed / (speed + 6.0) * noise / np.std(noise)
        y = self.linear_count * np.round((true["y"] + form + shake) / self.linear_count)
        spline, _ = cam_spline(H, beta, self.base_radius, self.roller_radius, self.rounding)
        angle = np.mod(angle, TURN)
        h = PPoly(spline, np.linspace(0.0, TURN, spline.shape[1] + 1))(angle)
        log = (true["t"] + delay, angle, omega, alpha, y, h, y - h)
        return dict(zip(["t", "theta", "omega", "alpha", "y", "h", "eps"], log, strict=True))
