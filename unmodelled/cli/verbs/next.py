"""Design the experiment that tells the effects of an answer apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from unmodelled.base.ownership import verb


@verb()
def next(
    system: Path | None, logs: Path | None, answer: Path, limits: Path, out: Path, seed: int = 0
) -> None:
    """Write the experiment that tells the named effects from those that the logs cannot distinguish.

    If the answer lists no such effects, the experiment narrows the intervals of the effects' numbers; without
    effects, those of the refitted parameters.

    `out` holds `experiment.csv` (t and the inputs, in the units of their columns), `next.json` (the odds of
    this experiment, of a chirp and of random levels, and what every model predicts), the table `predictions`
    and the figure `next_experiment.svg`.

    Args:
        system: system file of the diagnosis; null: where the answer found it.
        logs: log folder of the diagnosis; null: where the answer found it.
        answer: folder of the diagnosis, with diagnosis.json.
        limits, seed: see `unmodelled.api.next_experiment.next_experiment`.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the system file, the logs, the answer, the limits or the seed cannot be used, when the
            system file or the logs have moved, or when no experiment keeps the limits.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.diagnosis import read_answer
    from unmodelled.api.next_experiment import next_experiment

    found = read_answer(answer)
    proposal = next_experiment(replace(found, given=found.inputs(system, logs)), limits, seed)
    proposal.save(out)
    print(proposal)
