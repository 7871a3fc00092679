"""Design the experiment that tells the effects of an answer apart."""

from __future__ import annotations

from pathlib import Path

from unmodelled.api.next_experiment import planned
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.base.ownership import verb
from unmodelled.diagnosis.answer.summary import SCHEMA
from unmodelled.diagnosis.fitting.checks import check_seed
from unmodelled.logs.inputs import read_inputs


@verb()
def next(system: Path, logs: Path, answer: Path, limits: Path, out: Path, seed: int = 0) -> None:
    """Write the experiment that tells the named effects from those that the logs cannot distinguish.

    If the answer lists no such effects, the experiment narrows the intervals of the effects' numbers; without
    effects, those of the refitted parameters.

    `out` holds `experiment.csv` (t and the inputs, in the units of their columns), `next.json` (the odds of
    this experiment, of a chirp and of random levels, and what every model predicts), the table `predictions`
    and the figure `next_experiment.svg`.

    Args:
        system: system file of the diagnosis.
        logs: log folder of the diagnosis.
        answer: folder of the diagnosis, with diagnosis.json.
        limits: YAML file with `duration` (s), `inputs` (`low`, `high`, `rate` per second) and, as needed,
            `travel` (`low`, `high`, `speed` of states, outputs or signals), `start`, `operating_point` and
            `period` (s);
            all in the units of the columns in the system file (mA, degC, %), rates per second.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        seed: seed of the search; the same seed gives the same files.

    Raises:
        BadInput: when the system file, the logs, the answer, the limits or the seed cannot be used, or no
            experiment keeps the limits.
    """
    check_seed(seed)
    file = answer / "diagnosis.json"
    found = read_json(file)
    if not isinstance(found, dict) or found.get("schema") != SCHEMA:
        raise BadInput(f"{file}: is no answer of this version (schema {SCHEMA}): diagnose again")
    proposal = planned(*read_inputs(system, logs), found, limits, seed)
    proposal.save(out)
    print(proposal)
