"""Newton-Euler equations of the slider-crank (appendix 4.6, eq. 4.11), solved for the acceleration.

`systems/slider_crank.yaml` states the crank's acceleration in the compact form of Lagrange's equation: an
inertia J(theta) with its derivative, and no force in any joint. Here it comes from the eight balances of
eq. 4.11, solved for the acceleration and the seven joint forces at once. Models are generated from the
file; this is what the file is checked by.

Signs: theta counts counter-clockwise from the slider's line, x along that line away from the shaft, y
upwards. The rod's angle phi, sin(phi) = l1/l2 sin(theta), counts clockwise, and r_x = r cos(phi), r_y = r
sin(phi) project the rod's half length. F_b acts on the crank, F_c on the rod, F on the slider towards the
shaft. With these signs every row of eq. 4.11 holds as printed. What does not is J_2 = l2 m2^2 / 3, which is
no inertia: a slender rod has m2 l2^2 / 12 about its centre of mass.
"""

from __future__ import annotations

import sympy as sp

from unmodelled.systems.model import symbol

theta, omega, T, F = (symbol(name) for name in ("theta", "omega", "T", "F"))
m1, m2, m3, l1, l2, J1, B_m, g = (symbol(n) for n in ("m1", "m2", "m3", "l1", "l2", "J1", "B_m", "g"))

_alpha = symbol("alpha")
_forces = tuple(symbol(name) for name in ("F_ax", "F_ay", "F_bx", "F_by", "F_cx", "F_cy", "F_N"))
# projections of crank and rod, and second time derivatives
_l1x, _l1y, _r2x, _r2y = (symbol(name) for name in ("l_1x", "l_1y", "r_2x", "r_2y"))
_x1, _y1, _x2, _y2, _phi, _v = (symbol(name) for name in ("ddx1", "ddy1", "ddx2", "ddy2", "ddphi", "dv"))


def newton_euler() -> sp.Expr:
    """Return the acceleration of the crank, rad/s^2, in the symbols of `systems/slider_crank.yaml`.

    Source: eq. 4.11 with the geometry of Fig. 4.2.
    """
    kinematics = _kinematics()
    equations = [row.xreplace(kinematics) for row in _balances()]
    matrix, right = sp.linear_eq_to_matrix(equations, _alpha, *_forces)
    # as symbols, the entries cancel into one quotient that is finite wherever the determinant is not zero
    entries = {entry: sp.Dummy() for entry in (*matrix, *right) if not entry.is_number}
    unknowns = sp.Matrix([_alpha, *_forces])
    rows = matrix.xreplace(entries) * unknowns - right.xreplace(entries)
    solution = sp.solve(list(rows), list(unknowns), dict=True)[0]
    return solution[_alpha].xreplace({name: entry for entry, name in entries.items()})


def _balances() -> list[sp.Expr]:
    """Left minus right side of every row of eq. 4.11, in its order."""
    F_ax, F_ay, F_bx, F_by, F_cx, F_cy, F_N = _forces
    J2 = m2 * l2**2 / 12
    return [
        m1 * _x1 - (F_ax + F_bx),
        m1 * _y1 - (-m1 * g + F_ay + F_by),
        J1 * _alpha - (T - B_m * omega - _l1x / 2 * m1 * g + _l1x * F_by - _l1y * F_bx),
        m2 * _x2 - (-F_bx + F_cx),
        m2 * _y2 - (-F_by + F_cy - m2 * g),
        J2 * _phi - (-_r2x * F_by - _r2y * F_bx - _r2x * F_cy - _r2y * F_cx),
        -F_cy - m3 * g + F_N,
        m3 * _v - (-F_cx - F),
    ]


def _kinematics() -> dict[sp.Expr, sp.Expr]:
    """Projections, and second time derivatives of centres of mass and of the rod's angle."""
    phi = sp.asin(l1 / l2 * sp.sin(theta))
    crank, rod = (l1 * sp.cos(theta), l1 * sp.sin(theta)), (l2 * sp.cos(phi), l2 * sp.sin(phi))
    coordinates = {
        _x1: crank[0] / 2,
        _y1: crank[1] / 2,
        _x2: crank[0] + rod[0] / 2,
        _y2: crank[1] - rod[1] / 2,
        _phi: phi,
        _v: crank[0] + rod[0],
    }
    rates = {
        name: sp.diff(q, theta) * _alpha + sp.diff(q, theta, 2) * omega**2 for name, q in coordinates.items()
    }
    return {_l1x: crank[0], _l1y: crank[1], _r2x: rod[0] / 2, _r2y: rod[1] / 2, **rates}
