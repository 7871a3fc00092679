"""Everything that reads what a user hands over, with a valid example."""

import io
import json
import shutil
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy.io import savemat

from pipeline.cam_follower.bounce import BounceParameters
from pipeline.cam_follower.bounce_fitting import START
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.linear import Linear
from pipeline.cam_follower.recipe import load
from pipeline.cam_follower.sequence.fits import read_fits
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequence.training import Training
from pipeline.cam_follower.sequences import SequenceInputs
from pipeline.chapters.reported import read_judged, read_refit, read_told, read_truth
from pipeline.recordings import emps
from pipeline.recordings.rawlogs import RawLogs
from pipeline.rigs.pendulum import PendulumCampaign
from tests.conftest import log_text, write_archive
from tests.evaluation.withheld_cases import diagnosis, effect, refit, truth
from tests.fuzz.inputs import Case
from tests.measurements.recorders import RECORDERS
from tests.measurements.systems import motor, run, write_folder
from tests.physics.system.hoist import CONVERTER, HOIST
from tests.recordings.published import MACHINES
from tests.stages.test_tabulate_real import diagnosis as told
from unmodelled.base.campaign import Campaign
from unmodelled.cli.sweep.runs import OVERRIDES, read_run
from unmodelled.cli.verbs.init import init
from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.checkpoint import save
from unmodelled.learning.fit import Fit
from unmodelled.learning.splits import leave_one_out
from unmodelled.learning.structures import one_per_port
from unmodelled.learning.windows import Windows
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.table import read_rows
from unmodelled.systems.reader import read_system

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
    read_logs(logs, motor()).to_hdf5(folder / "container" / "campaign.h5", motor())
    system = {"hoist.yaml": HOIST.encode(), "converter.csv": CONVERTER.encode()}
    judged = diagnosis(effect("stribeck_friction", "rail", ("coulomb_friction", "rail")))
    planted = truth(("stribeck_friction", "rail"), alike=(("coulomb_friction", "rail"),))
    bounce = text({name: getattr(START, name) for name in START.__dataclass_fields__})
    overrides = yaml.safe_dump(["seed=1", "model.hidden=8", "profile.repeats=2"]).encode()
    sweep = {OVERRIDES.as_posix(): overrides, "fit.json": text({"seconds": 1.0})}
    of_motor = motor()
    names = ("experiments.csv", "a.csv", "b.csv", "provenance.json")
    stored = ("experiments.parquet", "signals.parquet", "provenance.json")

    def checked(folder: Path, edits: tuple[str, ...], file: str = "", share: float = 1.0) -> Case:
        return Case.of(folder, edits, lambda f: read_logs(f / file, of_motor), whole=finite, share=share)

    return {
        "system": Case(system, ("hoist.yaml",), lambda f: read_system(f / "hoist.yaml")),
        "table": Case(system, ("converter.csv",), lambda f: read_system(f / "hoist.yaml")),
        "events": Case.of_file("clutch.yaml", (SYSTEMS / "clutch.yaml").read_bytes(), read_system),
        "logs": checked(logs, names),
        "parquet": checked(packed, ("b.parquet",)),
        "store": checked(folder / "store", stored),
        # processes of their own read it, within a second
        "hdf5": checked(folder / "container", ("campaign.h5",), "campaign.h5", 0.2),
        "observations": Case.of_file("y.csv", b"id,y\na,1.0\nb,2.0\n", lambda f: read_rows(f, ["id", "y"])),
        "diagnosis": Case.of_file("d.json", text(told()), read_told),
        "judged": Case.of_file("d.json", text(judged), read_judged),
        "truth": Case.of_file("t.json", text(planted), read_truth),
        "refit": Case.of_file("r.json", text(refit(True)), read_refit),
        "bounce": Case.of_file("b.json", bounce, BounceParameters.read),
        "sweep": Case(sweep, tuple(sweep), lambda f: read_run(f, f.parent)),
    }


