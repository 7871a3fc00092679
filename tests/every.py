"""One test of many cases, which are made as it runs, and of which all that fail are named."""

from collections.abc import Callable, Iterable
from typing import TypeVar

T = TypeVar("T")


def check_each(cases: Iterable[T], check: Callable[[T], None]) -> None:
    """Check every case, and raise all errors together."""
    count, errors = 0, []
    for case in cases:
        count += 1
        try:
            check(case)
        except Exception as error:
            error.add_note(f"case: {case}")
            errors.append(error)
    assert count
    if errors:
        raise ExceptionGroup(f"{len(errors)} of {count} cases", errors)


def every(find: Callable[[], Iterable[T]]) -> Callable[[Callable[[T], None]], Callable[[], None]]:
    """Make one test of a test of a case."""

    def decorate(test: Callable[[T], None]) -> Callable[[], None]:
        def run() -> None:
            check_each(find(), test)

        run.__doc__ = test.__doc__
        return run

    return decorate
