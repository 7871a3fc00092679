"""Black boxes, each with the defaults of its package: nothing is chosen by an error on a test.

They ask for other versions of packages than constraints.txt has, so they get an environment of their own:

    python3.11 -m venv boxes
    boxes/bin/pip install -e ".[train]" scikit-learn deepSI freq-statespace
    boxes/bin/python -m benchmarks.published silverbox=ZIP out=FOLDER method=subnet
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from benchmarks.published.records import Records
from pipeline.recordings import silverbox
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

#: Batches that SUBNET learns from, as in the example of its package.
BATCHES = 10_000
#: Silverbox: samples of a period of the multisine, rows after it (some are silent), and excited harmonics.
SAMPLES, AFTER, HARMONICS = 8_192, 20, np.arange(1, 2 * 1_342, 2)


def subnet(records: Records) -> Iterator[dict[str, Any]]:
    """Yield the row of SUBNET, a state equation that is a network, with an encoder (Beintema et al. 2023).

    The last part of the training record chooses the batch at which learning stops.
    """
    deepSI, torch, nlb = map(_package, ("deepSI", "torch", "nonlinear_benchmarks"))
    parts = list(records.training.values())
    period = float(np.median(np.diff(parts[0]["t"])))

    def data(record: pd.DataFrame) -> Any:
        u, y = record[records.u].to_numpy(), record[records.y].to_numpy()
        return nlb.Input_output_data(u, y, sampling_time=period)

    torch.manual_seed(0)
    *training, last = map(data, parts)
    model = deepSI.SUBNET(*deepSI.get_nu_ny_and_auto_norm(training))
    begin = time.process_time()
    deepSI.fit(model, training, last, n_its=BATCHES)
    yield _row("SUBNET", records, time.process_time() - begin, lambda record: model.simulate(data(record)).y)


def nl_lfr(records: Records) -> Iterator[dict[str, Any]]:
    """Yield the row of a linear model around a static polynomial of degree three (Floren et al. 2025).

    The method needs whole periods of a periodic input, which the training record of the Silverbox has alone.
    """
    if (records.u, records.y) != ("V1", "V2"):
        raise BadInput("method=nl_lfr: only silverbox has whole periods of a periodic input")
    fss = _package("freq_statespace")
    periods = [one.iloc[-SAMPLES - AFTER : -AFTER] for one in records.training.values() if len(one) > SAMPLES]
    u, y = (np.stack([one[name] for one in periods], 1)[:, None, :, None] for name in (records.u, records.y))
    begin = time.process_time()
    data = fss.create_data_object(u, y, HARMONICS, 1.0 / silverbox.PERIOD)
    linear = fss.lin.optimize(fss.lin.subspace_id(data, nx=2), data)
    model = fss.nonlin.inference_and_learning(linear, data, fss.static.basis.Polynomial(1, degree=3), nw=1)
    model = fss.nonlin.optimize(model, data)

    def run(record: pd.DataFrame, start: Array) -> Array:
        u = record[records.u].to_numpy()[:, None, None]
        y: Array = model.simulate(u, x0=start[:, None])[0]
        return y[:, 0, 0]

    def simulated(record: pd.DataFrame) -> Array:
        seen = record.iloc[: records.seen]
        start = least_squares(lambda x: run(seen, x) - seen[records.y], np.zeros(2)).x
        return run(record, start)

    yield _row("NL-LFR", records, time.process_time() - begin, simulated)


def _package(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ModuleNotFoundError as fault:
        raise BadInput(f"{fault}: benchmarks/published/black_boxes.py says how to install it") from None


def _row(
    model: str, records: Records, cpu: float, simulated: Callable[[pd.DataFrame], Array]
) -> dict[str, Any]:
    errors = {test: records.rmse(test, simulated(record)) for test, record in records.tests.items()}
    return {"model": model, "cpu": cpu, "rmse": errors}
