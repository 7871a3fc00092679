"""Results of chapter 5 that several tests look at."""

from pathlib import Path

import pytest

from tests.browser import browser as browser
from tests.stages.jump_stages import CELLS, attribute, evaluate, tabulate, train
from unmodelled.base.campaign import Campaign


@pytest.fixture(scope="session")
def root(jump_campaign: Campaign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with features, fits, predictions, attributions, tables and reports."""
    root = tmp_path_factory.mktemp("jumps")
    jump_campaign.write(root / "features")
    for split, model in CELLS.items():
        train(root, model, split)
        evaluate(root, model, split)
    attribute(root)
    tabulate(root)
    return root
