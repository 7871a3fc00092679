"""Examples of everything that is read, made once."""

import pytest

from tests.fuzz.inputs import Case
from tests.fuzz.readers import archive_cases, checkpoint_cases, plain_cases, recorder_cases
from unmodelled.base.campaign import Campaign


@pytest.fixture
def little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with little memory left, and processes that know."""
    monkeypatch.setattr("unmodelled.base.limits._allowed", lambda left: 5e7)
    monkeypatch.setattr("unmodelled.base.workers.get_start_method", lambda allow_none: "fork")


@pytest.fixture(scope="session")
def cases(
    tmp_path_factory: pytest.TempPathFactory, small_campaign: Campaign, jump_campaign: Campaign
) -> dict[str, Case]:
    names = ("plain", "recorders", "archives", "fits")
    plain, recorders, archives, fits = (tmp_path_factory.mktemp(name) for name in names)
    return {
        **plain_cases(plain),
        **recorder_cases(recorders),
        **archive_cases(archives),
        **checkpoint_cases(fits, small_campaign, jump_campaign),
    }
