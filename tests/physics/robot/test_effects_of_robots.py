"""Every effect at the joints, actuators and parameters of a robot is written and read back."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from tests.physics.effects.benches import arm, arm_scales
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.motion import is_inertial
from unmodelled.engine.machine.program import Program
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system


@pytest.mark.parametrize("effect", effects(), ids=lambda e: "-".join(filter(None, (e.family, e.variant))))
def test_the_arm_with_an_effect_is_written_and_read_back(effect: Effect, tmp_path: Path) -> None:
    for place in islice(effect.places(arm()), 2):
        added = effect.add(arm(), place, arm_scales())
        write_system(added.system, tmp_path / "grown.yaml")
        again = read_system(tmp_path / "grown.yaml")
        assert [*map(str, again.dynamics)] == [*map(str, added.system.dynamics)]


def test_an_inertia_at_a_joint_adds_to_the_mass_that_the_joint_feels() -> None:
    assert all(is_inertial(arm(), port) for port in arm().ports)
    effect = next(e for e in effects() if (e.family, e.variant) == ("inertia_error", ""))
    (place,) = (p for p in effect.places(arm()) if p.name == "elbow")
    added = effect.add(arm(), place, arm_scales())
    (dM,) = added.amplitudes
    grown = added.system.with_values({dM: 0.02})
    larger = arm().with_values({"elbow_armature": 0.01 + 0.02})
    x, u = np.array([0.3, -0.4, 0.8, 1.0, -2.0, 0.5]), np.array([0.4, 1.0, 0.3])
    found, wanted = (
        Program.of(s, s.dynamics).evaluate(np.zeros(()), x, u, np.array(s.values), np.empty(0))
        for s in (grown, larger)
    )
    assert found == pytest.approx(wanted, rel=1e-10)
