"""The slider-crank from three sides: Newton-Euler, Lagrange, and the system file; energy and power."""

from functools import cache

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.machines.known import built_in, values_of
from unmodelled.systems.model import symbol

SYSTEM = built_in("slider_crank")
theta, omega, T, F = (symbol(name) for name in ("theta", "omega", "T", "F"))
m1, m2, m3, l1, l2, J1, B_m, g = (symbol(n) for n in ("m1", "m2", "m3", "l1", "l2", "J1", "B_m", "g"))

_alpha = symbol("alpha")
_forces = tuple(symbol(name) for name in ("F_ax", "F_ay", "F_bx", "F_by", "F_cx", "F_cy", "F_N"))
# projections of crank and rod, and second time derivatives
_l1x, _l1y, _r2x, _r2y = (symbol(name) for name in ("l_1x", "l_1y", "r_2x", "r_2y"))
_x1, _y1, _x2, _y2, _phi, _v = (symbol(name) for name in ("ddx1", "ddy1", "ddx2", "ddy2", "ddphi", "dv"))


def newton_euler() -> sp.Expr:
    """Return the acceleration of the crank, rad/s^2, in the symbols of `systems/slider_crank.yaml`.

    The file states it in the compact form of Lagrange's equation: an inertia J(theta) with its derivative,
    and no force in any joint. Here it comes from the eight balances of eq. 4.11 for the mechanism
    of Fig. 4.2, solved for the acceleration and the seven joint forces at once.

    Signs: theta counts counter-clockwise from the slider's line, x along that line away from the shaft, y
    upwards. The rod's angle phi, sin(phi) = l1/l2 sin(theta), counts clockwise, and r_x = r cos(phi), r_y = r
    sin(phi) project the rod's half length. F_b acts on the crank, F_c on the rod, F on the slider towards the
    shaft. With these signs every row of eq. 4.11 holds as printed. What does not is J_2 = l2 m2^2 / 3, which
    is no inertia: a slender rod has m2 l2^2 / 12 about its centre of mass.
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
    found = {_l1x: crank[0], _l1y: crank[1], _r2x: rod[0] / 2, _r2y: rod[1] / 2}
    for name, q in coordinates.items():
        found[name] = sp.diff(q, theta) * _alpha + sp.diff(q, theta, 2) * omega**2
    return found


#: Where the slider is, from the shaft.
SLIDER = l1 * sp.cos(theta) + sp.sqrt(l2**2 - l1**2 * sp.sin(theta) ** 2)


def energies() -> tuple[sp.Expr, sp.Expr]:
    """Kinetic and potential energy from the positions of the joints alone."""
    pin = sp.Matrix([l1 * sp.cos(theta), l1 * sp.sin(theta)])
    end = sp.Matrix([SLIDER, 0])
    speed = {name: q.diff(theta) * omega for name, q in {"pin": pin, "end": end}.items()}
    # a slender rod whose ends move with a and b has the kinetic energy m (a.a + a.b + b.b) / 6
    rod = speed["pin"].dot(speed["pin"]) + speed["pin"].dot(speed["end"]) + speed["end"].dot(speed["end"])
    kinetic = J1 * omega**2 / 2 + m2 * rod / 6 + m3 * speed["end"].dot(speed["end"]) / 2
    return kinetic, g * (m1 + m2) * pin[1] / 2


def lagrange() -> sp.Expr:
    """d/dt dL/domega - dL/dtheta = T - B_m omega - F dd/dtheta, solved for the acceleration."""
    kinetic, potential = energies()
    force = T - B_m * omega - F * sp.diff(SLIDER, theta)
    momentum = sp.diff(kinetic, omega)
    bent = sp.diff(momentum, theta) * omega - sp.diff(kinetic - potential, theta)
    return (force - bent) / sp.diff(momentum, omega)


@cache
def accelerations():  # type: ignore[no-untyped-def]
    """f(state, input, effort, parameters) -> Newton-Euler, Lagrange, file, at 30 digits."""
    expressions = [newton_euler(), lagrange(), SYSTEM.dynamics[1]]
    symbols = [*SYSTEM.x, *SYSTEM.u, *SYSTEM.e, *SYSTEM.p]
    return sp.lambdify(symbols, expressions, modules="mpmath", cse=True)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.floats(-7.0, 7.0),
    st.floats(-100.0, 100.0),
    st.floats(-20.0, 20.0),
    st.floats(-300.0, 300.0),
    st.lists(st.floats(0.3, 3.0), min_size=8, max_size=8),
)
def test_three_derivations_agree(
    angle: float, speed: float, torque: float, force: float, share: list[float]
) -> None:
    values = [v * s for v, s in zip(SYSTEM.values, share, strict=True)]
    with mpmath.workdps(30):
        one, two, three = accelerations()(*map(mpmath.mpf, (angle, speed, torque, force, *values)))
        scale = 1 + abs(three)
        assert abs(one - two) < 1e-20 * scale
        assert abs(one - three) < 1e-20 * scale


def test_terms_are_all_there() -> None:
    """No term cancels by chance: every symbol of the file is in the derived expression, and no other."""
    assert newton_euler().free_symbols == {*SYSTEM.x, *SYSTEM.u, *SYSTEM.e, *SYSTEM.p}


def test_power_that_flows_out_at_the_port_is_force_times_speed() -> None:
    s = SYSTEM
    energy = sum(energies())
    rate = sp.diff(energy, theta) * omega + sp.diff(energy, omega) * s.dynamics[1]
    brought = T * omega - B_m * omega**2 - F * s.signals["v"]
    draw = np.random.default_rng(0).normal
    x = np.stack([draw(size=500) * 3, draw(size=500) * 50], -1)
    u, e = draw(size=(500, 1)) * 5, draw(size=(500, 1)) * 100
    found = values_of(s, [rate, brought, F * s.signals["v"]], x, u, e=e)
    assert np.abs(found[:, 2]).max() > 100.0
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=0, atol=1e-11 * np.abs(found).max())


def test_position_of_the_port_is_the_slider_and_starts_closest_to_the_shaft() -> None:
    known = SYSTEM.signals
    shown = [known["d"], SLIDER, known["v"], sp.diff(SLIDER, theta) * omega]
    x = np.stack([np.linspace(-7, 7, 401), np.full(401, 3.0)], -1)
    d, slider, v, speed = values_of(SYSTEM, shown, x, [0.0]).T
    np.testing.assert_allclose(d, slider - 0.24, atol=1e-15)
    np.testing.assert_allclose(v, speed, atol=1e-15)
    assert d.min() == pytest.approx(0.0, abs=1e-4)
