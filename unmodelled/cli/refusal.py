"""Print the faults of an input."""

from __future__ import annotations

import sys
import traceback

from unmodelled.base import workers
from unmodelled.base.errors import BadInput
from unmodelled.cli.colour import coloured

#: Faults of one input that are shown.
FAULTS = 20


def refuse(error: BadInput) -> int:
    """Print the first fault after `error: ` and the others after `also: `."""
    if workers.interrupted.is_set():
        raise KeyboardInterrupt
    count = len(error.others)
    more = f" ({count} more {'fault' if count == 1 else 'faults'} below)" if count else ""
    also = [f"also: {other}" for other in error.others[: FAULTS - 1]]
    rest = [f"... and {count - len(also)} more"] if count > len(also) else []
    print(coloured("\n".join([f"error: {error}{more}", *also, *rest]), sys.stderr), file=sys.stderr)
    return 2


def modules_of(error: BaseException) -> set[str]:
    """Return the modules of all functions that an exception has left."""
    return {str(frame.f_globals["__name__"]) for frame, _ in traceback.walk_tb(error.__traceback__)}


def raised_in(error: BaseException) -> str:
    """Return the module and the function in which an exception was raised, as a dotted name."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    frame = None if trace is None else trace.tb_frame
    return "" if frame is None else f"{frame.f_globals['__name__']}.{frame.f_code.co_qualname}"
