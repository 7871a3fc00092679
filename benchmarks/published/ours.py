"""The diagnosis: the training record is diagnosed, and the tests are simulated with the named laws."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from benchmarks.published.records import SYSTEMS, Records
from unmodelled.api.answer import Answer
from unmodelled.api.named_effect import NamedEffect
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.logs.clock import delayed
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepared_for
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

#: Integration steps per sample; twice as many change no error of the table by one per cent.
SUBSTEPS = 4


def rows(records: Records) -> Iterator[dict[str, Any]]:
    """Yield the rows of every system file: as given (`known`), `reidentified`, and `augmented` by the laws.

    `cpu` are the seconds of the diagnosis; the laws, in the last row, have their numbers with 95 % intervals.
    """
    for file in records.systems:
        system = read_system(SYSTEMS / file)
        logs, begin = Logs.from_frames(records.training, system), time.process_time()
        found = findings(system, logs)
        cpu, answer = time.process_time() - begin, Answer.of(found)
        laws = [_law(effect) for effect in answer.effects]
        for name in ("known", "reidentified", "augmented"):
            model = getattr(found.diagnosis, name).system
            errors = {
                test: records.rmse(test, simulate(model, system, record, records.seen))
                for test, record in records.tests.items()
            }
            said = f"{file}, {name}: {answer.verdict} ({answer.confidence:.2f})"
            yield {"model": said, "laws": laws if name == "augmented" else [], "cpu": cpu, "rmse": errors}


def _law(effect: NamedEffect) -> str:
    def number(name: str, e: Mapping[str, Any]) -> str:
        unit = "" if e["unit"] == "1" else f" {e['unit']}"
        ends = " to ".join(f"{end:.3g}" for end in e["interval"] or ())
        return f"{name} = {e['value']:.3g}{unit}" + (f" ({ends})" if ends else "")

    numbers = [number(name, e) for name, e in effect.parameters.items()]
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
