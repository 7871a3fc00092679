"""A fault of the logs, as a diagnosis tells it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LogFault:
    """A fault of the logs.

    Attributes:
        channels: names of the outputs and inputs that have it, `t` for time, `experiments` for whole logs.
        problem: its name, such as "degrees" or "sign". explains: share of the mean square error of the known
            physics that its correction takes away; None where it is not about the error.
        experiments: ids of those that have it; () for all.
        sentence: what is seen, and what to do.
        decides: whether it is the answer to a diagnosis.
        indistinguishable: channels and problem of other faults that explain as much.
    """

    channels: tuple[str, ...]
    problem: str
    explains: float | None
    experiments: tuple[str, ...]
    sentence: str
    decides: bool
    indistinguishable: tuple[tuple[tuple[str, ...], str], ...] = ()
