"""Fit every method to every machine, one row of the table each; a row that is there is not computed again."""

from __future__ import annotations

import argparse
import importlib
import json
import time
import traceback
from collections.abc import Mapping
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from benchmarks.head_to_head.case import Case, measured, virtual
from benchmarks.head_to_head.method import Method, gap_of
from unmodelled.base.files import write_json
from unmodelled.diagnosis.data.gap import Gap
from unmodelled.diagnosis.fitting.judged_models import known_model

METHODS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "file": ("ours", "FileParameters", ()),
    "sysid": ("sysid", "MujocoSysid", ("mujoco", "absl")),
    "sysid_joints": ("sysid", "without_stiffness", ("mujoco", "absl")),
    "sysid_links": ("sysid", "WithLinks", ("mujoco", "absl")),
    "cma": ("cma_es", "CmaEs", ("cma",)),
    "pysindy": ("sindy", "WeakSindy", ("pysindy",)),
    "ours": ("ours", "Ours", ()),
    "pyoperon": ("operon", "SymbolicRegression", ("pyoperon",)),
}
#: Methods that only robots have.
ROBOTS = ("sysid_links",)


def method(name: str) -> Method:
    """Return a method by its name in `METHODS`; its packages must be installed."""
    module, found, packages = METHODS[name]
    for package in packages:
        if find_spec(package) is None:
            raise ModuleNotFoundError(f"{package} is not installed: pip install '.[bench]'")
    made: Method = getattr(importlib.import_module(f"benchmarks.head_to_head.{module}"), found)()
    return made


def row(case: Case, name: str, revision: str) -> dict[str, Any]:
    """Fit one method to one machine, and return its row.

    It has case, method, gap (held-out, standard deviations), learned (gap on the training experiments), known
    and floor, wall and cpu (seconds of the fit), says, numbers, budget, error ("" or the reason why there is
    no result), and gaps in MuJoCo where the system is a robot.
    """
    study = case.study()
    known: Gap = known_model(study).gap
    found: dict[str, Any] = {
        "case": case.name,
        "method": name,
        "revision": revision,
        "horizon": study.horizon,
        "held_out": [study.logs.ids[i] for i in study.held_out],
        "known": known.value,
        "floor": known.floor,
        "error": "",
    }
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        chosen = method(name)
        found["versions"] = {package: version(package) for package in chosen.needs}
        model = chosen.fit(study)
        found |= {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
        found |= {"gap": gap_of(model, study), "learned": gap_of(model, study, learned=True)}
    except Exception as fault:
        traceback.print_exc()
        taken = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
        return {**taken, **found, "error": f"{type(fault).__name__}: {fault}"[:300]}
    found |= {"says": model.says, "numbers": dict(model.numbers), "at_bound": list(model.at_bound)}
    found |= {"budget": model.budget, "named": model.named, "alike": model.alike}
    if case.truth is not None:
        found |= compared(case.truth, model.numbers)
    if study.system.robot is not None:
        from benchmarks.head_to_head.in_mujoco import gaps_in_mujoco

        found |= gaps_in_mujoco(model, study)
        if model.links:  # the equations do not have them
            found |= {"gap": found["mujoco"], "learned": None}
    return found


def compared(truth: Mapping[str, Any], numbers: Mapping[str, float]) -> dict[str, Any]:
    """Return the planted effect of truth.json, and errors of uncertain parameters relative to true values."""
    true = {name: entry["true"] for name, entry in truth["parameters"].items()}
    off = {name: abs(numbers[name] / value - 1.0) for name, value in true.items() if name in numbers}
    given = {name: abs(e["given"] / e["true"] - 1.0) for name, e in truth["parameters"].items()}
    planted = [[e["family"], e["channel"]] for e in truth["effects"]]
    return {"planted": planted, "parameter_errors": off, "given_errors": given}


def main() -> None:
    """Write <out>/<case>__<method>.json for every machine and method that has none yet."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.head_to_head", description=__doc__)
    parser.add_argument("--logs", type=Path, required=True, help="folder with <machine>/logs")
    parser.add_argument("--robot", type=Path, help="folder with double_pendulum.urdf and .yaml")
    parser.add_argument("--cases", type=Path, help="folder of virtual cases")
    parser.add_argument("--out", type=Path, required=True, help="folder of the rows")
    parser.add_argument("--revision", default="", help="commit of the program")
    parser.add_argument("--methods", nargs="*", default=list(METHODS), choices=list(METHODS))
    parser.add_argument("--only", nargs="*", default=[], help="beginnings of names of machines")
    given = parser.parse_args()
    cases = [*measured(given.logs, given.robot), *(virtual(given.cases) if given.cases else ())]
    cases = [c for c in cases if not given.only or c.name.startswith(tuple(given.only))]
    given.out.mkdir(parents=True, exist_ok=True)
    jobs = [(c, name) for c in cases for name in given.methods if c.robot or name not in ROBOTS]
    for k, (case, name) in enumerate(jobs, start=1):
        file = given.out / f"{case.name.replace('/', '__')}__{name}.json"
        if file.exists():
            continue
        made = row(case, name, given.revision)
        write_json(file, made)
        what = made["error"] or f"gap {made['gap']:.4g}, {made['says']}"
        print(f"[{k}/{len(jobs)}] {case.name} {name}: {made['cpu']:.0f} s, {what}", flush=True)


def rows(folder: Path) -> list[dict[str, Any]]:
    """Read the rows of a folder that `main` wrote, in the order of their names."""
    return [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]


if __name__ == "__main__":
    main()
