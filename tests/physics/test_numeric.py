"""Numpy functions of a system's expressions."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from tests.measurements.systems import F, V, k, m, motor, omega, theta
from unmodelled.systems import functions as f
from unmodelled.systems.model import TIME
from unmodelled.systems.numeric import numpy_system_function

SYSTEM = motor()


def value(expression: sp.Expr, at: float, other: float = 0.0) -> float:
    """`expression` of theta and omega."""
    function = numpy_system_function(SYSTEM, [expression])
    x, u, e = np.array([at, other, 0.0]), np.zeros(1), np.zeros(1)
    return float(function(0.0, x, u, e, np.array(SYSTEM.values), np.ones(1))[0])


@pytest.mark.parametrize(
    ("expression", "at", "expected"),
    [
        (f.sgn(theta), -2.0, -1.0),
        (f.step(theta), 0.0, 0.5),
        (f.whole(theta), -1.5, -2.0),
        (f.greater(theta, 1), 1.0, 0.0),
        (f.at_least(theta, 1), 1.0, 1.0),
        (f.equal(theta, 1), 1.0, 1.0),
        (f.absolute(theta), -3.0, 3.0),
        (f.minimum(theta, 1), 3.0, 1.0),
        (f.maximum(theta, 1), 3.0, 3.0),
        (f.select(f.greater(theta, 0), 5, 1 / theta), -2.0, -0.5),
        (f.select(f.greater(theta, 0), sp.log(theta), 7), 0.0, 7.0),
        (f.lookup(0, theta, 0), 1.5, 2.25),
        (f.lookup(0, theta, 0), 9.0, 9.0),
        (f.lookup(0, theta, 1), 1.5, 3.0),
        (f.lookup(0, theta, 1), 9.0, 0.0),
        (sp.atan2(theta, 1), 1.0, np.pi / 4),
    ],
)
def test_functions(expression: sp.Expr, at: float, expected: float) -> None:
    assert value(expression, at) == pytest.approx(expected)


def test_leading_axes_broadcast() -> None:
    function = numpy_system_function(SYSTEM, [theta * m + TIME, k * V - F, sp.Integer(2)])
    generator = np.random.default_rng(0)
    t, x, u = generator.random(5), generator.random((4, 5, 3)), generator.random((5, 1))
    e, c = generator.random((4, 1, 1)), generator.random((4, 1, 1))
    p = np.array(SYSTEM.values)
    found = function(t, x, u, e, p, c)
    assert found.shape == (4, 5, 3)
    np.testing.assert_allclose(found[..., 0], x[..., 0] * c[..., 0] + t)
    np.testing.assert_allclose(found[..., 1], 0.3 * u[..., 0] - e[..., 0])
    np.testing.assert_array_equal(found[..., 2], 2.0)


def test_efforts_can_be_left_out() -> None:
    function = numpy_system_function(SYSTEM, SYSTEM.closed, efforts_zero=True)
    x = np.array([0.1, 2.0, 3.0])
    rates = function(0.0, x, np.array([6.0]), np.empty(0), np.array(SYSTEM.values), np.array([0.5]))
    np.testing.assert_allclose(rates, [2.0, 0.9 / 0.52, (6.0 - 6.0 - 0.6) / 0.05])


def test_no_value_is_not_an_error() -> None:
    assert np.isinf(value(1 / theta, 0.0))
    assert np.isnan(value(sp.log(omega), 1.0, -1.0))
