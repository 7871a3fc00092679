"""Functions of one number in generated code."""

from __future__ import annotations

import math
from collections.abc import Callable

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from unmodelled.engine.compiled import scalars

Array = NDArray[np.float64]
Function = Callable[[float], float]


def mapped(function: Function, x: Array) -> Array:
    """`function` of every number, in a loop that is vectorised as in a kernel."""

    @numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
    def loop(x, y):  # type: ignore[no-untyped-def]
        for i in range(len(x)):
            y[i] = function(x[i])

    y = np.empty_like(x)
    loop(x, y)
    return y


@pytest.mark.parametrize(("function", "expected"), [(scalars.sin, np.sin), (scalars.cos, np.cos)])
def test_sine_and_cosine(function: Function, expected: Callable[[Array], Array]) -> None:
    generator = np.random.default_rng(0)
    near = np.arange(-6300, 6300) * np.pi / 4
    x = np.concatenate(
        [
            generator.uniform(-1e4, 1e4, 100_000),
            generator.uniform(-7.0, 7.0, 100_000),
            near,
            np.nextafter(near, np.inf),
            np.nextafter(near, -np.inf),
            10.0 ** np.arange(-300.0, 0.0, 3.0),
            np.zeros(1),
        ]
    )
    assert np.abs(x).max() <= 1e4
    error = np.abs(mapped(function, x) - expected(x))
    assert error.max() < 4e-16
    # and relative, down to the zeros
    assert (error <= 1e-15 * np.abs(expected(x))).all()


ONE = [scalars.sin, scalars.cos, scalars.whole, scalars.absolute]


@pytest.mark.parametrize("function", ONE)
def test_nan_stays_nan(function: Function) -> None:
    assert math.isnan(function(math.nan))


@pytest.mark.parametrize("function", [scalars.sin, scalars.cos])
@pytest.mark.parametrize("x", [math.inf, -math.inf])
def test_infinity_has_no_sine(function: Function, x: float) -> None:
    assert math.isnan(function(x))


@pytest.mark.parametrize("function", [scalars.minimum, scalars.maximum])
def test_extremes_keep_nan(function: Callable[[float, float], float]) -> None:
    assert math.isnan(function(math.nan, 1.0))
    assert math.isnan(function(1.0, math.nan))


@pytest.mark.parametrize("x", [-2.5, -1.0, -1e-300, 0.0, 0.7, 3.0, 1e19, -1e300])
def test_floor_of_any_size(x: float) -> None:
    assert scalars.whole(x) == np.floor(x)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ([scalars.sgn(x) for x in (-2.0, 0.0, 3.0)], [-1.0, 0.0, 1.0]),
        ([scalars.step(x) for x in (-2.0, 0.0, 3.0)], [0.0, 0.5, 1.0]),
        ([scalars.greater(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 0.0, 1.0]),
        ([scalars.at_least(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 1.0, 1.0]),
        ([scalars.equal(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 1.0, 0.0]),
        ([scalars.absolute(x) for x in (-2.0, 0.0, 3.0)], [2.0, 0.0, 3.0]),
        ([scalars.minimum(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 1.0, 1.0]),
        ([scalars.maximum(x, 1.0) for x in (0.0, 1.0, 2.0)], [1.0, 1.0, 2.0]),
        ([scalars.select(x, 5.0, 7.0) for x in (-1.0, 0.0, 1.0)], [5.0, 7.0, 5.0]),
    ],
)
def test_corners(found: list[float], expected: list[float]) -> None:
    assert found == expected
