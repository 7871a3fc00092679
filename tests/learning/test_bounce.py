"""Planted parameters are found again, and test runs play no part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.cam_follower.bounce import BounceParameters, CamMotion, simulate
from pipeline.cam_follower.bounce_fitting import fit_bounce
from pipeline.cam_follower.cam_follower import CamFollower
from tests.learning.bounce_runs import PARAMETERS, campaign, turning
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput

BENCH = CamFollower()


def measured() -> Campaign:
    """Runs whose follower moves as the simulation says."""
    runs = campaign([turning(speed) for speed in (22.0, 24.0, 26.0, 28.0, 30.0, 32.0, 25.0, 27.0)])
    eps = simulate(CamMotion.of(runs, BENCH), PARAMETERS).eps
    return replace(runs, signals={**runs.signals, "eps": eps})


TRAIN = np.arange(6)


def friction(parameters: BounceParameters, speed: float) -> float:
    return parameters.guide_coulomb + parameters.guide_viscous * speed


def test_planted_parameters_are_found_again() -> None:
    found = fit_bounce(measured(), TRAIN, BENCH)
    assert found.restitution == pytest.approx(PARAMETERS.restitution, rel=0.03)
    # over the speeds of short falls the two kinds of friction can hardly be told apart
    assert friction(found, 0.3) == pytest.approx(friction(PARAMETERS, 0.3), rel=0.02)
    assert found.contact_compliance == pytest.approx(PARAMETERS.contact_compliance, rel=0.2)
    assert found.shaft_compliance == pytest.approx(PARAMETERS.shaft_compliance, rel=0.2)


def test_test_runs_play_no_part() -> None:
    runs = measured()
    spoilt = {name: np.where(np.arange(800) < 600, x, np.nan) for name, x in runs.signals.items()}
    first, second = (fit_bounce(r, TRAIN, BENCH) for r in (runs, replace(runs, signals=spoilt)))
    assert first == second


def test_runs_without_jumps_teach_nothing() -> None:
    with pytest.raises(BadInput, match="the follower never leaves the cam in the 2 training runs"):
        fit_bounce(campaign([turning(5.0), turning(6.0)]), np.arange(2), BENCH)


def test_a_detachment_that_is_no_number_is_refused() -> None:
    runs = measured()
    eps = np.where(np.arange(800) == 207, np.nan, runs.signals["eps"])
    with pytest.raises(BadInput, match="experiment 3: eps is not a finite number at sample 7"):
        fit_bounce(replace(runs, signals={**runs.signals, "eps": eps}), TRAIN, BENCH)
