"""Write a small example: a system file that leaves something out, and logs of its machine."""

from __future__ import annotations

from pathlib import Path

from unmodelled.base.ownership import verb

#: What comes next.
NEXT = "next: {program} diagnose system={out}/{name}.yaml logs={out}/logs"


@verb()
def example(name: str, out: Path) -> None:
    """Write the files of an example, to try the commands on: a system file and logs, which are simulated.

    `example pendulum` is short for `example name=pendulum`.

    Args:
        name: pendulum (its system file leaves out the dry friction of the joint) or flywheel (a brake whose
            torque differs from experiment to experiment).
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when there is no such example.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.example import write_example

    write_example(name, out)