def recorder_cases(folder: Path) -> dict[str, Case]:
    """Mappings, and files of recorders that one names."""
    system_of = motor()
    mapping = {
        "schema": "mapping/1",
        "files": ["a.csv", "b.json"],
        "time": {"column": "t", "unit": "s"},
        "signals": {"angle": {"column": "angle", "sign": 1}, "voltage": "voltage"},
        "constants": {"m": 0.5},
        "cut": "0.1 s",
    }
    texts = folder / "texts"
    texts.mkdir()
    (texts / "mapping.yaml").write_text(yaml.safe_dump(mapping))
    pd.DataFrame(run(60)).to_csv(texts / "a.csv", sep=";", decimal=",", index=False)
    (texts / "b.json").write_text(pd.DataFrame(run(60)).to_json(orient="records"))
    read = Case.of(texts, (), lambda f: read_logs(f, system_of), whole=finite)
    raw = folder / "raw"
    raw.mkdir()
    for name in ("a", "b"):
        pd.DataFrame(run(60)).round(4).to_csv(raw / f"{name}.csv", sep=";", decimal=",", index=False)

    def drafted(place: Path) -> object:
        shutil.rmtree(place / "drafts", ignore_errors=True)
        init(place, None, None, place / "drafts")
        return read_logs(place / "drafts", read_system(place / "drafts" / "system.yaml"))

    found = {"mapping": read, "init": Case.of(raw, (), drafted, whole=finite)}
    for name in ("mat", "mcap", "bag_1", "mdf", "ulog", "dataflash", "tdms", "wpilog"):
        recorder, place = RECORDERS[name], folder / name
        place.mkdir()
        recorder.write(place / recorder.file)
        signals = {"angle": recorder.angle, "voltage": recorder.voltage}
        own = {**mapping, "files": recorder.file, "signals": signals, "cut": None, "time": recorder.time}
        text = yaml.safe_dump({key: value for key, value in own.items() if value is not None})
        (place / "mapping.yaml").write_text(text)
        # a process of its own reads it, within a second or two
        how = {"whole": finite, "share": 0.1}
        found[name] = Case.of(place, (recorder.file,), lambda f: read_logs(f, system_of), **how)
    return found


def archive_cases(folder: Path) -> dict[str, Case]:
    """Readers of raw data: the archive of the cam-follower, recordings of EMPS and of published machines."""
    plain = write_archive(folder / "plain.zip", {1: log_text(60), 2: log_text(60, rate=9.0)})
    archive = folder / "campaign.zip"
    with zipfile.ZipFile(plain) as source, zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for name in source.namelist():
            packed.writestr(name, source.read(name))
    t = np.arange(80)[:, None] * 0.001
    recording = io.BytesIO()
    savemat(recording, {"t": t, "vir": np.sin(t), "qm": np.cos(t)})

    def campaign(f: Path) -> object:
        found = RawLogs(f)
        return [found.log(int(exp)) for exp in found.parameters()["exp"]]

    # a process of its own reads a recording of EMPS, within a second
    return {
        **{name: _published(folder, name) for name in ("xl330", "so101", "ur10e_joint", "cascaded_tanks")},
        "archive": Case.of_file("campaign.zip", archive.read_bytes(), campaign),
        "recording": Case.of_file("e.mat", recording.getvalue(), emps.read, share=0.02),
    }


def _published(folder: Path, name: str) -> Case:
    """The archive of a machine, as a folder."""
    machine = MACHINES[name]
    (folder / name).mkdir()
    machine.write(folder / name)

    def read(f: Path) -> object:
        with TemporaryDirectory() as out:
            return machine.recording(str(f)).write(Path(out), 0)

    return Case.of(folder / name, (), read, share=0.2)


def checkpoint_cases(folder: Path, drives: Campaign, jumps: Campaign) -> dict[str, Case]:
    """Readers of fitted models."""
    dataset = Dataset.of(drives, CamFollower())
    (folder / "linear").mkdir()
    save(Linear(bench=dataset.bench, batch=1), folder / "linear" / "model.pt", {"folds": ["a"]})

    system = read_system(SYSTEMS / "pendulum.yaml")
    PendulumCampaign(runs=2, duration=1.0).write(folder / "swings", 0)
    swings = read_logs(folder / "swings", system)
    recipe = AugmentedRecipe(one_per_port(hidden=8), Windows(5, 1, batch=64), method="rk4", hold=1.0)
    recipe.fit(system, swings, leave_one_out(swings.experiments)).save(folder / "hybrid")

    inputs = SequenceInputs(("F_dagger",), ("m",))
    sequence = SequenceRecipe(inputs, Training(batch=6, updates=4, most=4), hidden=4, head=4, samples=60)
    sequence.fit(jumps, {"half": np.arange(1, 40, 2)}, 1, 0, folder / "lstm", 1)
    return {
        "linear": Case.of(folder / "linear", ("model.pt",), lambda f: load(f / "model.pt", Linear, dataset)),
        "hybrid": Case.of(folder / "hybrid", ("model.pt",), lambda f: recipe.load(system, f)),
        "fit": Case.of(folder / "hybrid", ("model.pt", "system.yaml", "history.parquet"), Fit.load),
        "lstm": Case.of(folder / "lstm", ("00_00.pt", "fits.json"), read_fits),
    }
