"""Tables of chapter 3 about the wet clutch: measurements, and one engagement in detail."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.chapters.phases import trajectories
from unmodelled.base.errors import BadInput
from unmodelled.base.parquet import read_parquet
from unmodelled.logs.logs import Logs
from unmodelled.systems.experiments import Experiments
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function

EVENT = "shift"
#: Signals of the system file that figures 3.19 and 3.20 show.
SHOWN = ("z", "p_plates", "delta_t", "T_c", "T_1", "T_b")
#: Samples between two rows of the table of an engagement.
THINNED = 8


def engagement(system: System, logs: Logs, name: str) -> pd.DataFrame:
    """Return one engagement, measured and simulated with the nominal parameters, both phases."""
    if name not in logs.ids:
        raise BadInput(f"experiment {name}: is not among the logs")
    i = logs.ids.index(name)
    rows = logs.rows(i)
    start = logs.x[rows][:1]
    runs = Experiments(logs.u[rows][None], logs.period, logs.c[[i]], start)
    nominal = np.ones((1, len(system.uncertain)))
    found = trajectories(system, EVENT, system.uncertain, nominal, runs, THINNED * logs.period)
    u = runs.input(found.t[:, None])[:, 0]
    x = found.x[0, 0]
    signals = numpy_system_function(system, [system.signals[s] for s in SHOWN], efforts_zero=True)
    values = signals(found.t, x, u, np.empty(0), np.array(system.values), logs.c[i])
    table = {"t": found.t, "u": u[:, 0]}
    measured = logs.y[rows][::THINNED][: len(found.t)]
    table |= {f"measured_{output}": measured[:, j] for j, output in enumerate(logs.outputs)}
    table |= {state: x[:, j] for j, state in enumerate(logs.states)}
    table |= {signal: values[:, j] for j, signal in enumerate(SHOWN)}
    after = found.t >= found.time[0, 0]
    # once both shafts turn together the torque that passes is the converter's (section 3.8)
    table["T_c"] = np.where(after, table["T_1"], table["T_c"])
    return pd.DataFrame(table).assign(synchronous=after)


def currents(logs: Logs) -> pd.DataFrame:
    """Return the feedforward signal of every profile: columns profile, t (s) and u (A)."""
    table = logs.experiments
    first = table.reset_index(drop=True).groupby("profile").head(1)
    parts = []
    for i, row in first.iterrows():
        rows = logs.rows(int(i))
        own = {"t": logs.t[rows][::THINNED], "u": logs.u[rows, 0][::THINNED]}
        parts.append(pd.DataFrame({"profile": int(row["profile"]), **own}))
    return pd.concat(parts, ignore_index=True)


def gathered(folders: Sequence[tuple[str, Path]], name: str) -> pd.DataFrame:
    """Read one table of all campaigns, and add a column campaign."""
    parts = []
    for campaign, folder in folders:
        table = read_parquet(folder / f"{name}.parquet")
        table.insert(0, "campaign", campaign)
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


def interpolated_samples(sampling: pd.DataFrame, mae: float) -> float:
    """Return the simulations per point with which sampling reaches an error, interpolated in logarithms."""
    curve = sampling.groupby("samples")["mae"].mean().sort_index()
    sizes, errors = np.log(curve.index.to_numpy(np.float64)), np.log(curve.to_numpy())
    goal = np.log(mae)
    below = np.flatnonzero(errors <= goal)
    if not len(below):
        return float("nan")
    k = int(below[0])
    if k == 0:
        return float(np.exp(sizes[0]))
    share = (goal - errors[k - 1]) / (errors[k] - errors[k - 1])
    return float(np.exp(sizes[k - 1] + share * (sizes[k] - sizes[k - 1])))
