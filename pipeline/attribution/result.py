"""Attributions of predictions to inputs, and to groups of inputs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import spearmanr

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput


def positions(names: Sequence[str], groups: Mapping[str, Sequence[str]]) -> dict[str, list[int]]:
    """Return the positions of the members of every group."""
    found: dict[str, list[int]] = {}
    owner: dict[str, str] = {}
    for group, members in groups.items():
        if not members:
            raise BadInput(f"groups: {group} is empty")
        for name in members:
            if name not in names:
                raise BadInput(f"groups: {group} names {name}, the network reads {', '.join(names)}")
            if name in owner:
                raise BadInput(f"groups: {name} is in {owner[name]} and in {group}")
            owner[name] = group
        found[group] = [names.index(name) for name in members]
    left = [name for name in names if name not in owner]
    if left:
        raise BadInput(f"groups: {left[0]} is in no group")
    return found


def players(names: Sequence[str], groups: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the groups that are complete, and every other name as a group of its own."""
    whole = {group: list(members) for group, members in groups.items() if set(members) <= set(names)}
    grouped = {member for members in whole.values() for member in members}
    return whole | {name: [name] for name in names if name not in grouped}


@dataclass(frozen=True)
class Attribution:
    """Contribution of every input to the prediction of one run, eq. 5.13 and 5.22."""

    run: int
    names: tuple[str, ...]  # features and settings, or groups of them
    phi: Array  # (names, steps), contributions Phi_{i,k}, m
    base: Array  # (steps,), mean output over the background Phi_{0,k}, m
    output: Array  # (steps,), output of the network, m

    @property
    def error(self) -> Array:
        """Distance (steps,) of output and sum of base and attributions, m: local accuracy of eq. 5.17."""
        return np.asarray(np.abs(self.base + self.phi.sum(0) - self.output))

    @property
    def relative_error(self) -> float:
        """Largest error divided by the largest |output - base|, or the error itself if they are equal."""
        scale = float(np.abs(self.output - self.base).max())
        return float(self.error.max()) / scale if scale else float(self.error.max())

    @property
    def magnitudes(self) -> Array:
        """Sum of |Phi| over the steps, m, shape (names,)."""
        return np.asarray(np.abs(self.phi).sum(1))

    def grouped(self, groups: Mapping[str, Sequence[str]]) -> "Attribution":
        """Add up the attributions of every group."""
        members = positions(self.names, groups)
        phi = np.stack([self.phi[rows].sum(0) for rows in members.values()])
        return replace(self, names=tuple(members), phi=phi)


def relative_shares(attributions: Sequence[Attribution]) -> dict[str, float]:
    """Return the share of every input in the sum of |Phi| over all steps and runs (Fig. 5.23)."""
    _check_names(attributions)
    total = np.sum([a.magnitudes for a in attributions], axis=0)
    shares = total / total.sum() if total.any() else total
    return dict(zip(attributions[0].names, map(float, shares), strict=True))


@dataclass(frozen=True)
class Agreement:
    """Spearman's rank correlations of two methods; nan if one method gives the same value everywhere."""

    shares: Array  # (runs,), correlation of the inputs' shares in every run
    trajectories: Array  # (runs,), correlation of Phi at all inputs and steps of every run


def agreement(found: Sequence[Attribution], reference: Sequence[Attribution]) -> Agreement:
    """Return the rank correlations of two methods on the same runs."""
    _check_names([*found, *reference])
    if [(a.run, a.phi.shape) for a in found] != [(b.run, b.phi.shape) for b in reference]:
        raise ValueError("attributions to compare must be of the same runs, in the same order")
    pairs = [*zip(found, reference, strict=True)]
    shares = [_rank_correlation(a.magnitudes, b.magnitudes) for a, b in pairs]
    trajectories = [_rank_correlation(a.phi.ravel(), b.phi.ravel()) for a, b in pairs]
    return Agreement(np.array(shares), np.array(trajectories))


def _check_names(attributions: Sequence[Attribution]) -> None:
    if len({a.names for a in attributions}) != 1:
        raise ValueError("attributions to put together must be of the same inputs, and at least one")


def _rank_correlation(a: Array, b: Array) -> float:
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return float("nan")
    return float(spearmanr(a, b).statistic)
