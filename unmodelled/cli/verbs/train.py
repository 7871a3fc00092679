"""Train one model per fold and repeat of a split, all of them at once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodelled.base.files import replacing_folder
from unmodelled.base.ownership import verb
from unmodelled.learning.recipe import Recipe
from unmodelled.learning.splits import Split

#: What to do with the result (`unmodelled.cli.written`).
NEXT = "next: {program} evaluate fits={out} with the same keys"


@verb()
def train(
    system: Path | None,
    logs: Path | None,
    model: Recipe,
    split: Split,
    profile: Mapping[str, Any],
    start: Path | None,
    device: str,
    seed: int,
    out: Path,
) -> None:
    """Write the fitted models and `out`/fit.json (facts about the fit, such as folds, seed and duration).

    A hybrid model of a system (model=hybrid) needs `system` and `logs`. It writes `out`/model.pt (weights),
    `out`/system.yaml and `out`/history.parquet (loss and parameters after every epoch). What networks
    have learned whose inputs are the coordinates of their ports is written down as formulas:
    `out`/learned_system.yaml is the system with them, `out`/learned.json a summary, and `out`/index.html a
    page that simulates this system. A model of another
    kind carries the paths of its data (model.<key>=...) and takes neither; the docstring of its class
    describes its files.

    An interrupted training continues when the same command is started again.

    Args:
        system: system file.
        logs: log folder, or the store that ingest made of one.
        model: model and its training.
        split: division of the experiments into folds; a model sees the training experiments of its fold only.
        profile: numbers of models per fold, which differ in seed: `system_repeats` of models of a system,
            `repeats` of others.
        start: folder of a fit of the same model and split to continue from; null starts from scratch.
        device: cpu runs the compiled kernels; cuda (or another device of torch) the torch reference.
        seed: seed of the random generators.
        out: folder that is new, empty or was made by this verb; replaced as a whole for a hybrid model.

    Raises:
        BadInput: when the data are missing or too few, or do not suit the model.
    """
    if system is None or logs is None:  # models of other kinds refuse them
        model.train(system, logs, split, profile, start, device, seed, out)
        return
    # by its public name: a change of pages repeats no training
    import unmodelled as um

    with replacing_folder(out) as new:
        model.train(system, logs, split, profile, start, device, seed, new)
        fit = um.Fit.load(new)
        found = um.learned_laws(fit, um.read_logs(logs, fit.system))
        print(found)
        if found.laws:
            found.save(new)
    from unmodelled.learning.resume import checkpoint_beside  # loads torch

    checkpoint_beside(out).unlink(missing_ok=True)
