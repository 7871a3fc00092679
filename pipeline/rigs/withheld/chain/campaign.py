"""Many cases with measurement chains, as `acquire` writes them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from pipeline.rigs.virtual import VirtualCampaign
from pipeline.rigs.withheld.campaign import LOGS, SYSTEM, TRUTH, known_system, known_truth, write_logs
from pipeline.rigs.withheld.chain.case import VALIDATION, MeasuredCase
from pipeline.rigs.withheld.chain.drawing import measured_cases
from pipeline.rigs.withheld.chain.measuring import HORIZON, Shares, measured, moved, planted, shares
from pipeline.rigs.withheld.effects.effect import Plan
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.progress import track

#: Beside the logs of a case: experiments of other kinds of motion, which no diagnosis reads.
VALIDATED = "validation"
#: By which share an uncertain parameter is off.
WRONG = 0.05, 0.20
#: The least share of the squared gap that makes an effect material.
MATERIAL = 0.1


@dataclass(frozen=True)
class MeasuredCampaign(VirtualCampaign):
    """The first `counts[kind]` cases of `kind` (see `measured_cases`) drawn with `seed`.

    Each has a folder <kind>_<number> (see `write_measured`). The seed of `acquire` is a second one, for
    inputs, sensors and noise.

    Attributes:
        kind: kind of the cases.
        counts: number of cases by kind.
        seed: seed of the cases.

    Raises:
        BadInput: when there is no such kind, or not as many cases.
    """

    kind: str
    counts: Mapping[str, int]
    seed: int = 0

    def __post_init__(self) -> None:
        if self.kind not in self.counts:
            raise BadInput(f"source.kind: {self.kind!r} is not one of {', '.join(self.counts)}")

    description = (
        "simulated logs of virtual machines with measurement chains and planted effects, not measurements"
    )

    @property
    def more(self) -> dict[str, Any]:
        """Kind and seed of the cases."""
        return {"kind": self.kind, "cases_seed": self.seed}

    def make(self, out: Path, seed: int) -> int:
        drawn = measured_cases(self.kind, self.counts[self.kind], self.seed)
        for k, case in enumerate(track(drawn, len(drawn), "withheld cases"), start=1):
            write_measured(replace(case, seed=case.seed + seed), out / f"{self.kind}_{k:03d}")
        return len(drawn)


def write_measured(case: MeasuredCase, folder: Path, plan: Plan | None = None) -> dict[str, Any]:
    """Replace `folder` by system.yaml, logs/, validation/ and truth.json; return the truth.

    The system file has its uncertain parameters 5 to 20 % off. A diagnosis reads system.yaml and logs/ only.
    The folder validation/ holds experiments of other kinds of motion, which tell whether an answer predicts.
    """
    plan = case.plan() if plan is None else plan
    motion = moved(case, plan)
    made = measured(case, plan, motion)
    system, parameters = known_system(case, list(made.outputs), case.doubtful, WRONG)
    truth = known_truth(case, made, parameters)
    truth = _extended(case, plan, truth, shares(case, plan, motion))
    logs = plan.runs - VALIDATION
    with replacing_folder(folder) as out:
        (out / SYSTEM).write_text(yaml.safe_dump(system, sort_keys=False, width=110))
        write_logs(case, made, out / LOGS, range(logs))
        write_logs(case, made, out / VALIDATED, range(logs, plan.runs))
        write_json(out / TRUTH, truth)
    return truth


def _extended(case: MeasuredCase, plan: Plan, truth: dict[str, Any], found: Shares) -> dict[str, Any]:
    """The truth with shares of the gap, the measurement chain and the kinds of motion."""
    rows = []
    for row, gap, share in zip(truth["effects"], found.each, found.shares, strict=True):
        alike = [{"family": f, "channel": c} for f, c in case.alike(row["channel"], row["family"])]
        more = {"gap": gap, "share": share, "material": share >= MATERIAL}
        rows.append(row | {"alike": row["alike"] + [a for a in alike if a not in row["alike"]]} | more)
    changed = _changed(case, plan, truth["parameters"])
    parts = [name for part in case.chain for name in part.names(case.machine, case.logged)]
    names = dict.fromkeys((*parts, *(other for family, at in parts for other in case.alike(at, family))))
    return truth | {
        "effects": rows,
        "parameters": {k: v for k, v in truth["parameters"].items() if k not in changed},
        "changed_parameters": changed,
        "chain": [part.row for part in case.chain],
        "tolerated": [{"family": family, "channel": channel} for family, channel in names],
        "gap": {"effects": found.effects, "chain": found.chain, "horizon": HORIZON},
        "motions": {"logs": case.motions.learned, "validation": case.motions.validation},
    }


def _changed(case: MeasuredCase, plan: Plan, parameters: Mapping[str, Any]) -> list[str]:
    """Uncertain parameters that a planted effect changes, so that they have no one true value."""
    machine = case.machine
    for _, effect in planted(case, plan):
        machine = effect.refitted(machine)
    return [name for name in parameters if getattr(machine, name) != getattr(case.machine, name)]
