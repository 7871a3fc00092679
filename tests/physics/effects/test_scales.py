"""Sizes along measurements."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.physics.effects.benches import PERIOD, run, system
from unmodelled.effects.scales import Scales, Spread
from unmodelled.systems.numeric import numpy_system_function


def test_the_lacking_effort_of_a_port_is_recovered_from_slopes() -> None:
    """The pendulum moves as it would with a torque of 0.4 sin(30 t) besides."""
    known = system("pendulum")
    n, h = 3000, PERIOD
    rates = numpy_system_function(known, list(known.closed))
    p, x, path = np.array(known.values), np.array([0.2, 0.0]), []
    t = h * np.arange(n)
    for now in t:
        path.append(x)
        middle = x + 0.5 * h * rates(
            now, x, np.zeros(1), np.array([0.4 * np.sin(30.0 * now)]), p, np.empty(0)
        )
        late = np.array([0.4 * np.sin(30.0 * (now + 0.5 * h))])
        x = x + h * rates(now + 0.5 * h, middle, np.zeros(1), late, p, np.empty(0))
    found = Scales.measured(
        known, PERIOD, np.array([0, n]), t, np.array(path), np.zeros((n, 1)), np.empty((1, 0))
    )
    assert found.effort["joint"] == pytest.approx(0.4 / np.sqrt(2.0), rel=0.05)
    assert found.mobility["joint"] == pytest.approx(1.0 / 0.02)
    assert found.duration == pytest.approx(2.999)


def test_every_quantity_has_a_spread() -> None:
    known, given = system("slider_crank"), run(system("slider_crank"))
    found = Scales.measured(known, PERIOD, given.offsets, given.t, given.x, given.u, given.c)
    numbers = [item.name for item in (*known.parameters, *known.operating_point)]
    assert set(found.of) == {"theta", "omega", "T", *known.signals, *numbers}
    assert set(found.outputs) == {"theta", "omega"}
    assert_allclose(found.of["theta"].low, given.x[:, 0].min())
    assert_allclose(found.of["d"].high, 0.1, rtol=1e-3)


def test_a_quantity_that_never_changes_or_has_no_value_has_a_small_spread() -> None:
    assert Spread.of(np.zeros(5)).rms > 0.0
    assert Spread.of(np.zeros(5)).half > 0.0
    assert Spread.of(np.array([np.nan, np.inf])) == Spread(0.0, 0.0, 1e-12)
    assert Spread.of(np.array([np.nan, 3.0, 4.0])) == Spread(3.0, 4.0, np.sqrt(12.5))
