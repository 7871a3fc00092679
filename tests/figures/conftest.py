"""The made-up data of the CHAPTER that a file of tests has."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from unmodelled.report.figures.style import style


@pytest.fixture(autouse=True)
def _styled() -> Iterator[None]:
    """As the stage `draw` calls figures."""
    with style():
        yield


@pytest.fixture(scope="module")
def content(request: pytest.FixtureRequest) -> Any:
    return request.module.CHAPTER.make()


@pytest.fixture(scope="module")
def folder(request: pytest.FixtureRequest, content: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return request.module.CHAPTER.write(tmp_path_factory.mktemp("data"), content)
