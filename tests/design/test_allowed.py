"""No machine that a system file allows leaves its travel under a planned experiment."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.design.test_kept import AXIS, GEAR, HEATER, KINDS, PENDULUM, SPRING
from tests.machines.folders import motion, system_of, text_of
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.design.limits import read_limits
from unmodelled.design.planned import default_inputs, read_inputs

#: System file by kind of machine, and bounds of what it leaves open.
ALLOWED: dict[str, tuple[str, dict[str, tuple[float, float]]]] = {
    "axis": (AXIS.replace("bounds: [0, 5]", "bounds: [0, 0.2]"), {"b": (0.0, 0.1), "mgl": (0.0, 0.2)}),
    "gear": (GEAR.replace("bounds: [0, 5]", "bounds: [0, 0.2]"), {"b": (0.0, 0.1), "mgl": (0.0, 0.2)}),
    "pendulum": (
        PENDULUM.replace("bounds: [0.2, 5]", "bounds: [0.6, 2]"),
        {"b": (0.0, 0.1), "mgl": (0.6, 2)},
    ),
    "spring": (SPRING.replace(", bounds: [0.2, 5]", ""), {"b": (0.0, 0.1), "mgl": (0.45, 1.8)}),
    "heater": (
        HEATER.replace("20.0, unit: J/K", "20.0, unit: J/K, identify: true"),
        {"C": (10, 40), "G": (0, 20)},
    ),
}


@pytest.mark.parametrize("name", KINDS)
def test_no_machine_that_the_file_allows_leaves_its_travel(name: str, tmp_path: Path) -> None:
    kind, (text, bounds) = KINDS[name], ALLOWED[name]
    system = system_of(text, tmp_path)
    (tmp_path / "limits.yaml").write_text(f"{kind.limits}period: {kind.period}\n")
    limits = read_limits(tmp_path / "limits.yaml", system)
    own = limits.moves["T" if name == "heater" else "theta"]
    rng = np.random.default_rng([*name.encode()])
    corners = np.array([[0.0, 0.0, 1.0, 1.0], [0.0, 1.0, 0.0, 1.0]])
    share = np.concatenate([rng.random((2, 40)), corners], axis=1)
    numbers = {"F_c": 0.0} | {
        n: a + s * (b - a) for (n, (a, b)), s in zip(bounds.items(), share, strict=True)
    }
    start = np.tile(np.array(kind.start)[:, None], share.shape[1])
    found = default_inputs(system, limits, 0)
    for u in found.values():
        y = kind.shown(motion(lambda x, f: kind.rates(x, f, numbers), start, u[:, 0], kind.period, 4)[:, 0])
        assert own.low <= y.min() and y.max() <= own.high, (y.min(), y.max())
    assert len(found) >= 2


CART = "duration: 4\nperiod: 0.1\ninputs: {force: {low: -2, high: 2}}\ntravel: {x: {low: -0.4, high: 0.4}}\n"
#: Of a cart: what acts on it (N, at 0.01 s), what the file says otherwise, and what the program says.
HIDDEN: dict[str, tuple[Callable[[Array], Array], dict[str, str], str]] = {
    # a spring whose period is that of the samples: every one finds the cart where it started
    "swings between the samples": (
        lambda t: np.where((t > 0.0) & (t < 3.9), 2.0, 0.0)[::10],
        {
            "force - b*v": "force - 7.896*x",
            "m: {value: 2,": "m: {value: 0.002,",
            "unit: N}}": "unit: N, hold: true}}",
        },
        "x reaches .*, beyond its travel",
    ),
    "acts after the end": (
        lambda t: np.where((t > 3.0) & (t < 3.9), 2.0, 0.0)[::10],
        {"force: {unit: N}": "force: {unit: N, delay: 1.0}"},
        "x reaches .*, beyond its travel",
    ),
    "acts between the samples": (
        lambda t: np.where(np.round(t * 100.0) % 10 == 5, 2.0, 0.0),
        {},
        "force changes between the samples of 0.1 s: write the period",
    ),
}


@pytest.mark.parametrize("name", HIDDEN)
def test_motion_that_no_sample_shows_counts(name: str, tmp_path: Path) -> None:
    force, changes, message = HIDDEN[name]
    system = system_of(text_of("cart.yaml", *changes.items()), tmp_path)
    (tmp_path / "limits.yaml").write_text(CART)
    t = np.linspace(0.0, 4.0, 401).astype(np.float64)
    u = force(t)
    pd.DataFrame({"t": t[:: 400 // (len(u) - 1)], "force": u}).to_csv(tmp_path / "mine.csv", index=False)
    with pytest.raises(BadInput, match=message):
        read_inputs(tmp_path / "mine.csv", system, read_limits(tmp_path / "limits.yaml", system))
