"""Choose runs to explain and runs to refer to, and tabulate attributions of chapter 5."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.attribution.deep_shap import deep_shap
from pipeline.attribution.exact import exact_shapley
from pipeline.attribution.result import Attribution, agreement, players, relative_shares
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import Sequences
from unmodelled.base.arrays import Indices
from unmodelled.base.errors import BadInput


@dataclass(frozen=True)
class Choice:
    """Randomly chosen rows of the table of experiments."""

    runs: Indices  # (runs,), jump runs to explain, which were not trained on
    #: (references,), contact runs that were trained on, the longest first: no run has steps without reference
    references: Indices
    exact_runs: Indices  # (exact runs,), subset of `runs` that is also explained exactly
    exact_references: Indices  # (exact references,), subset of `references` for the exact explanation

    @classmethod
    def of(
        cls, experiments: pd.DataFrame, train: Indices, test: Indices, sizes: Mapping[str, Any], seed: int
    ) -> "Choice":
        """Draw runs and references. Takes train (training experiments,), test (test experiments,)."""
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


def run_shares(found: Sequence[Attribution]) -> pd.DataFrame:
    """Return the contribution of every input per run."""
    sizes = np.concatenate([a.magnitudes for a in found])
    totals = np.repeat([a.magnitudes.sum() for a in found], len(found[0].names))
    shares = np.divide(sizes, totals, out=np.zeros_like(sizes), where=totals > 0)
    runs = np.repeat([a.run for a in found], len(found[0].names))
    names = [name for a in found for name in a.names]
    return pd.DataFrame({"exp": runs, "feature": names, "magnitude": sizes, "share": shares})


def overall_shares(found: Sequence[Attribution]) -> pd.DataFrame:
    """Return the share of every input in the sum of |Phi| over all steps and runs (Fig. 5.23)."""
    shares = relative_shares(found)
    return pd.DataFrame({"feature": [*shares], "share": [*shares.values()]})


def accuracies(found: Sequence[Attribution]) -> pd.DataFrame:
    """Return the local accuracy of every run, eq. 5.17."""
    rows = [(a.run, len(a.error), a.error.max(), a.relative_error) for a in found]
    return pd.DataFrame(rows, columns=["exp", "steps", "error", "relative"])


def trajectories(found: Sequence[Attribution]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the attributions over time (Fig. 5.22)."""
    phi, explained = [], []
    for a in found:
        step = np.arange(len(a.output))
        explained.append(pd.DataFrame({"exp": a.run, "step": step, "base": a.base, "output": a.output}))
        phi += [
            pd.DataFrame({"exp": a.run, "step": step, "feature": name, "phi": own})
            for name, own in zip(a.names, a.phi, strict=True)
        ]
    return pd.concat(phi, ignore_index=True), pd.concat(explained, ignore_index=True)


def points(found: Sequence[Attribution], runs: Sequences, every: int) -> pd.DataFrame:
    """Return contributions with the values of the inputs, for `explanation`."""
    parts = []
    for row, a in enumerate(found):
        steps = np.arange(0, len(a.output), every)
        settings = np.broadcast_to(runs.settings[row], (len(steps), runs.settings.shape[1]))
        values = np.concatenate([runs.features[row, steps], settings], axis=1)
        parts += [
            pd.DataFrame(
                {"exp": a.run, "step": steps, "feature": name, "phi": a.phi[j, steps], "value": values[:, j]}
            ).assign(base=a.base[steps])
            for j, name in enumerate(a.names)
        ]
    return pd.concat(parts, ignore_index=True)


def against_exact(
    network: DetachmentNetwork, runs: Sequences, background: Sequences, groups: Mapping[str, Sequence[str]]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare DeepSHAP with exact Shapley values."""
    names = (*network.inputs.features, *network.inputs.settings)
    groups = players(names, groups)
    exact = exact_shapley(network, runs, background, groups)
    # the exact values put players of signals before those of settings
    ordered = {name: groups[name] for name in exact[0].names}
    found = [a.grouped(ordered) for a in deep_shap(network, runs, background)]
    both = [run_shares(found).assign(method="deep_shap"), run_shares(exact).assign(method="exact")]
    same = agreement(found, exact)
    correlations = {"shares": same.shares, "trajectories": same.trajectories}
    return pd.concat(both, ignore_index=True), pd.DataFrame({"exp": runs.runs, **correlations})
