"""Everything that reads what a user hands over, with a valid example."""

from __future__ import annotations

import io
import json
import zipfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy.io import savemat

from pipeline.evaluation.reported import read_judged, read_refit, read_told, read_truth
from pipeline.evaluation.splits import leave_one_out
from pipeline.learning.augmented import AugmentedRecipe
from pipeline.learning.bounce import START
from pipeline.learning.fitting import Members, fit, load_fit
from pipeline.learning.recipe import Recipe, load, save
from pipeline.learning.sequence.fits import read_fits
from pipeline.learning.sequence.recipe import SequenceRecipe
from pipeline.learning.sequence.training import Training
from pipeline.learning.windows import Windows
from pipeline.measurements.folder import read_logs
from pipeline.measurements.logs import Logs
from pipeline.measurements.table import read_rows
from pipeline.models.bounce import BounceParameters
from pipeline.models.dataset import Dataset
from pipeline.models.linear import Linear
from pipeline.models.sequences import SequenceInputs
from pipeline.models.structures import one_per_port
from pipeline.physics.mechanisms.cam_follower import CamFollower
from pipeline.physics.system.reader import read_system
from pipeline.rawlogs import Archive
from pipeline.recordings import emps
from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.sweep.runs import OVERRIDES, read_run
from pipeline.trajectory import Campaign
from tests.conftest import log_text, write_archive
from tests.evaluation.withheld_cases import diagnosis, effect, refit, truth
from tests.fuzz.inputs import Case
from tests.measurements.systems import motor, run, write_folder
from tests.physics.system.hoist import CONVERTER, HOIST
from tests.stages.test_tabulate_real import diagnosis as told

SYSTEMS = Path(__file__).parents[2] / "systems"


def text(content: Any) -> bytes:
    return json.dumps(content, indent=1).encode()


def finite(read: object) -> None:
    """Of logs and campaigns: no number that is none gets through."""
    if isinstance(read, Logs):
        assert all(np.isfinite(values).all() for values in (read.t, read.y, read.u, read.c, read.x))
        assert (np.diff(read.offsets) >= 50).all()
    elif isinstance(read, Campaign):
        assert len(read) == len(read.offsets) - 1


def plain_cases(folder: Path) -> dict[str, Case]:
    """Readers of text: system files, log folders, tables, JSON files, a sweep."""
    logs = write_folder(folder / "logs", {"a": run(60), "b": run(60)}, group=["g", "g"])
    (logs / "provenance.json").write_bytes(text({"data": "virtual"}))
    packed = write_folder(folder / "packed", {"a": run(60), "b": run(60)}, "parquet")
    read_logs(logs, motor()).write(folder / "store")
    pd.DataFrame({"id": ["a", "b"], "y": [1.0, 2.0]}).to_csv(folder / "y.csv", index=False)
    system = {"hoist.yaml": HOIST.encode(), "converter.csv": CONVERTER.encode()}
    clutch = {"clutch.yaml": (SYSTEMS / "clutch.yaml").read_bytes()}
    judged = diagnosis(effect("stribeck_friction", "rail", ("coulomb_friction", "rail")))
    planted = truth(("stribeck_friction", "rail"), alike=(("coulomb_friction", "rail"),))
    bounce = text({name: getattr(START, name) for name in START.__dataclass_fields__})
    overrides = yaml.safe_dump(["seed=1", "model.hidden=8", "profile.repeats=2"]).encode()
    sweep = {OVERRIDES.as_posix(): overrides, "fit.json": text({"seconds": 1.0})}
    system_of = motor()
    names = ("experiments.csv", "a.csv", "b.csv", "provenance.json")
    packed_names, stored = ("b.parquet",), ("experiments.parquet", "signals.parquet", "provenance.json")
    return {
        "system": Case(system, ("hoist.yaml",), lambda f: read_system(f / "hoist.yaml")),
        "table": Case(system, ("converter.csv",), lambda f: read_system(f / "hoist.yaml")),
        "events": Case(clutch, ("clutch.yaml",), lambda f: read_system(f / "clutch.yaml")),
        "logs": _checked(Case.of(logs, names, lambda f: read_logs(f, system_of))),
        "parquet": _checked(Case.of(packed, packed_names, lambda f: read_logs(f, system_of))),
        "store": _checked(Case.of(folder / "store", stored, lambda f: read_logs(f, system_of))),
        "observations": Case(
            {"y.csv": (folder / "y.csv").read_bytes()}, ("y.csv",), lambda f: read_rows(f / "y.csv")
        ),
        "diagnosis": Case({"d.json": text(told())}, ("d.json",), lambda f: read_told(f / "d.json")),
        "judged": Case({"d.json": text(judged)}, ("d.json",), lambda f: read_judged(f / "d.json")),
        "truth": Case({"t.json": text(planted)}, ("t.json",), lambda f: read_truth(f / "t.json")),
        "refit": Case({"r.json": text(refit(True))}, ("r.json",), lambda f: read_refit(f / "r.json")),
        "bounce": Case({"b.json": bounce}, ("b.json",), lambda f: BounceParameters.read(f / "b.json")),
        "sweep": Case(sweep, tuple(sweep), lambda f: read_run(f, f.parent)),
    }


