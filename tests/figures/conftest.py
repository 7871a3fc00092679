"""The made-up data of the CHAPTER that a file of tests has."""

from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="module")
def content(request: pytest.FixtureRequest) -> Any:
    return request.module.CHAPTER.make()


@pytest.fixture(scope="module")
def folder(request: pytest.FixtureRequest, content: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return request.module.CHAPTER.write(tmp_path_factory.mktemp("data"), content)
