"""Networks this small are slower on several threads."""

from collections.abc import Iterator

import pytest

from unmodelled.base.threads import one_thread


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    with one_thread():
        yield
