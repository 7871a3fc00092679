"""Geometry of a disc cam with a cycloidal law and a translating roller follower (sections 5.2.1, 5.7)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array

TURN = 2.0 * np.pi


def cycloid(phi: Array, H: float, beta: float) -> tuple[Array, Array, Array, Array]:
    """Return the cycloidal displacement without dwell, eq. 5.1, and three derivatives by phi (n,)."""
    phi = np.mod(phi, TURN)
    rise = phi <= beta
    span = np.where(rise, beta, TURN - beta)
    s = np.where(rise, phi, TURN - phi)
    sign = np.where(rise, 1.0, -1.0)  # d s / d phi
    k = TURN / span
    return (
        H * s / span - H / TURN * np.sin(k * s),
        sign * H / span * (1.0 - np.cos(k * s)),
        H / span * k * np.sin(k * s),
        sign * H / span * k**2 * np.cos(k * s),
    )


@dataclass(frozen=True)
class Cam:
    """Geometry of one cam with its roller follower."""

    H: float  # stroke, m
    beta: float  # angle of the rise, rad
    base_radius: float = 0.02  # base radius r_b, m
    roller_radius: float = 0.008  # radius r_f of the roller, m; zero for a knife-edge follower

    @property
    def prime_radius(self) -> float:
        """Prime radius r_p = r_b + r_f: smallest radius of the pitch curve, m."""
        return self.base_radius + self.roller_radius

    def curvature_radius(self, phi: Array) -> Array:
        """Return the radius of curvature of the cam's perimeter, eq. 5.27, at phi (any shape) in rad."""
        h, d, dd, _ = cycloid(phi, self.H, self.beta)
        r = self.base_radius + h
        return (r**2 + d**2) ** 1.5 / (r**2 + 2.0 * d**2 - dd * r)

    def _pitch(self, phi: Array) -> Array:
        """The roller's centre in polar coordinates for a contact at the perimeter's angle `phi`, eq. 5.25."""
        h, d, dd, ddd = cycloid(phi, self.H, self.beta)
        r, f = self.base_radius + h, self.roller_radius
        # the outward normal is (r, -r') / q in the polar frame that turns with phi
        q = np.hypot(r, d)
        dq = (r * d + d * dd) / q
        ddq = (d * d + r * dd + dd * dd + d * ddd - dq * dq) / q
        a, c = r + f * r / q, -f * d / q
        da = d + f * (d / q - r * dq / q**2)
        dc = -f * (dd / q - d * dq / q**2)
        dda = dd + f * (dd / q - 2.0 * d * dq / q**2 - r * ddq / q**2 + 2.0 * r * dq**2 / q**3)
        ddc = -f * (ddd / q - 2.0 * dd * dq / q**2 - d * ddq / q**2 + 2.0 * d * dq**2 / q**3)
        R = np.hypot(a, c)
        psi = phi + np.arctan2(c, a)
        dR = (a * da + c * dc) / R
        ddR = (da * da + a * dda + dc * dc + c * ddc - dR * dR) / R
        w = a * dc - c * da
        dpsi = 1.0 + w / R**2
        ddpsi = (a * ddc - c * dda) / R**2 - 2.0 * w * dR / R**3
        slope = dR / dpsi
        return np.stack([psi, R - self.prime_radius, slope, (ddR - slope * ddpsi) / dpsi**2, dpsi])

    @property
    def undercut(self) -> bool:
        """Whether the roller is too large for a hollow of the cam, so that the pitch curve crosses itself."""
        phi = np.linspace(0.0, TURN, 20_001)
        return bool(np.any(self._pitch(phi)[4] <= 0.0))

    def pitch_curve(self, n: int = 3600) -> Array:
        """Tabulate the displacement of the follower over one turn of the cam, (3, n).

        Where the cam is undercut, the roller rests on the outer branch of the pitch curve.
        """
        phi = np.linspace(-np.pi, 3.0 * np.pi, 16 * n + 1)
        psi, *values, dpsi = self._pitch(phi)
        grid = np.arange(n) * TURN / n
        pieces = np.split(np.arange(len(phi)), np.flatnonzero(np.diff(np.sign(dpsi))) + 1)
        branches = np.full((len(pieces), 3, n), -np.inf)
        for branch, piece in zip(branches, pieces, strict=True):
            # on the way back inside an undercut the angle falls
            order = piece if psi[piece[0]] <= psi[piece[-1]] else piece[::-1]
            for out, value in zip(branch, values, strict=True):
                out[:] = np.interp(grid, psi[order], value[order], left=-np.inf, right=-np.inf)
        outer = np.argmax(branches[:, 0], axis=0)
        return np.asarray(branches[outer, :, np.arange(n)].T)

    def theoretical_curve(self, n: int = 3600) -> Array:
        """Tabulate the displacement of a knife-edge follower over one turn, eq. 6.10. Gives (3, n)."""
        return np.stack(cycloid(np.arange(n) * TURN / n, self.H, self.beta)[:3])

    def pressure_angle(self, n: int = 3600) -> Array:
        """Tabulate the pressure angle over one turn, eq. 5.28. Gives (n,) in rad."""
        h, d, _ = self.pitch_curve(n)
        return np.asarray(np.arctan(d / (self.prime_radius + h)))

    def extremes(self) -> tuple[float, float]:
        """Return the smallest radius of curvature, in roller radii, and the largest pressure angle, rad."""
        curvature = np.abs(self.curvature_radius(np.linspace(0.0, TURN, 20_001))).min()
        return float(curvature / self.roller_radius), float(self.pressure_angle().max())

    @cached_property
    def area_moments(self) -> tuple[float, float, float]:
        """Polar second moment (m^4) and first moments along x and y (m^3) of the cam's area.

        Multiplied by an areal density, these moments give the inertia and the imbalance of the cam. At theta
        = 0 the angle phi = 0 points upwards (y), eq. 5.23.
        """
        phi = np.arange(7200) * TURN / 7200
        r = self.base_radius + cycloid(phi, self.H, self.beta)[0]
        return (
            float(TURN * np.mean(r**4) / 4.0),
            float(TURN * np.mean(r**3 * np.sin(phi)) / 3.0),
            float(TURN * np.mean(r**3 * np.cos(phi)) / 3.0),
        )
