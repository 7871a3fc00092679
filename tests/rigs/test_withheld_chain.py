"""Measurement chains of the withheld check: every part does what it says, and cases follow their seed."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.rigs.withheld.campaign import write
from pipeline.rigs.withheld.carriages import Hoist
from pipeline.rigs.withheld.cases import Case, Planted
from pipeline.rigs.withheld.chain.campaign import MATERIAL, write_measured
from pipeline.rigs.withheld.chain.case import VALIDATION, MeasuredCase
from pipeline.rigs.withheld.chain.drawing import measured_cases
from pipeline.rigs.withheld.chain.drive import ClosedLoop, DriveLag, VaryingFriction, VaryingSupply
from pipeline.rigs.withheld.chain.logger import (
    Clock,
    CoarseEncoder,
    DifferencedSpeed,
    LowPass,
    PositionOnly,
    differenced,
)
from pipeline.rigs.withheld.chain.measuring import moved, shares
from pipeline.rigs.withheld.chain.part import Readings
from pipeline.rigs.withheld.drawing import FAMILIES
from pipeline.rigs.withheld.machines import EVERY, FURTHER
from pipeline.rigs.withheld.pendulum import Pendulum
from tests.conftest import files_of
from tests.rigs.test_withheld import short
from unmodelled.base.errors import BadInput
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

T = 0.001 * np.arange(2000.0)
BOTH = Planted("coulomb_friction", "rail"), Planted("actuator_offset", "actuator:u")


def sine(hertz: float) -> Readings:
    rate, t = 2.0 * np.pi * hertz, T[:, None]
    y = np.sin(rate * t)
    return Readings(t, y, {"x": y, "v": rate * np.cos(rate * t)})


def test_a_clock_jitters_and_runs_fast() -> None:
    read = Clock(0.05, 1e-3, True).read(sine(5.0), np.random.default_rng(0))
    off = read.t[1:-1, 0] / (1.0 + 1e-3) - T[1:-1]
    assert np.std(off) == pytest.approx(0.05 * 0.001, rel=0.1)
    shown = np.sin(10.0 * np.pi * read.t / 1.001)
    np.testing.assert_allclose(read.outputs["x"], shown, atol=1e-6)
    grid = Clock(0.05, 1e-3, False).read(sine(5.0), np.random.default_rng(0))
    np.testing.assert_allclose(grid.t[:, 0], T * 1.001)
    np.testing.assert_array_equal(grid.outputs["x"], read.outputs["x"])


def test_a_low_pass_attenuates_its_cut_off_by_3_db() -> None:
    passed = LowPass(20.0, True).processed(sine(20.0), Hoist(), 0.001)
    share = np.std(passed.outputs["x"][1000:]) / np.std(sine(20.0).u[1000:])
    assert share == pytest.approx(0.5**0.5, rel=0.01)
    np.testing.assert_array_equal(passed.u, passed.outputs["x"])
    assert LowPass(20.0, False).processed(sine(20.0), Hoist(), 0.001).u is not passed.u


def test_a_differenced_speed_is_late_by_half_its_window_unless_it_is_centred() -> None:
    ramp = (0.5 * T**2)[:, None]  # the speed is the time
    np.testing.assert_allclose(differenced(ramp, 0.001, 10, False)[50:, 0], T[50:] - 0.005, atol=1e-9)
    np.testing.assert_allclose(differenced(ramp, 0.001, 10, True)[50:-50, 0], T[50:-50], atol=1e-9)
    readings = DifferencedSpeed(0.01, 0.0, True).processed(sine(2.0), Hoist(), 0.001)
    np.testing.assert_allclose(readings.outputs["v"][20:-20], sine(2.0).outputs["v"][20:-20], atol=0.05)
    filtered = DifferencedSpeed(0.01, 15.0, False).processed(sine(15.0), Hoist(), 0.001).outputs["v"]
    assert np.std(filtered[500:]) < 0.75 * np.std(sine(15.0).outputs["v"])
    assert set(PositionOnly().processed(sine(2.0), Hoist(), 0.001).outputs) == {"x"}


def test_a_coarse_encoder_has_plateaus() -> None:
    fine = Hoist.sensors[0]
    coarse = CoarseEncoder(8.0).sensor(fine)
    assert coarse.quantum == 8.0 * fine.quantum and coarse.noise < coarse.quantum
    assert CoarseEncoder(8.0).sensor(Hoist.sensors[1]) == Hoist.sensors[1]


def test_a_drive_lags_and_its_strength_varies() -> None:
    (lag,) = DriveLag(0.004).drive()
    start = lag.applied(1e-4, 0.0, np.zeros(1))
    for _ in range(40):
        start = lag.applied(1e-4, 0.0, np.ones(1))
    assert start[0] == pytest.approx(1.0 - np.exp(-1.0))
    supply = VaryingSupply.drawn(8, np.random.default_rng(0))
    assert 0.05 < np.std(supply.excess) < 0.15 and np.mean(supply.excess) == pytest.approx(0.0, abs=1e-12)
    (gain,) = supply.drive()
    np.testing.assert_allclose(gain.applied(1e-4, 0.0, np.ones(8)), 1.0 + np.array(supply.excess))
    damping = VaryingFriction((0.1, -0.1)).machine(Hoist())
    np.testing.assert_allclose(vars(damping)["b"], np.array([34.1, 27.9]))


def test_a_closed_loop_follows_its_set_point() -> None:
    drawn = [MeasuredCase("pendulum", (), 1.0, seed) for seed in range(100)]
    looped = [any(isinstance(part, ClosedLoop) for part in case.chain) for case in drawn]
    cases = (drawn[looped.index(loop)] for loop in (True, False))
    closed, opened = (moved(case, short(case, 2.0)) for case in cases)
    assert np.max(np.abs(closed.u)) <= Pendulum().supply
    rough, smooth = (np.std(np.diff(run.u, axis=0)) for run in (closed, opened))
    assert rough > 3.0 * smooth  # counts reach the input


def test_cases_follow_their_seed_and_validation_has_other_motions(tmp_path: Path) -> None:
    case = MeasuredCase("hoist", BOTH, 1.0, 3)
    for name, seed in (("one", 3), ("two", 3), ("other", 4)):
        truth = write_measured(
            replace(case, seed=seed), tmp_path / name, short(replace(case, seed=seed), 0.4)
        )
    one, two, other = (files_of(tmp_path / name) for name in ("one", "two", "other"))
    assert one == two and one["system.yaml"] != other["system.yaml"]
    assert not set(truth["motions"]["logs"]) & set(truth["motions"]["validation"])
    system = read_system(tmp_path / "one" / "system.yaml")
    assert 6 <= len(read_logs(tmp_path / "one" / "logs", system)) <= 16
    assert len(read_logs(tmp_path / "one" / "validation", system)) == VALIDATION
    assert all(0.04 < abs(v["given"] / v["true"] - 1.0) < 0.21 for v in truth["parameters"].values())


@pytest.mark.long
def test_shares_tell_a_large_effect_from_a_small_one() -> None:
    seed = next(s for s in range(20) if 1 <= len(MeasuredCase("hoist", BOTH, 1.0, s).chain) <= 4)
    alone = MeasuredCase("hoist", BOTH[:1], 1.0, seed)
    found = shares(alone, short(alone, 1.0), moved(alone, short(alone, 1.0)))
    assert found.shares == (1.0,) and found.effects > 1e-3
    nothing = MeasuredCase("hoist", (), 1.0, seed)
    assert shares(nothing, short(nothing, 0.4), moved(nothing, short(nothing, 0.4))).effects < 1e-5
    both = MeasuredCase("hoist", BOTH, 1.0, seed)
    parts = shares(both, short(both, 1.0), moved(both, short(both, 1.0))).shares
    assert max(parts) >= MATERIAL and all(part > 0.0 for part in parts)


def test_kinds_of_cases() -> None:
    assert len(measured_cases("null", 60, 2000)) == 60
    singles = measured_cases("single", 80, 2000)
    families = {case.effects[0].family for case in singles}
    assert {case.effects[0].family for case in singles[: len(families)]} == families
    assert families | {case.effects[0].family for case in measured_cases("balance", 22, 2000)} == FAMILIES
    assert not any(case.effects for case in measured_cases("balance_null", 8, 2000))
    assert all(3 <= len(case.effects) <= 4 for case in measured_cases("several", 20, 2000))
    assert len(measured_cases("pair", 30, 2000)) == 30
    assert not {case.effects[0].family for case in measured_cases("outside", 16, 2000)} & FAMILIES
    one, again, other = (measured_cases("several", 5, seed) for seed in (1, 1, 2))
    assert one == again != other
    with pytest.raises(BadInput, match=r"counts\.outside: must be 1 to 16"):
        measured_cases("outside", 17, 0)


def test_machines_of_other_kinds_have_cases_of_their_own() -> None:
    names = {machine.name for machine in FURTHER}
    assert len(EVERY) == len({machine.name for machine in EVERY}) >= 24
    for kind, count in (("null", 15), ("single", 60), ("pair", 60), ("several", 15), ("outside", 15)):
        drawn = measured_cases(f"further_{kind}", count, 2000)
        sizes = {"null": {0}, "pair": {2}, "several": {3, 4}}.get(kind, {1})
        assert {case.system for case in drawn} <= names and {len(case.effects) for case in drawn} <= sizes


@pytest.mark.parametrize(
    ("kind", "count", "digest"),
    [
        ("null", 6, "e8e2fe35fa2e"),
        ("single", 8, "4d6bde82f912"),
        ("pair", 4, "336cc6c14e46"),
        ("several", 3, "7961e9c23a88"),
        ("outside", 3, "df303877c114"),
        ("balance_null", 4, "a4a1aa766c01"),
        ("balance", 8, "e76cf7adc9ca"),
    ],
)
def test_cases_of_published_rows_stay_the_same(kind: str, count: int, digest: str) -> None:
    drawn = [repr(measured_cases(kind, count, seed)) for seed in (7010, 7022, 7030)]
    assert hashlib.sha256("".join(drawn).encode()).hexdigest()[:12] == digest


def test_cases_without_a_chain_keep_their_bytes(tmp_path: Path) -> None:
    """The digest was computed before there were measurement chains."""
    case = Case("slider_crank", (Planted("linear_spring", "slider"),), 0.508, 544154749)
    write(case, tmp_path / "case", replace(case.plan(), samples=300))
    files = sorted(files_of(tmp_path / "case").items(), key=lambda file: Path(file[0]))
    digest = hashlib.sha256(b"".join(name.encode() + content for name, content in files))
    assert digest.hexdigest() == "1a3bfead8bb4726d95f135d754cbfa18f050d90cb78e6f9f65f9d25d9604b33e"
