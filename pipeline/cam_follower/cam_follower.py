"""Symbolic equations of the cam-follower mechanism (sections 5.3 and 6.2.1), the source of all functions.

`pipeline.cam_follower.kernels` generates every function that simulates or differentiates the mechanism from
these expressions. The bench of the dissertation has no return spring (k = 0).
"""

from dataclasses import dataclass

import sympy as sp

from pipeline.cam_follower.cam import Cam

# state, its derivative, and what the cam makes of the angle
theta, omega, alpha = sp.symbols("theta omega alpha", real=True)
dh, d2h = sp.symbols("dh d2h", real=True)
# operating point
V, m = sp.symbols("V m", positive=True)
# constants of the bench
g, b0, b1 = sp.symbols("g b_0 b_1", positive=True)
J, J_c, S_x, S_y = sp.symbols("J J_c S_x S_y", real=True)
# effort of the drive: motor, gearbox, bearings - or whatever stands in for them
T_d = sp.symbols("T_d", real=True)
# motor
k_V, k_omega, T_c, T_s, omega_s = sp.symbols("k_V k_omega T_c T_s omega_s", real=True)

CONSTANTS = (g, b0, b1)
CAM_CONSTANTS = (J_c, S_x, S_y)
MOTOR_PARAMETERS = (J, k_V, k_omega, T_c, T_s, omega_s)

#: Widths of the smoothed signs, small against every speed that matters: m/s and rad/s.
FOLLOWER_CREEP, SHAFT_CREEP = 0.01, 0.2


def guide_friction(speed: sp.Expr, sign: sp.Expr) -> sp.Expr:
    """Return Coulomb and viscous friction F_b of the linear guide, N, eq. 6.2. Takes speed in m/s."""
    return b0 * sign + b1 * speed


follower_speed = dh * omega

#: Interface force as if contact never broke, N, eq. 6.4.
INTERFACE_FORCE = m * (d2h * omega**2 + dh * alpha + g) + guide_friction(
    follower_speed, sp.sign(follower_speed)
)

#: Angle-dependent inertia, kg m^2, and equivalent load, N m, eq. 6.9.
INERTIA = J + m * dh**2
LOAD = dh * (m * d2h * omega**2 + m * g + guide_friction(follower_speed, sp.sign(follower_speed)))

#: Acceleration of the shaft under the drive's effort, rad/s^2, eq. 6.8 in contact.
ACCELERATION = (T_d - LOAD) / INERTIA

#: Torque of a DC motor and its gearbox at the cam shaft, N m. Resistance and back-EMF give k_V and k_omega;
#: the gearbox's lubricated friction starts at T_c - T_s and saturates towards T_c over omega_s.
MOTOR_TORQUE = (
    k_V * V - k_omega * omega - sp.tanh(omega / SHAFT_CREEP) * (T_c - T_s * sp.exp(-sp.Abs(omega) / omega_s))
)

#: The complete drivetrain, rad/s^2: the cam's own inertia and weight added, signs smoothed so that a
#: free-run simulation is differentiable by its parameters.
MOTOR_ACCELERATION = (
    T_d
    + MOTOR_TORQUE
    - LOAD.subs(sp.sign(follower_speed), sp.tanh(follower_speed / FOLLOWER_CREEP))
    - (S_x * sp.cos(theta) - S_y * sp.sin(theta))
) / (INERTIA + J_c)


@dataclass(frozen=True)
class CamFollower:
    """Constants of the bench that every model may use.

    Attributes:
        base_radius: base radius r_b of the cams, m; default 0.02.
        roller_radius: radius r_f of the roller, m; default 0.008.
        guide_coulomb: Coulomb friction b_0 of the guide, N; default 0.5.
        guide_viscous: viscous friction b_1 of the guide, N s/m (section 5.3); default 12.
        gravity: gravitational acceleration, m/s^2; default 9.81.
        cam_areal_density: areal density of a cam, kg/m^2; default 13.64, a printed PLA plate (1240 kg/m^3) of
            11 mm, the length of the line contact.
        jump_share: share of the stroke; a run with a larger mean detachment per revolution is a jump (section
            5.2.2); default 0.013.
        stall_turns: number of turns; a run with fewer turns is a stall; default 1.5.
    """

    base_radius: float = 0.02
    roller_radius: float = 0.008
    guide_coulomb: float = 0.5
    guide_viscous: float = 12.0
    gravity: float = 9.81
    cam_areal_density: float = 13.64
    jump_share: float = 0.013
    stall_turns: float = 1.5

    def cam(self, H: float, beta: float) -> Cam:
        """Return a cam of this bench.

        Args:
            H: stroke, m.
            beta: angle of the rise, rad.
        """
        return Cam(H, beta, self.base_radius, self.roller_radius)

    @property
    def constants(self) -> tuple[float, float, float]:
        """Values of the symbols `CONSTANTS`."""
        return self.gravity, self.guide_coulomb, self.guide_viscous

    def cam_constants(self, cam: Cam) -> tuple[float, float, float]:
        """Return the values of the symbols `CAM_CONSTANTS`.

        Args:
            cam: geometry of the cam.

        Returns:
            Inertia J_c (kg m^2) and imbalance S_x, S_y (N m) of the cam plate.
        """
        polar, x, y = cam.area_moments
        weight = self.cam_areal_density * self.gravity
        return self.cam_areal_density * polar, weight * x, weight * y
