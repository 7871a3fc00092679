"""Figures of the tutorial on small made-up tables."""

import json
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from pipeline.figures.tutorial import forecast, motor
from tests.figures.checks import Chapter, check_rendered, write_tables

pytestmark = pytest.mark.long

ABOUT = {"lowest": 4.0, "highest": 15.0, "noise": 0.01, "voltage": 200.0, "penalty": 1.0}
ABOUT |= {"resistance": 5.0, "friction": 0.006}
#: A model's error at most, and its errors on five runs; the third run is in the middle by the physics.
ERRORS = {"physics": 0.1, "black_box": 0.3, "hybrid": 0.02}


def static_tables() -> dict[str, pd.DataFrame]:
    rng = np.random.default_rng(0)
    current = np.linspace(1.6, 22.0, 60)
    true = 0.7 - 0.002 * (current - 8.0) ** 2
    networks, errors = [], []
    for hidden, penalty, seed in product((1, 2, 16), (0.0, 1.0), range(3)):
        head = {"hidden": hidden, "penalty": penalty, "seed": seed}
        networks.append(pd.DataFrame({**head, "current": current, "efficiency": true + 0.01 * seed}))
        new = {1: 0.02, 2: 0.011, 16: 0.03}[hidden] + 0.001 * seed
        errors.append({**head, "training": 0.01 / hidden, "new": new})
    measured = np.linspace(4.0, 15.0, 40)
    noisy = 0.7 - 0.002 * (measured - 8.0) ** 2 + 0.01 * rng.standard_normal(40)
    samples = pd.DataFrame({"current": measured, "efficiency": noisy})
    return {
        "training": samples.iloc[::3],
        "new": samples,
        "truth": pd.DataFrame({"current": current, "efficiency": true}),
        "physics": pd.DataFrame({"current": current, "efficiency": true - 0.02}),
        "networks": pd.concat(networks, ignore_index=True),
        "network_errors": pd.DataFrame(errors),
    }


def dynamic_tables() -> dict[str, pd.DataFrame]:
    t = np.linspace(0.0, 4.0, 300)
    forecasts, errors = [], []
    for (group, reach), k, model, fold in product(
        (("explored", 0.5), ("unseen", 2.0)), range(5), ERRORS, ("repeat 1", "repeat 2")
    ):
        theta, omega = reach * np.sin(6.0 * t), 6.0 * reach * np.cos(6.0 * t)
        off = ERRORS[model] * (1.0 + 0.1 * k)
        head = {"group": group, "model": model, "fold": fold, "id": f"{group}{k}"}
        columns = {"t": t, "theta_measured": theta, "omega_measured": omega, "theta": theta + off}
        columns |= {"omega": omega + off, "explored": np.hypot(theta, omega / 6.0) < 0.8}
        forecasts.append(pd.DataFrame({**head, **columns}))
        errors.append({**head, "rmse": off})
    angle = np.linspace(0.0, 2.0 * np.pi, 30)
    region = pd.DataFrame({"theta": 0.8 * np.sin(angle), "omega": 4.8 * np.cos(angle)})
    return {"forecasts": pd.concat(forecasts), "swing_errors": pd.DataFrame(errors), "region": region}


def write(folder: Path, tables: dict[str, pd.DataFrame]) -> Path:
    data = write_tables(folder, "tutorial", tables)
    (data / "tables" / "tutorial" / "about.json").write_text(json.dumps(ABOUT))
    return data


CHAPTER = Chapter(("tutorial",), lambda: static_tables() | dynamic_tables(), write)


def titles(figure: Figure) -> list[str]:
    return [axes.get_title() for axes in figure.axes]


def test_the_shares_of_the_power_add_up_to_one() -> None:
    """E_a (I - B' E_a) / (V I), R_a I / V and B' E_a^2 / (V I), as the figure stacks them."""
    from pipeline.cam_follower.static import efficiency

    current, voltage, resistance, friction = np.array([3.0, 9.0, 20.0]), 200.0, 5.0, 0.006
    emf = 1.0 - resistance * current / voltage
    lost = (1.0 - emf) + friction * voltage * emf**2 / current
    np.testing.assert_allclose(efficiency(current, voltage, resistance, friction) + lost, 1.0)


def test_panels_show_the_smallest_largest_and_best_network(folder: Path) -> None:
    found = titles(motor.flexibility(folder))
    assert found[0].startswith("a: underfit, 1 neuron\n") and "RMSE 10 ‰ in training, 21 ‰" in found[0]
    assert found[1].startswith("b: overfit, 16 neurons\n") and "31 ‰ on new samples" in found[1]
    assert found[2].startswith("c: balance, 2 neurons\n") and "12 ‰ on new samples" in found[2]


def test_titles_hold_the_errors_where_measured_and_where_not(folder: Path) -> None:
    # networks of three seeds are 0, 0.01 and 0.02 off, the physics 0.02
    places = [f"where {place}: networks 0.010, physics 0.020" for place in ("not measured", "measured")]
    assert titles(motor.network_beyond_the_data(folder)) == places


@pytest.mark.parametrize("model", ERRORS)
def test_the_runs_shown_are_those_in_the_middle_by_the_physics(model: str, folder: Path) -> None:
    figure = getattr(forecast, f"{model}_forecast")(folder)
    error = f"{1.2 * ERRORS[model]:.2g}"
    runs = [f"a run that {does} the explored region: RMSE {error} rad" for does in ("stays in", "leaves")]
    assert titles(figure)[1:] == runs
    assert len(figure.axes[2].lines) == 3  # measured, and two trainings


def test_a_model_that_was_not_trained_is_said_to_be_absent(tmp_path: Path) -> None:
    tables = dynamic_tables()
    less = {name: t[t["model"] != "hybrid"] if "model" in t else t for name, t in tables.items()}
    figure = check_rendered(forecast.hybrid_forecast, write(tmp_path, less))
    assert "no model hybrid" in figure.axes[0].texts[0].get_text()
