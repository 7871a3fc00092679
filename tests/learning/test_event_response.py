"""Event times at the operating points of measured experiments."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.rigs import clutch
from pipeline.rigs.clutch import ClutchCampaign
from unmodelled.learning.uncertainty.event_response import event_response, inputs, same_starts
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[2] / "systems"
UNCERTAIN = ("p_hc0", "z_p")
Truth = dict[str, dict[str, list[float]]]


class TwoProfiles(ClutchCampaign):
    """The twelve engagements with the ninth and the tenth profile."""

    def table(self) -> pd.DataFrame:
        return super().table().iloc[48:60]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[Logs, System, Truth]:
    """Logs, the last of which ends after 0.4 s, and what the bench knows of them."""
    folder = tmp_path_factory.mktemp("bench") / "logs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clutch, "PERIOD", 0.002)
        TwoProfiles().write(folder, 5)
    pd.read_csv(folder / "E60.csv").iloc[:201].to_csv(folder / "E60.csv", index=False)
    system = read_system(SYSTEMS / "clutch.yaml")
    return read_logs(folder, system), system, json.loads((folder / "bench.json").read_text())


def test_times_of_the_bench(bench: tuple[Logs, System, Truth]) -> None:
    """At the theta of each engagement: that one comes out, whatever the others."""
    logs, system, truth = bench
    found = event_response(system, "shift", UNCERTAIN, logs, 0.004)
    assert [len(same.members) for same in found.inputs] == [6, 6]
    own = np.diag(found(np.array([truth["theta"][name] for name in logs.ids])))
    expected = np.array([truth["shifting_time"][name] for name in logs.ids])
    assert logs.ids[-1] == "E60"
    assert expected[-1] > 0.4
    assert np.isnan(own[-1])
    # the measured start of the shafts is noisy
    np.testing.assert_allclose(own[:-1], expected[:-1], rtol=0.0, atol=3e-3)


def test_a_log_that_ends_goes_on_like_one_that_begins_alike(bench: tuple[Logs, System, Truth]) -> None:
    logs, _, _ = bench
    u, group = inputs(logs)
    np.testing.assert_array_equal(group, np.repeat([0, 1], 6))
    np.testing.assert_array_equal(u[11], u[10])
    np.testing.assert_array_equal(u[0], logs.u[logs.rows(0)])
    other = replace(logs, u=logs.u.copy())
    other.u[logs.offsets[11]] += 0.1
    u, group = inputs(other)
    np.testing.assert_array_equal(group, [0] * 6 + [1] * 5 + [2])
    assert set(u[11, 200:, 0]) == {other.u[-1, 0]}


def test_starts_that_differ_by_noise_are_one() -> None:
    group, start = np.array([0, 0, 0, 1, 1, 2]), np.array([1.0, 1.2, 1.1, 3.0, 5.0, 7.0])
    np.testing.assert_allclose(same_starts(group, start, 0.1), [1.1, 1.1, 1.1, 3.0, 5.0, 7.0])
    assert len(set(same_starts(group, start, 0.1)[:3])) == 1
    np.testing.assert_array_equal(same_starts(group, start, 0.0), start)
