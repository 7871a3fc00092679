"""Where the gap lies: through which channel, where along its coordinates, and in which experiments."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from unmodelled.diagnosis.data.diagnosis import Diagnosis, Model
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.where.channels import shared
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.experiments import Experiments
from unmodelled.diagnosis.where.factors import factors
from unmodelled.diagnosis.where.regions import regions
from unmodelled.diagnosis.where.shares import shares
from unmodelled.logs.preparation import prepare

Rows = tuple[dict[str, Any], ...]

#: Share of a channel from which on its coordinates are looked at.
MUCH = 0.2
#: Shares of the gap below this are not told apart from none.
LEAST = 0.005


@dataclass(frozen=True, eq=False)
class Where:
    """What diagnosis.json says of where the gap lies (shared/contracts/diagnosis.md), largest shares first.

    Attributes:
        channels: port (see `channels.channel`), share of the squared gap above the floor.
        regions: signal, low, high (SI), share of the squared correction at the channel that lacks most.
        factors: factor, level, share of the squared gap above the floor of the re-identified model.
        experiments: id, known, augmented: gaps of every experiment; those of figures have more columns.
        lacking: what the physics without effects lacks, with the parameters of the augmented model.
        left: what the augmented model still lacks. every: gaps of the experiments.
    """

    channels: Rows
    regions: Rows
    factors: Rows
    experiments: Rows
    lacking: Corrections
    left: Corrections
    every: Experiments


def where(diagnosis: Diagnosis) -> Where:
    """Say where the gap lies, whatever the verdict.

    Without a gap, or where the logs are to be checked, there are no channels, regions or factors.
    """
    physics = _physics(diagnosis)
    sensors = Sensors(diagnosis.logs)
    lacking = Corrections.of(physics, diagnosis.horizon, sensors)
    left = lacking
    if diagnosis.effects:
        left = Corrections.of(diagnosis.augmented, diagnosis.horizon, sensors)
    every, gap = Experiments.of(diagnosis, sensors), diagnosis.verdict not in ("no_gap", "check_logs")
    found = shared(diagnosis, shares(left) if _remains(diagnosis) else {}) if gap else {}
    much = tuple(name for name, share in found.items() if share >= min(MUCH, max(found.values())))
    samples = np.diff(diagnosis.logs.offsets).astype(np.float64)
    columns = (*(c.name for c in diagnosis.system.operating_point), "group")
    excess = every.reidentified**2 - every.floor**2
    table = diagnosis.logs.experiments
    return Where(
        channels=tuple({"port": name, "share": share} for name, share in found.items() if share >= LEAST),
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
    """Whether the augmented model leaves enough of the gap to ask where that lies."""
    before, after, floor = (
        value**2
        for value in (diagnosis.reidentified.gap.value, diagnosis.augmented.gap.value, diagnosis.floor)
    )
    return after - floor > LEAST * (before - floor)


def _physics(diagnosis: Diagnosis) -> Model:
    """The physics without effects, with the parameters that go with the effects."""
    base, augmented = diagnosis.reidentified, diagnosis.augmented.system
    values = dict(zip((p.name for p in augmented.parameters), augmented.values, strict=True))
    own = {p.name: values[p.name] for p in base.system.parameters if p.name in values}
    system = base.system.with_values(own)
    return replace(base, system=system, logs=prepare(system, base.logs))
