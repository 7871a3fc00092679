"""A search proposes the best of all experiments that it has seen, those that it is compared with included."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from tests.machines.folders import Array
from unmodelled.design.criterion import Criterion
from unmodelled.design.limits import Limits, Range
from unmodelled.design.search import best_experiment
from unmodelled.design.signals import references

WRITTEN = (Range(-3.0, 5.0, 400.0), Range(-1.0, 1.0))
LIMITS = Limits(Path("limits.yaml"), 2.0, 0.02, WRITTEN, WRITTEN, {}, {}, {}, {})


@dataclass(frozen=True)
class Needle:
    """A criterion that one experiment alone meets, so that no search finds it by chance."""

    target: Array
    limits: Limits = LIMITS

    def __call__(self, u: Array) -> Array:
        return u

    def scores(self, u: Array) -> Array:
        return np.asarray(np.where(np.abs(u - self.target).max(axis=(1, 2)) < 1e-9, 1.0, 0.1))


@pytest.mark.parametrize("amplitude", [0, 5])
@pytest.mark.parametrize("reference", ["chirp", "random"])
def test_no_proposal_is_worth_less_than_what_it_is_compared_with(
    reference: str, amplitude: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("unmodelled.design.search.GENERATIONS", 1)
    monkeypatch.setattr("unmodelled.design.search.REFINED", 1)
    target = references(LIMITS, 4)[reference][amplitude]
    found = best_experiment(cast(Criterion, cast(Any, Needle(target))), 4, lambda _: None)
    assert found.score == 1.0
    np.testing.assert_allclose(found.u, target, atol=1e-9)
