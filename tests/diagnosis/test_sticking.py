"""Logs of an axis that dry friction holds between its moves."""

import numpy as np
import pytest

import unmodelled as um
from tests.diagnosis.studies import effect, fitted
from tests.machines.folders import Array, system_of, text_of, write_runs
from unmodelled.diagnosis.columns.columns import Columns
from unmodelled.diagnosis.columns.path import Path as FreeRun
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.residuals import Errors
from unmodelled.effects.place import Place
from unmodelled.logs.preparation import prepare

#: s, and rad of the encoder.
PERIOD, SAMPLES, RUNS, ENCODER = 0.002, 900, 5, 1e-3
TRUTH = {"b": 0.05, "k": 42.0, "F_c": 0.8}
FINE = 40
#: What is not known of the axis: its friction.
UNKNOWN = (
    ("  F_c: {value: 0.8, unit: N m}\n  v_c: {value: 1.0e-5, unit: rad/s}\n", ""),
    (", law: F_c*tanh(w/v_c)", ""),
    ("value: 42", "value: 50"),
)


def moves() -> Array:
    """Torques (samples, runs) that move from level to level, and rest on each, N m."""
    t, ends = PERIOD * np.arange(SAMPLES), np.linspace(0.0, PERIOD * SAMPLES, 6)
    levels = np.random.default_rng(3).uniform(-8.0, 8.0, (6, RUNS))
    levels[0] = 0.0
    share = [np.clip((t - begin) / 0.15, 0.0, 1.0) for begin in ends[1:-1]]
    return sum((s[:, None] * (b - a) for s, a, b in zip(share, levels[:-1], levels[1:], strict=False)), 0.0)


def angles(u: Array) -> Array:
    """Angles (samples, runs) under friction that holds exactly: the impulse of a step stops what it can."""
    J, h, F_c = 0.02, PERIOD / FINE, TRUTH["F_c"]
    theta, w, found = np.zeros(RUNS), np.zeros(RUNS), []
    for before, after in zip(u, [*u[1:], u[-1]], strict=True):
        found.append(theta)
        for step in range(FINE):
            torque = before + (after - before) * (step + 0.5) / FINE
            w = w + h / J * (torque - TRUTH["k"] * theta - TRUTH["b"] * w)
            w = w - np.clip(w, -h * F_c / J, h * F_c / J)
            theta = theta + h * w
    return np.array(found)


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder, u, t = tmp_path_factory.mktemp("axis"), moves(), PERIOD * np.arange(SAMPLES)
    y = ENCODER * np.round(angles(u) / ENCODER)
    logs = write_runs(folder / "logs", [{"t": t, "u": u[:, k], "theta": y[:, k]} for k in range(RUNS)])
    system = system_of(text_of("stuck_axis.yaml", *UNKNOWN), folder)
    return Study.of(system, prepare(system, um.read_logs(logs, system)), 0.2, 0)


def with_law(axis: Study, family: str) -> FittedHypothesis:
    return fitted(Hypothesis.known(axis).plus(effect(family), Place("port", "shaft")))


def test_a_held_axis_shows_its_friction_and_no_creep(axis: Study) -> None:
    found, falling = (with_law(axis, family) for family in ("coulomb_friction", "stribeck_friction"))
    values = found.fit.values
    assert {name: values[name] for name in TRUTH} == pytest.approx(TRUTH, rel=0.02)
    assert values["v_c"] < 5e-3 and found.fit.substeps <= 2
    assert np.sqrt(found.fit.variance("F_c")) < 0.005
    # the encoder rounds by 0.29 of its step, and the measured starts are off by that too
    assert found.fit.left.value * axis.recording.scale[0] < 0.4 * ENCODER
    # a curve that falls with speed explains nothing more
    assert falling.fit.loss > 0.99 * found.fit.loss - 5.0


def test_columns_are_the_derivatives_of_free_runs_that_stick(axis: Study) -> None:
    found = with_law(axis, "coulomb_friction")
    columns = Columns(FreeRun.of_windows(found, found.recording))
    unknowns, (moved, sigma) = found.unknowns, found.moved(found.recording)
    z, errors = found.vector(unknowns), Errors(unknowns, sigma, max(2, found.fit.substeps))
    for k, name in enumerate(u.name for u in unknowns.each):
        if name not in TRUTH:
            continue
        ends = [z + sign * 1e-5 * (np.arange(len(z)) == k) for sign in (1.0, -1.0)]
        there, back = (errors(end[None], moved[:, None])[:, 0] for end in ends)
        wanted = (there - back) / 2e-5
        mine = columns.open.columns[..., k]
        assert np.linalg.norm(mine - wanted) < 0.03 * np.linalg.norm(wanted), name
