"""Diagnose the training records of public data sets, and simulate their official tests.

    python -m benchmarks.published silverbox=ZIP cascaded_tanks=ZIP emps=FOLDER out=FOLDER

Splits, first samples that do not count, and errors are those of the package nonlinear_benchmarks 1.0.1
(G. Beintema, nonlinearbenchmark.org). docs/withheld/published.md has the table beside published methods.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from pipeline.recordings import cascaded_tanks, emps, silverbox
from pipeline.recordings.archive import Archive
from pipeline.recordings.log_folder import parts
from unmodelled.api.answer import Answer
from unmodelled.api.named_effect import NamedEffect
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.logs.clock import delayed
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepared_for
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[1] / "systems"
#: Integration steps per sample; twice as many change no error of the table by one per cent.
SUBSTEPS = 4
#: Silverbox: rows of the training record and of the three test records.
TRAINED = slice(40_650, 105_712)
TESTED = {
    "multisine": slice(105_712, 127_400),
    "arrow, full": slice(100, 40_575),
    "arrow, no extrapolation": slice(100, 32_100),
}


@dataclass(frozen=True)
class Records:
    """A public data set with its official split."""

    #: Experiments, cut from the training record, by id.
    training: Mapping[str, pd.DataFrame]
    tests: Mapping[str, pd.DataFrame]
    #: First samples of a test record that set the start state and do not count.
    seen: int
    #: Unit of the published errors, and its size in units of the output.
    unit: str
    factor: float
    #: System files below `SYSTEMS`.
    systems: tuple[str, ...]


def read_silverbox(archive: str) -> Records:
    """Read the multisine and the arrow: realisations that the training record has, whole or in part."""
    source = Archive(archive, "SILVERBOX")
    record = source.table(source.names(silverbox.FILE)[0], ["V1", "V2"])
    record.insert(0, "t", silverbox.PERIOD * np.arange(len(record)))
    starts = silverbox.FIRST + silverbox.STEP * np.arange(silverbox.REALISATIONS)
    begun = [int(start) for start in starts if start < TRAINED.stop]
    ends = [min(start + silverbox.LENGTH, TRAINED.stop) for start in begun]
    rows = [slice(max(a, TRAINED.start), b) for a, b in zip(begun, ends, strict=True)]
    training = {f"multisine_{k}": record.iloc[at] for k, at in enumerate(rows, start=1)}
    tests = {name: record.iloc[at] for name, at in TESTED.items()}
    return Records(training, tests, 50, "mV", 1e-3, ("silverbox/hardening_withheld.yaml",))


def read_cascaded_tanks(archive: str) -> Records:
    """Read the two records; the training record is cut in three, as docs/real does it."""
    source = Archive(archive, "CASCADED_TANKS")
    name = source.names(cascaded_tanks.FILE)[0]
    table = source.table(name, [column for record in cascaded_tanks.RECORDS.values() for column in record])
    t = cascaded_tanks.PERIOD * np.arange(len(table))
    frames = {
        record: pd.DataFrame({"t": t, "u": table[u], "y": table[y]})
        for record, (u, y) in cascaded_tanks.RECORDS.items()
    }
    training = _cut(frames["est"], 3, name)
    return Records(training, {"val": frames["val"]}, 50, "V", 1.0, ("cascaded_tanks/overflow_withheld.yaml",))


def read_emps(folder: str) -> Records:
    """Read the recording without pulses, cut in five as docs/real does it, and the one with pulses."""
    plain, pulses = (emps.read(Path(folder).expanduser() / file) for file in emps.FILES.values())
    systems = ("emps/coulomb_withheld.yaml", "emps/nothing_withheld.yaml")
    return Records(_cut(plain, 5, "DATA_EMPS"), {"pulses": pulses}, 20, "mm", 1e-3, systems)


SETS: dict[str, Callable[[str], Records]] = {
    "silverbox": read_silverbox,
    "cascaded_tanks": read_cascaded_tanks,
    "emps": read_emps,
}


def _cut(record: pd.DataFrame, count: int, where: str) -> dict[str, pd.DataFrame]:
    return {f"part_{k}": part for k, part in enumerate(parts(record, count, where), start=1)}


def row(records: Records, file: str, out: Path) -> dict[str, Any]:
    """Diagnose the training record of a set, simulate its tests, and return the row.

    `rmse` of every test is that of the system as given, with its uncertain parameters refitted, and with the
    named laws; `cpu` are the seconds of the diagnosis.
    """
    system = read_system(SYSTEMS / file)
    logs, begin = Logs.from_frames(records.training, system), time.process_time()
    found = findings(system, logs)
    cpu, answer = time.process_time() - begin, Answer.of(found)
    answer.save(out / Path(file).stem, pages=False)
    models = {name: getattr(found.diagnosis, name).system for name in ("known", "reidentified", "augmented")}
    rmse: dict[str, dict[str, float]] = {}
    for test, record in records.tests.items():
        measured = record[system.outputs[0].column].to_numpy()
        off = {name: simulate(one, system, record, records.seen) - measured for name, one in models.items()}
        rmse[test] = {
            name: float(np.sqrt(np.mean(e[records.seen :] ** 2))) / records.factor for name, e in off.items()
        }
    said = {"verdict": answer.verdict, "confidence": answer.confidence, "laws": [*map(_law, answer.effects)]}
    return {"file": file, **said, "cpu": cpu, "unit": records.unit, "rmse": rmse}


def _law(effect: NamedEffect) -> str:
    numbers = [
        f"{name} = {e['value']:.3g} {e['unit']}".removesuffix(" 1") for name, e in effect.parameters.items()
    ]
    return f"{effect.family} at {effect.port}: {', '.join([effect.law, *numbers])}"


def simulate(model: System, given: System, record: pd.DataFrame, seen: int) -> Array:
    """Simulate a record in free run, from a start state that fits the first `seen` samples of the output.

    A number that differs between experiments has the mean of the training experiments. Gives (samples,), SI.
    """
    blind, column = record.reset_index(drop=True), given.outputs[0].column
    blind.loc[seen:, column] = blind[column].iloc[seen - 1]  # what is not there cannot be used
    logs, (output,) = prepared_for(model, Logs.from_frames({"test": blind}, given)), model.outputs
    program, first = Program.of(model, [output.expression]), np.zeros(1, np.int64)
    how = Integration(logs.period, "rk4", SUBSTEPS, tuple(item.course for item in model.inputs))
    p = np.array(model.values)[None, None]

    def run(start: Array, samples: int) -> Array:
        windows = Windows(logs.u[:samples], logs.t[:samples], first, first + samples - 1, first, first)
        y = free_run(program, windows, p, logs.c, start[None, None], how)[0, 0]
        return delayed(y, np.array([0, samples]), logs.period, [output.delay], "linear")[:, 0]

    begin, target = logs.x[0], logs.y[:seen, 0]
    plausible = np.abs(logs.x[:seen]).max(axis=0) + 1e-3
    weak = 1e-3 * float(np.std(target)) / plausible  # a state that the samples do not determine stays

    def off(start: Array) -> Array:
        return np.concatenate([run(start, seen) - target, weak * (start - begin)])

    return run(least_squares(off, begin, x_scale=plausible).x, len(record))


def main(words: Sequence[str]) -> None:
    """Write out/<set>.json, and print the rows, for every set that is given."""
    given = dict(word.partition("=")[::2] for word in words)
    if "out" not in given or not {*given} <= {*SETS, "out"} or len(given) < 2:
        raise BadInput(f"words: give out=FOLDER and the path of one or more of {', '.join(SETS)}")
    out = Path(given.pop("out"))
    for name, path in given.items():
        records = SETS[name](path)
        rows = [row(records, file, out / name) for file in records.systems]
        write_json(out / f"{name}.json", rows)
        for made in rows:
            print(f"{made['file']}: {made['verdict']} ({made['confidence']:.2f}), {made['cpu']:.0f} CPU s")
            for law in made["laws"]:
                print(f"  {law}")
            for test, errors in made["rmse"].items():
                said = ", ".join(f"{model} {error:.4g}" for model, error in errors.items())
                print(f"  {test}, RMSE in {made['unit']}: {said}", flush=True)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except BadInput as fault:
        sys.exit(str(fault))
