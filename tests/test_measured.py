"""What is known about the measured data set, reproduced from its raw logs."""

from pathlib import Path

import pytest

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.chapters.boundary import measured
from pipeline.chapters.summary import labels
from pipeline.recordings.fetch import PublicDataSet
from pipeline.stages.acquire import acquire
from pipeline.stages.featurize import featurize
from pipeline.stages.ingest import ingest
from unmodelled.base.campaign import Campaign

pytestmark = pytest.mark.measured


@pytest.fixture(scope="module")
def features(dataset_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    folder, mechanism = tmp_path_factory.mktemp("measured"), CamFollower()
    acquire(PublicDataSet("-", "-", str(dataset_path)), 0, folder / "raw")
    ingest(folder / "raw", None, mechanism, 2, folder / "trajectories")
    featurize(folder / "trajectories", mechanism, 0.01, folder / "features")
    return Campaign.read(folder / "features", ["t"])


def test_labels(features: Campaign) -> None:
    """Section 6.5: 754 nominal trajectories."""
    found = labels(features.experiments)
    counts = {k: found[k]["value"] for k in ("stall", "jump", "contact")}
    assert counts == {"stall": 95, "jump": 751, "contact": 754}


def test_f_dagger_separates_contact_from_jump(features: Campaign) -> None:
    """Fig. 5.11, with a threshold of zero and nothing fitted."""
    assert labels(features.experiments)["f_dagger"]["accuracy"]["value"] >= 0.985


def test_seventy_two_settings_have_a_boundary(features: Campaign) -> None:
    assert len(measured(features.experiments, CamFollower().jump_share)) == 72
