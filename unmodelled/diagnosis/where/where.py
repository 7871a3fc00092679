"""The place of the gap: its channels, regions of their coordinates, factors and experiments."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.where.channel_rules import unexplained_shares
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.effect_channels import channel_shares
from unmodelled.diagnosis.where.regions import regions
from unmodelled.logs.preparation import prepare

#: Share of a channel that has regions and figures, at least [share of the gap].
SHOWN_CHANNEL_SHARE = 0.2
#: Share of a channel that is listed, at least [share of the gap].
LEAST_GAP_SHARE = 0.005
#: Density of a level of a factor, at least [share of the gap per share of the samples].
FACTOR_DENSITY = 1.3
#: Probability of a level's share by chance, at most (permutation test) [probability].
FACTOR_SIGNIFICANCE = 0.02

Rows = tuple[dict[str, Any], ...]

#: Random permutations of the experiments from which the probability of a level's share is estimated.
PERMUTATIONS = 4000


@dataclass(frozen=True, eq=False)
class Where:
    """The place of the gap, as in diagnosis.json, largest shares first."""

    channels: Rows  # port (see `effect_channels.channel_of`), share of the squared gap above the floor
    regions: Rows  # signal, low, high (SI), share of the squared correction at the largest channel
    factors: Rows  # factor, level, share of the re-identified model's squared gap above the floor
    experiments: Rows  # id, known, augmented: gaps of every experiment
    lacking: Corrections  # of the physics without effects, with the parameters of the augmented model
    left: Corrections  # of the augmented model
    every: ExperimentGaps


def where(diagnosis: Diagnosis) -> Where:
    """Locate the gap; no channels, regions or factors where there is none or the logs must be checked."""
    physics = _physics(diagnosis)
    sensors = Sensors(diagnosis.logs)
    lacking = Corrections.of(physics, diagnosis.horizon, sensors)
    left = lacking
    if diagnosis.effects:
        left = Corrections.of(diagnosis.augmented, diagnosis.horizon, sensors)
    every, gap = ExperimentGaps.of(diagnosis, sensors), diagnosis.verdict not in ("no_gap", "check_logs")
    remaining = unexplained_shares(left) if gap and _remains(diagnosis) else {}
    found = channel_shares(diagnosis, remaining) if gap else {}
    much = tuple(
        name for name, share in found.items() if share >= min(SHOWN_CHANNEL_SHARE, max(found.values()))
    )
    samples = np.diff(diagnosis.logs.offsets).astype(np.float64)
    columns = (*(c.name for c in diagnosis.system.operating_point), "group")
    excess = every.reidentified**2 - every.floor**2
    table = diagnosis.logs.experiments
    return Where(
        channels=tuple(
            {"port": name, "share": share} for name, share in found.items() if share >= LEAST_GAP_SHARE
        ),
        regions=regions(lacking, much),
        factors=factors(table, columns, excess, samples, diagnosis.seed) if gap else (),
        experiments=tuple(
            {"id": name, "known": float(known), "augmented": float(augmented)}
            for name, known, augmented in zip(diagnosis.logs.ids, every.known, every.augmented, strict=True)
        ),
        lacking=lacking,
        left=left,
        every=every,
    )


def _remains(diagnosis: Diagnosis) -> bool:
    """Whether the augmented model leaves enough of the gap to locate it."""
    before, after, floor = (
        value**2
        for value in (diagnosis.reidentified.gap.value, diagnosis.augmented.gap.value, diagnosis.floor)
    )
    return after - floor > LEAST_GAP_SHARE * (before - floor)


def _physics(diagnosis: Diagnosis) -> JudgedModel:
    """The physics without effects, with the parameters that go with the effects."""
    base, augmented = diagnosis.reidentified, diagnosis.augmented.system
    values = dict(zip((p.name for p in augmented.parameters), augmented.values, strict=True))
    own = {p.name: values[p.name] for p in base.system.parameters if p.name in values}
    system = base.system.with_values(own)
    return replace(base, system=system, logs=prepare(system, base.logs))


@dataclass(frozen=True, eq=False)
class ExperimentGaps:
    """Gaps of every experiment, in standard deviations of the outputs over all experiments."""

    known: Array  # (experiments,)
    reidentified: Array  # (experiments,)
    augmented: Array  # (experiments,)
    floor: Array  # of the augmented model, (experiments,)

    @classmethod
    def of(cls, diagnosis: Diagnosis, sensors: Sensors) -> ExperimentGaps:
        """Compute the gaps by free runs of all models over all experiments."""
        found = []
        for model in (diagnosis.known, diagnosis.reidentified, diagnosis.augmented):
            found.append(free_runs(model.system, model.logs, diagnosis.horizon, sensors=sensors))
        each = [*(gap.per_experiment for gap in found), found[-1].floors]
        return cls(*(np.array([values[i] for i in diagnosis.logs.ids]) for values in each))


def factors(
    experiments: pd.DataFrame,
    columns: tuple[str, ...],
    excess: Array,
    samples: Array,
    seed: int,
) -> tuple[dict[str, Any], ...]:
    """Return levels whose share of `excess` (experiments,) is clearly larger than that of `samples`.

    The probability of such a share by chance comes from random permutations of the experiments. A column is
    left out where all experiments have one level, or each its own.
    """
    amount = np.maximum(excess, 0.0) * samples
    whole = float(amount.sum())
    if whole <= 0.0:
        return ()
    dealt = (
        np.random.default_rng([seed, 1]).permuted(np.tile(amount / samples, (PERMUTATIONS, 1)), axis=1)
        * samples
    )
    found = []
    for name in columns:
        if name not in experiments or not 1 < experiments[name].nunique() < len(experiments):
            continue
        for level in experiments[name].drop_duplicates().tolist():
            member = (experiments[name] == level).to_numpy()
            share = float(amount[member].sum()) / whole
            by_chance = float(np.mean(dealt[:, member].sum(1) / dealt.sum(1) >= share - 1e-12))
            dense = share > FACTOR_DENSITY * float(samples[member].sum() / samples.sum())
            if dense and by_chance < FACTOR_SIGNIFICANCE:
                found.append({"factor": name, "level": level, "share": share})
    return tuple(sorted(found, key=lambda row: -row["share"]))
