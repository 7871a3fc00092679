"""Which runs are explained, and what they are a contrast to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Choice:
    """Rows of the experiments table, drawn at random.

    Attributes:
        runs: jump runs to explain, that were not trained on.
        references: contact runs that were trained on; first the longest, since every step of a run needs a
            reference that lasts as long.
        exact_runs: subsets of the two that are explained exactly too.
        exact_references: subsets of the two that are explained exactly too.
    """

    runs: Indices
    references: Indices
    exact_runs: Indices
    exact_references: Indices

    @classmethod
    def of(
        cls, experiments: pd.DataFrame, train: Indices, test: Indices, sizes: Mapping[str, Any], seed: int
    ) -> Choice:
        """Draw them.

        Args:
            experiments: table of the experiments, with columns `label` and `samples`.
            train: rows of the experiments that a fold trains on, and that it tests on.
            test: rows of the experiments that a fold trains on, and that it tests on.
            sizes: `explained_runs`, `references`, `exact_runs` and `exact_references`: at most so many.

        Raises:
            BadInput: when there is no such run.
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
