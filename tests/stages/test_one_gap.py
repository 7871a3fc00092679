"""simulate and diagnose say the same gap, noise floor and errors of the same file, logs and experiments."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.benches import Bench, pendulum
from tests.diagnosis.studies import HORIZON
from unmodelled.base.files import read_json
from unmodelled.cli.verbs.simulate import simulate
from unmodelled.diagnosis.answer.augmented import FILE, write_augmented
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.where.where import where
from unmodelled.logs.folder import read_logs

pytestmark = pytest.mark.long

COUNT = 2.0 * np.pi / 500
LATE = ("  theta: {unit: rad}\nparameters:", "  theta: {unit: rad, delay: 0.006}\nparameters:")


@dataclass(frozen=True)
class Machine:
    """A pendulum with dry friction that its file does not have; `count`: step of its encoder, rad."""

    bench: Bench
    count: float = 0.0
    changes: tuple[tuple[str, str], ...] = ()

    def diagnosis(self, folder: Path) -> Diagnosis:
        system = pendulum(folder, *self.changes)
        self.bench.logs(folder / "logs", system)
        for path in folder.glob("logs/run*.csv") if self.count else ():
            table = pd.read_csv(path)
            table["theta"] = self.count * np.round(table["theta"] / self.count)
            table.to_csv(path, index=False)
        return diagnose_gap(system, read_logs(folder / "logs", system), HORIZON, 0)


MACHINES = {
    "noise": Machine(Bench(runs=6, samples=400, noise=1e-3)),
    "plateaus": Machine(Bench(runs=6, samples=400, noise=0.0), COUNT),
    "delay": Machine(Bench(runs=6, samples=400, delay=3), changes=(LATE,)),
}


@pytest.fixture(scope="module", params=MACHINES)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Diagnosis]:
    folder = tmp_path_factory.mktemp(request.param)
    found = MACHINES[request.param].diagnosis(folder)
    write_augmented(found, folder)
    return folder, found


def held_out(found: Diagnosis) -> list[str]:
    return [found.logs.ids[i] for i in found.held_out]


def check_simulated(content: Mapping[str, Any], model: JudgedModel, fitted: bool) -> None:
    """simulation.json says what the diagnosis knows of the model.

    The gap of one that was `fitted` to all experiments is that of experiments left out, hardly larger here.
    """
    gap = model.gap
    said = {e["id"]: e["known"] for e in content["experiments"]}
    larger = {i: own / said[i] for i, own in gap.per_experiment.items()}
    assert len(larger) == len(said)
    for factor in (gap.value / content["gap"]["known"], *larger.values()):
        assert 1.0 - 1e-9 < factor < (1.1 if fitted else 1.0 + 1e-9)
    assert content["gap"]["floor"] == pytest.approx(gap.floor, rel=1e-9)
    assert {n: e["std"] for n, e in content["outputs"].items()} == pytest.approx(dict(gap.scale), rel=1e-9)
    for name, off in gap.units.items():
        entry = content["gap"]["units"][name]
        assert entry["unit"] == off.unit
        assert entry["known"] == pytest.approx(off.at_horizon, rel=1e-9)
        assert entry["known_whole_run"] == pytest.approx(off.whole_run, rel=1e-6)


def test_of_the_held_out_experiments(
    case: tuple[Path, Diagnosis], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, found = case
    for file, model in {"system.yaml": found.known, FILE: found.augmented}.items():
        simulate(folder / file, folder / "logs", HORIZON, tmp_path / file, held_out(found))
        check_simulated(read_json(tmp_path / file / "simulation.json"), model, fitted=file == FILE)
    assert found.effects and found.floor == found.augmented.gap.floor
    # the terminals say the same
    printed = capsys.readouterr().out.split("with the effects")[-1].splitlines()
    simulated = [line for line in printed if not line.startswith("note: ")]
    told = "\n".join(sentences(summary(found, where(found))))
    assert f"noise floor {simulated[-3].split()[2]} "[:-2] in told
    assert f"with the effects found: {simulated[-5].removeprefix('theta: ')}" in told


def test_of_all_experiments(case: tuple[Path, Diagnosis], tmp_path: Path) -> None:
    folder, found = case
    content = summary(found, where(found))
    simulate(folder / FILE, folder / "logs", HORIZON, tmp_path / "out")
    read = read_json(tmp_path / "out" / "simulation.json")
    check_simulated(read, found.augmented, fitted=True)
    each = {e["id"]: e["augmented"] for e in content["where"]["experiments"]}
    simulated = {e["id"]: e["known"] for e in read["experiments"]}
    assert simulated == pytest.approx(each, rel=1e-7)  # of which diagnosis.json has eight digits


def test_the_floor_is_at_least_that_of_the_resolution(case: tuple[Path, Diagnosis]) -> None:
    folder, found = case
    gap = found.augmented.gap
    resolution = COUNT if folder.name.startswith("plateaus") else 0.0
    assert gap.floor >= resolution / np.sqrt(12.0) / gap.scale["theta"]
    assert 0.7 < gap.value / gap.floor < 1.4


def test_errors_in_units_stand_in_the_summary(case: tuple[Path, Diagnosis]) -> None:
    _, found = case
    entry = summary(found, where(found))["gap"]["units"]["theta"]
    known, augmented = found.known.gap.units["theta"], found.augmented.gap.units["theta"]
    assert entry["unit"] == "rad"
    assert entry["known"] == pytest.approx(known.at_horizon, rel=1e-7)
    assert entry["augmented"] == pytest.approx(augmented.at_horizon, rel=1e-7)
    assert entry["known_whole_run"] == pytest.approx(known.whole_run, rel=1e-7)
    assert entry["augmented_whole_run"] == pytest.approx(augmented.whole_run, rel=1e-7)
    assert entry["augmented"] < 0.3 * entry["known"] and entry["augmented"] < entry["augmented_whole_run"]
