"""One test of many cases, which are made as it runs, and of which all that fail are named."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

T = TypeVar("T")


def every(find: Callable[[], Iterable[T]]) -> Callable[[Callable[[T], None]], Callable[[], None]]:
    """Make one test of a test of a case."""

    def decorate(test: Callable[[T], None]) -> Callable[[], None]:
        def run() -> None:
            count, errors = 0, []
            for case in find():
                count += 1
                try:
                    test(case)
                except Exception as error:
                    error.add_note(f"case: {case}")
                    errors.append(error)
            assert count
            if errors:
                raise ExceptionGroup(f"{len(errors)} of {count} cases", errors)

        run.__doc__ = test.__doc__
        return run

    return decorate
