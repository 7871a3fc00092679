"""Choose the explained runs and the reference runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.arrays import Indices
from unmodelled.base.errors import BadInput


@dataclass(frozen=True)
class Choice:
    """Randomly chosen rows of the table of experiments.

    Attributes:
        runs: jump runs to explain, which were not trained on, shape (runs,).
        references: contact runs that were trained on, the longest first, because every step of a run needs a
            reference of this length, shape (references,).
        exact_runs: subset of `runs` that is also explained exactly, shape (exact runs,).
        exact_references: subset of `references` for the exact explanation, shape (exact references,).
    """

    runs: Indices
    references: Indices
    exact_runs: Indices
    exact_references: Indices

    @classmethod
    def of(
        cls, experiments: pd.DataFrame, train: Indices, test: Indices, sizes: Mapping[str, Any], seed: int
    ) -> Choice:
        """Draw runs and references.

        Takes train (training experiments,), test (test experiments,).
        """
        label = experiments["label"].to_numpy()
        jumps, contact = test[label[test] == "jump"], train[label[train] == "contact"]
        for name, rows in (("jump run among the test runs", jumps), ("contact run to refer to", contact)):
            if not len(rows):
                raise BadInput(f"there is no {name}")
        generator = np.random.default_rng(seed)
        longest = contact[np.argmax(experiments["samples"].to_numpy()[contact])]
        others = generator.permutation(contact[contact != longest])
        runs = generator.permutation(jumps)[: sizes["explained_runs"]]
        references = np.array([longest, *others])[: sizes["references"]]
        return cls(runs, references, runs[: sizes["exact_runs"]], references[: sizes["exact_references"]])