def _checked(case: Case) -> Case:
    return Case(case.files, case.edits, case.read, finite)


def archive_cases(folder: Path) -> dict[str, Case]:
    """Readers of raw data: the archive of the cam-follower, recordings of EMPS."""
    plain = write_archive(folder / "plain.zip", {1: log_text(60), 2: log_text(60, rate=9.0)})
    archive = folder / "campaign.zip"
    with zipfile.ZipFile(plain) as source, zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for name in source.namelist():
            packed.writestr(name, source.read(name))
    t = np.arange(80)[:, None] * 0.001
    recording = io.BytesIO()
    savemat(recording, {"t": t, "vir": np.sin(t), "qm": np.cos(t)})

    def campaign(f: Path) -> object:
        found = Archive(f / "campaign.zip")
        return [found.log(int(exp)) for exp in found.parameters()["exp"]]

    # a process of its own reads a recording, within a second
    return {
        "archive": Case({"campaign.zip": archive.read_bytes()}, ("campaign.zip",), campaign),
        "recording": Case(
            {"e.mat": recording.getvalue()}, ("e.mat",), lambda f: emps.read(f / "e.mat"), share=0.02
        ),
    }


def checkpoint_cases(folder: Path, drives: Campaign, jumps: Campaign) -> dict[str, Case]:
    """Readers of fitted models."""
    dataset = Dataset.of(drives, CamFollower())
    model = Recipe(Linear, lambda dynamics, data, folds, seed: dynamics(bench=data.bench, batch=1))
    (folder / "linear").mkdir()
    save(model.train(dataset, [np.arange(5)], 0), folder / "linear" / "model.pt", {"folds": ["a"]})

    system = read_system(SYSTEMS / "pendulum.yaml")
    PendulumCampaign(runs=2, duration=1.0).write(folder / "swings", 0)
    swings = read_logs(folder / "swings", system)
    folds = leave_one_out(swings.experiments)
    members = Members.of([f.name for f in folds], [f.train for f in folds], 1)
    recipe = AugmentedRecipe(partial(one_per_port, hidden=4), Windows(5, 1, batch=64), method="rk4", hold=1.0)
    fit(recipe, system, swings, members, 0, None, "cpu", folder / "hybrid")

    inputs = SequenceInputs(("F_dagger",), ("m",))
    sequence = SequenceRecipe(inputs, Training(batch=6, updates=4, most=4), hidden=4, head=4, samples=60)
    sequence.fit(jumps, {"half": np.arange(1, 40, 2)}, 1, 0, folder / "lstm", 1)
    return {
        "linear": Case.of(
            folder / "linear", ("model.pt",), lambda f: load(f / "model.pt", model.dynamics, dataset)
        ),
        "hybrid": Case.of(folder / "hybrid", ("model.pt",), lambda f: load_fit(recipe, system, f)),
        "lstm": Case.of(folder / "lstm", ("00_00.pt", "fits.json"), read_fits),
    }
