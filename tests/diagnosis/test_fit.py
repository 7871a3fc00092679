"""Fits recover what was planted, with right derivatives, starts, bounds and step sizes."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import unmodelled as um
from tests.diagnosis.benches import FRICTION, PERIOD, Bench, exact, pendulum
from tests.diagnosis.conftest import Known
from tests.diagnosis.studies import F_C, MGL, B, simulation_of
from tests.machines.folders import Array, logs_of, motion, system_of, text_of
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.deviation import gap
from unmodelled.diagnosis.fitting.fit import ParameterFit, fit_parameters
from unmodelled.diagnosis.fitting.floor import floor, start_noise
from unmodelled.diagnosis.fitting.residuals import Errors
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown, Unknowns
from unmodelled.diagnosis.judge.last_fits import settled


def errors_of(found: ParameterFit, truth: dict[str, float]) -> Array:
    """In standard deviations."""
    sigma = np.sqrt(np.diag(found.covariance))
    return np.array([(found.values[n] - truth[n]) / sigma[found.names.index(n)] for n in truth])


def rough(simulation: Simulation) -> float:
    """Noise of the sensors in standard deviations of the outputs."""
    recording = simulation.recording
    return float(np.sqrt(np.mean((recording.noise / recording.scale) ** 2)))


def test_a_pendulum_with_friction_and_wrong_parameters(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench())
    found = fit_parameters(simulation)
    assert found.converged and found.names == ("b", "mgl", "F_c")
    truth = Bench()
    planted = {"b": truth.b, "mgl": truth.mgl, "F_c": float(np.max(truth.friction))}
    assert np.abs(errors_of(found, planted)).max() < 4.0
    assert found.values == pytest.approx(planted, rel=0.03)
    assert 0.8 * rough(simulation) < found.left.value < 1.05 * rough(simulation)
    assert found.gap.value == gap(simulation, found.numbers, found.substeps).value
    assert found.gap.value < 1.3 * floor(simulation, found.numbers).value
    known = pendulum(tmp_path / "known")
    without = fit_parameters(Simulation(known, simulation.recording))
    assert without.converged and without.gap.value > 5.0 * found.gap.value
    assert np.std(found.start / start_noise(simulation, found.numbers)) < 1.2


def test_the_slider_crank_bench(slider_crank: Known) -> None:
    system, logs = slider_crank
    truth = {"m3": 0.77, "J1": 0.0034, "F_c": 3.0, "viscous": 4.0}
    wrong = system.with_values({"m3": 1.1, "J1": 0.005, "F_c": 0.0, "viscous": 1.0, "B_m": 0.007})
    simulation = Simulation(wrong, Recording.of(logs, 0.1))
    free = [Unknown.of(p) for p in system.parameters if p.name in truth]
    found = fit_parameters(simulation, free)
    assert found.converged
    assert found.values == pytest.approx(truth, rel=0.12)
    assert found.gap.value < 1.25 * floor(simulation, found.numbers, found.substeps).value
    assert found.left.per_output["theta"] < 0.2 * found.gap.per_output["theta"]


@pytest.mark.parametrize("seed", range(3))
def test_intervals_are_as_wide_as_they_say(tmp_path: Path, seed: int) -> None:
    """Over parameters and draws of the noise together."""
    bench = Bench(noise=1e-3, seed=seed, runs=6)
    found = fit_parameters(simulation_of(tmp_path, bench))
    off = errors_of(found, {"b": bench.b, "mgl": bench.mgl, "F_c": 0.06})
    assert 0.05 < np.sqrt(np.mean(off**2)) < 2.5


def test_spikes_and_a_run_gone_wrong_do_little_harm(tmp_path: Path) -> None:
    system, logs = Bench().recorded(tmp_path, *FRICTION)
    y = logs.y.copy()
    y[7::40] += 0.05
    found = fit_parameters(Simulation(system, Recording.of(replace(logs, y=y), 0.1)))
    assert found.values["mgl"] == pytest.approx(1.2, rel=0.02)
    assert found.values["F_c"] == pytest.approx(0.06, rel=0.25)


def test_a_value_for_every_experiment(tmp_path: Path) -> None:
    planted = (0.02, 0.04, 0.06, 0.08)
    simulation = simulation_of(tmp_path, Bench(friction=planted))
    found = fit_parameters(simulation, [B, MGL, replace(F_C, own=True)])
    assert found.names[2:] == tuple(f"F_c@run{k}" for k in range(4))
    assert list(found.own["F_c"].values()) == pytest.approx(planted, abs=2e-3)
    sigma = np.sqrt(np.diag(found.covariance))[2:]
    assert (np.abs(np.array(list(found.own["F_c"].values())) - planted) < 4.0 * sigma).all()
    shared = fit_parameters(simulation, [B, MGL, F_C])
    assert shared.gap.value > 2.0 * found.gap.value


def test_the_best_of_several_starts_goes_on(tmp_path: Path) -> None:
    """A ripple whose number of periods is not known: its fit has a valley around every one."""
    law = ("F_c*tanh(omega/creep)", "F_c*tanh(omega/creep) + a*sin(n*theta)")
    number = ("ports:", "  a: {value: 0.0, unit: N m}\n  n: {value: 1.0, unit: '1'}\nports:")
    wide = exact(pendulum(tmp_path, *FRICTION, law, number))
    bench = Bench(ripple=0.1)
    recording = Recording.of(bench.logs(tmp_path / "logs", wide), 0.1)
    simulation = Simulation(wide, recording)
    free = [Unknown("a", -1.0, 1.0, 0.05), Unknown("n", 1.0, 30.0, 1.0)]
    starts = [{"n": float(n)} for n in (3, 7, 11, 15)]
    found = fit_parameters(simulation, free, starts)
    assert found.values == pytest.approx({"a": 0.1, "n": 12.0}, rel=0.05)
    lost = fit_parameters(simulation, free, starts[:1])
    assert lost.gap.value > 1.5 * found.gap.value


def test_states_that_no_output_shows(tmp_path: Path) -> None:
    """A spring behind a memory of its own; its stiffness is found through the memory."""
    memory = (
        ("  omega: {unit: rad/s}\n", "  omega: {unit: rad/s}\n  z: {unit: rad}\n"),
        ("  omega: (torque", "  z: (theta - z)/lag\n  omega: (torque - stiff*(theta - z)"),
        ("ports:", "  stiff: {value: 0.3, unit: N m/rad}\n  lag: {value: 0.1, unit: s}\nports:"),
    )
    system = exact(pendulum(tmp_path, *FRICTION, *memory))
    logs = Bench(memory=(0.5, 0.05)).logs(tmp_path / "logs", system)
    simulation = Simulation(system, Recording.of(logs, 0.1))
    assert simulation.hidden == [2]
    found = fit_parameters(simulation, [Unknown("stiff", 0.0, 5.0, 0.3), Unknown("lag", 0.01, 1.0, 0.1)])
    assert found.values == pytest.approx({"stiff": 0.5, "lag": 0.05}, rel=0.05)
    assert found.gap.value < 1.3 * floor(simulation, found.numbers).value


def test_a_system_whose_sensor_shows_no_state_by_itself(tmp_path: Path) -> None:
    """All states are integrated from the start of the experiment, which alone can be corrected."""
    system = system_of(text_of("squared_lag.yaml"), tmp_path)
    t = PERIOD * np.arange(400)
    u = 1.0 + np.sin(9.0 * t)
    path = motion(lambda x, drive: 8.0 * (drive - x), [0.0], u, PERIOD)[:, 0]
    y = path**2 + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    logs = logs_of(system, tmp_path / "logs", [{"t": t, "u": u, "y": y}])
    simulation = Simulation(system, Recording.of(logs, 0.1))
    found = fit_parameters(simulation)
    assert simulation.hidden == [0] and np.abs(found.start[0]).max() < 0.1 and not found.start[1:].any()
    assert found.values["k"] == pytest.approx(8.0, rel=0.01)
    assert 0.9 < found.gap.value / floor(simulation, found.numbers).value < 1.1


def test_a_machine_without_inputs_and_without_unknowns(tmp_path: Path) -> None:
    """The initial states alone are fitted: a pendulum that swings freely, whose numbers are all trusted."""
    free = (
        ("inputs:\n  torque: {unit: N m}\n", ""),
        ("(torque - b*omega", "(-b*omega"),
        ("value: 0.03, unit: N m s/rad, identify: true, bounds: [0, 0.1]", "value: 0.015, unit: N m s/rad"),
        ("value: 0.9, unit: N m, identify: true, bounds: [0.2, 5]", "value: 1.2, unit: N m"),
    )
    system = pendulum(tmp_path, *free)
    driven = pendulum(tmp_path / "driven")
    logs = Bench(friction=0.0).logs(tmp_path / "logs", driven)
    still = {name: run.assign(torque=0.0) for name, run in logs.table().groupby("experiment")}
    simulation = Simulation(system, Recording.of(um.Logs.from_frames(still, system), 0.1))
    found = fit_parameters(simulation)
    assert found.converged and found.names == () and found.start.shape[1] == 2


def test_derivatives_against_an_independent_integration(tmp_path: Path) -> None:
    bench = Bench(runs=1, samples=120)
    simulation = simulation_of(tmp_path, bench)
    unknowns = Unknowns(simulation, (B, MGL, F_C))
    recording = simulation.recording
    sigma = start_noise(simulation, unknowns.numbers(unknowns.vector({})[None]))
    errors = Errors(unknowns, sigma, 4)
    z, moved = unknowns.vector({"b": 0.02, "mgl": 1.1, "F_c": 0.05}), np.full(sigma.shape, 0.3)
    around = errors(*errors.around(z, moved))
    r, slopes = around[:, 0], errors.slopes(z, around)
    u, order = recording.logs.u, np.argsort(recording.start)
    for w in order[:2]:
        rows = slice(recording.start[w], recording.start[w] + recording.steps[w] + 1)
        shown = recording.logs.y[rows, 0]
        velocity = recording.sensors.slope(0, 0.0)[recording.start[w]]
        x0 = np.array([shown[0], velocity]) + moved[w] * sigma[w]

        def residual(point: Array, rows=rows, shown=shown, x0=x0, w=w) -> Array:  # type: ignore[no-untyped-def]
            b, mgl, friction = point[:3] * unknowns.scale
            truth = replace(bench, b=b, mgl=mgl, friction=friction)
            start = (x0 + point[3:] * sigma[w])[:, None]
            path = motion(truth.rates, start, u[rows], PERIOD)[:, 0, 0]
            return (path - shown)[1:] / recording.noise[0]

        steps = recording.steps[w]
        point = np.concatenate([z, np.zeros(2)])
        np.testing.assert_allclose(r[w, :steps, 0], residual(point), atol=1e-6 * np.abs(r).max())
        for k in range(5):
            step = 1e-4 * np.eye(5)[k]
            expected = (residual(point + step) - residual(point - step)) / 2e-4
            largest = np.abs(expected).max()
            np.testing.assert_allclose(slopes[w, k, :steps, 0], expected, atol=1e-2 * largest)


def test_bounds_hold(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench())
    tight = [replace(B, low=0.02), MGL, replace(F_C, high=0.04)]
    found = fit_parameters(simulation, tight)
    assert found.converged
    assert found.values["b"] == 0.02 and found.values["F_c"] == pytest.approx(0.04, rel=1e-12)
    assert found.values["mgl"] == pytest.approx(1.2, rel=0.02)
    outside = fit_parameters(simulation, [replace(B, low=0.05, high=0.08)], starts=[{"b": 0.5}], iterations=3)
    assert 0.05 <= outside.values["b"] <= 0.08


def test_divergence_is_a_large_error(tmp_path: Path) -> None:
    """A gain that makes every window blow up at the start of the fit is left behind, or owned up to."""
    change = ("mgl*sin(theta)", "mgl*sin(theta) - grow*omega**3")
    number = ("ports:", "  grow: {value: 0.0, unit: N m s^3/rad^3}\nports:")
    simulation = simulation_of(tmp_path, Bench(), change, number)
    growing = Unknown("grow", -10.0, 10.0, 0.1)
    values = np.tile(simulation.values, (1, 2, 1))
    values[0, 1, simulation.names.index("grow")] = 10.0
    runs = simulation(values)
    assert not runs.diverged[:, 0].any() and runs.diverged[:, 1].mean() > 0.5
    assert gap(simulation, values[:, 1:]).value > 5.0
    lost = fit_parameters(simulation, [growing], starts=[{"grow": 10.0, "b": 0.015}], iterations=3)
    assert np.isfinite(lost.loss) and np.isfinite(lost.gap.value)
    assert not lost.converged or lost.gap.value < 1.0
    found = fit_parameters(simulation, [B, MGL, F_C, growing], starts=[{"grow": 10.0}, {"grow": 0.0}])
    assert found.values["mgl"] == pytest.approx(1.2, rel=0.01)


def test_a_fit_may_end_where_an_iteration_gains_little(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench(runs=2, samples=200))
    exact, near = (fit_parameters(simulation, [B, MGL, F_C], share=share) for share in (1e-9, 0.9))
    assert near.converged and near.simulations < exact.simulations
    assert exact.left.value <= near.left.value < 1.2 * exact.left.value


@dataclass(frozen=True)
class Ended:
    """A fit that ended."""

    converged: bool
    simulations: int
    every: str


@dataclass(frozen=True)
class Fitted:
    fit: Ended


class Fits:
    """A base whose fits end as given, one after the other."""

    def __init__(self, *ends: Ended) -> None:
        self.ends, self.starts = list(ends), list[object]()

    def fit(self, _: object, start: object) -> Fitted:
        self.starts.append(start)
        return Fitted(self.ends.pop(0))


def test_a_fit_whose_error_still_falls_goes_on_from_its_numbers() -> None:
    done = Fits(Ended(True, 40, "a"))
    assert settled(done, None, "start").fit.simulations == 40  # type: ignore[arg-type]
    early = Fits(Ended(False, 40, "a"), Ended(True, 25, "b"))
    found = settled(early, None, "start").fit  # type: ignore[arg-type]
    assert (found.converged, found.every, found.simulations) == (True, "b", 65)
    assert early.starts == ["start", "a"]
    never = Fits(Ended(False, 40, "a"), Ended(False, 25, "b"))
    assert not settled(never, None, "start").fit.converged  # type: ignore[arg-type]
