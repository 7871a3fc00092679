"""Write many cases of one kind, for the verb `acquire`."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import yaml

from pipeline.rigs.virtual import VirtualCampaign
from pipeline.rigs.withheld.cases import GROUP, Case
from pipeline.rigs.withheld.drawing import FAMILIES, cases
from pipeline.rigs.withheld.effects.effect import Plan
from pipeline.rigs.withheld.experiments import Experiments, run
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import track


@dataclass(frozen=True)
class WithheldCampaign(VirtualCampaign):
    """The first cases of a kind.

    Each has a folder <kind>_<number> (see `write`). The seed of `acquire` is a second one, for inputs,
    sensors and noise.

    Attributes:
        kind: kind of the cases, see `cases`.
        count: number of cases; None: all cases.
        seed: seed of the drawn cases.

    Raises:
        BadInput: when there is no such kind, or not as many cases.
    """

    kind: str = "single"
    count: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        many = len(cases(self.kind, self.seed))
        if self.count is not None and not 1 <= self.count <= many:
            raise BadInput(f"source.count: must be 1 to {many} for {self.kind} cases, got {self.count}")

    description = "simulated logs of virtual machines with planted effects, not measurements"

    def make(self, out: Path, seed: int) -> int:
        drawn = cases(self.kind, self.seed)[: self.count]
        for k, case in enumerate(track(drawn, len(drawn), "withheld cases"), start=1):
            write(replace(case, seed=case.seed + seed), out / f"{self.kind}_{k:03d}")
        return len(drawn)


SYSTEMS = Path(__file__).parents[3] / "systems" / "withheld"
SYSTEM, LOGS, TRUTH = "system.yaml", "logs", "truth.json"
WRONG = 0.05, 0.30  # by which share an uncertain parameter is off


def write(case: Case, folder: Path, plan: Plan | None = None) -> dict[str, Any]:
    """Replace a folder by system.yaml, logs/ (a log folder) and truth.json, and return the truth.

    The parameters of the system file with `identify: true` are 5 to 30 % off. Neither system.yaml nor logs/
    tells which effects are planted.
    """
    made = run(case, plan)
    system, parameters = known_system(case, list(made.outputs))
    truth = known_truth(case, made, parameters)
    with replacing_folder(folder) as out:
        (out / SYSTEM).write_text(yaml.safe_dump(system, sort_keys=False, width=110))
        write_logs(case, made, out / LOGS, range(made.plan.runs))
        write_json(out / TRUTH, truth)
    return truth


def known_system(
    case: Case, outputs: list[str], doubtful: Collection[str] = (), wrong: tuple[float, float] = WRONG
) -> tuple[dict[str, Any], dict[str, dict[str, float]]]:
    """Return the system file that is handed over, and true and given values of what it has wrong."""
    document: dict[str, Any] = yaml.safe_load((SYSTEMS / f"{case.system}.yaml").read_text())
    rng = np.random.default_rng([case.seed, 5])
    document["outputs"] = {name: document["outputs"][name] for name in outputs}
    changed = {}
    for name, parameter in document["parameters"].items():
        if name in doubtful:
            bounds = [0.4 * parameter["value"], 2.5 * parameter["value"]]
            parameter |= {"identify": True, "bounds": [float(f"{bound:.2g}") for bound in bounds]}
        if parameter.get("identify"):
            true = float(parameter["value"])
            off = float(rng.uniform(*wrong) * rng.choice([-1.0, 1.0]))
            parameter["value"] = float(f"{true * (1.0 + off):.3g}")
            changed[name] = {"true": true, "given": parameter["value"]}
    return document, changed


def write_logs(case: Case, made: Experiments, folder: Path, runs: range) -> None:
    """Write some of the runs as a log folder."""
    folder.mkdir()
    plan, rng = made.plan, np.random.default_rng([case.seed, 6])
    packed = bool(rng.uniform() < 0.5)
    ids = [f"run{i + 1:02d}" for i in runs]
    files = [f"{name}.{'parquet' if packed else 'csv'}" for name in ids]
    for i, file in zip(runs, files, strict=True):
        columns: Mapping[str, Any] = {"t": made.t[:, i], case.machine.input: made.u[:, i]}
        log = pd.DataFrame({**columns, **{name: y[:, i] for name, y in made.outputs.items()}})
        if packed:
            write_parquet(log, folder / file)
        else:
            log.to_csv(folder / file, index=False, float_format="%.9g", lineterminator="\n")
    conditions = {name: values[runs.start : runs.stop] for name, values in plan.conditions.items()}
    table = pd.DataFrame({"id": ids, "file": files, **conditions})
    if plan.groups:
        table[GROUP] = plan.groups[runs.start : runs.stop]
    table.to_csv(folder / "experiments.csv", index=False, lineterminator="\n")
    description = f"simulated logs of a virtual {case.system.replace('_', ' ')}, not measurements"
    write_json(folder / "provenance.json", {"data": "virtual", "description": description})


def add_runs(case: Case, commands: Array, folder: Path) -> None:
    """Add runs with commands (samples, runs) to the logs of a case, at the conditions of its first run."""
    first, (samples, runs) = case.plan(), commands.shape
    plan = replace(
        first,
        samples=samples,
        conditions={name: np.repeat(values[:1], runs) for name, values in first.conditions.items()},
        groups=first.groups[:1] * runs,
        begin=first.begin[-1] + 1.25 * case.machine.duration * np.arange(1.0, runs + 1.0),
    )
    with TemporaryDirectory() as made:
        write_logs(case, run(case, plan, commands), new := Path(made) / LOGS, range(runs))
        table = pd.read_csv(new / "experiments.csv", dtype={"id": str})
        for file in table["file"]:
            (new / file).replace(folder / f"more_{file}")
    table[["id", "file"]] = "more_" + table[["id", "file"]]
    every = pd.concat([pd.read_csv(folder / "experiments.csv", dtype={"id": str}), table])
    every.to_csv(folder / "experiments.csv", index=False, lineterminator="\n")


def known_truth(case: Case, made: Experiments, parameters: dict[str, dict[str, float]]) -> dict[str, Any]:
    """Return the content of truth.json."""
    rows = []
    for planted, (channel, effect) in zip(case.effects, made.effects, strict=True):
        form = getattr(effect, "inner", effect)
        row: dict[str, Any] = {
            "family": planted.family,
            "channel": channel,
            "form": type(form).__name__,
            "parameters": effect.parameters,
            "alike": [{"family": f, "channel": c} for f, c in case.offered(planted).alike],
        }
        if planted.factor is not None:
            row |= {"factor": planted.factor, "level": planted.at}
        rows.append(row)
    families = {planted.family for planted in case.effects}
    verdict = ("effect" if families <= FAMILIES else "unknown") if families else "no_gap"
    return {
        "schema": "withheld/1",
        "verdict": verdict,
        "system": case.system,
        "level": case.level,
        "seed": case.seed,
        "effects": rows,
        "parameters": parameters,
        "hold": made.plan.hold,
        "outputs": list(made.outputs),
    }
