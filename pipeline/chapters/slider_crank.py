"""Tables of chapter 4 from the predictions of its models."""

import re
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.base.parquet import read_parquet
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function

#: Name in the system file, in formulas, meaning, and name on the virtual bench.
PARAMETERS = (
    ("m1", "$m_1$", "mass of crank", "crank_mass"),
    ("m2", "$m_2$", "mass of connecting rod", "rod_mass"),
    ("m3", "$m_3$", "mass of slider", "slider_mass"),
    ("l1", "$l_1$", "length of crank", "crank_length"),
    ("l2", "$l_2$", "length of connecting rod", "rod_length"),
    ("J1", "$J_1$", "inertia of motor and crank", "shaft_inertia"),
    ("B_m", "$B_m$", "friction coefficient of motor", "damping"),
)
#: Models whose parameters are followed while they converge -> name of the set.
SETS = {"hybrid_m3": "m3_J1_Bm", "hybrid_l1": "l1_J1_Bm", "hybrid_l1_m3": "l1_m3_J1_Bm"}
CAMPAIGNS = {"slider_crank": "spring", "slider_crank_bare": "no_spring"}


def cells(folder: Path) -> list[tuple[str, int, bool, str, Path]]:
    """Find the cells <model>/<split> in a folder."""
    found = []
    for path in sorted(p for p in folder.glob("[!.]*/[!.]*") if p.is_dir()):
        recurrent = re.fullmatch(r"nnap_recurrent_(\d+)", path.parent.name)
        model, horizon = ("nnap", int(recurrent[1])) if recurrent else (path.parent.name, 0)
        found.append((model, horizon, recurrent is not None, path.name, path))
    if not found:
        raise BadInput(f"{folder}: no <model>/<split>")
    return found


def gathered(predictions: Path, fits: Path, kind: str) -> pd.DataFrame:
    """Read one table of all cells, and add the columns model, split, horizon and extra."""
    parts = []
    for model, horizon, extra, split, path in cells(predictions):
        fit = read_json(fits / path.parent.name / path.name / "fit.json")
        about = {"model": model, "split": split, "horizon": horizon or fit["horizon"], "extra": extra}
        parts.append(read_parquet(path / f"{kind}.parquet").assign(**about))
    return pd.concat(parts, ignore_index=True)


def histories(fits: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the parameters after every epoch, and the time per epoch of the recurrent models."""
    history, timing = [], []
    for model, horizon, extra, split, path in cells(fits):
        table = read_parquet(path / "history.parquet")
        if model in SETS and split == "leave_one_out":
            index = ["fold", "repeat", "epoch"]
            long = table.drop(columns=["loss", "seconds"]).melt(index, var_name="parameter")
            history.append(long.assign(set=SETS[model]))
        if extra:
            seconds = table.groupby("fold", sort=False)["seconds"].median()
            timing.append(pd.DataFrame({"fold": seconds.index, "seconds_per_epoch": seconds.to_numpy()}))
            timing[-1].insert(0, "horizon", horizon)
    return pd.concat(history, ignore_index=True), pd.concat(timing, ignore_index=True)


def parameters(system: System, bench: Path) -> pd.DataFrame:
    """Return table 4.1: parameters in the system file, and their true values on the virtual bench."""
    truth = read_json(bench)
    known = {p.name: p for p in system.parameters}
    rows = []
    for name, symbol, meaning, key in PARAMETERS:
        p = known[name]
        low, high = p.limits if p.bounds is not None else (np.nan, np.nan)
        rows.append((name, symbol, meaning, p.unit, p.value, truth[key], low, high))
    columns = ["parameter", "symbol", "meaning", "unit", "known", "truth", "low", "high"]
    return pd.DataFrame(rows, columns=columns)


def signals(system: System, logs: Logs) -> pd.DataFrame:
    """Return id, t, theta, omega and T, with d and v computed from the geometry at the measured states."""
    geometry = numpy_system_function(system, [system.signals["d"], system.signals["v"]], efforts_zero=True)
    e = np.zeros(len(system.ports))
    d, v = geometry(logs.t, logs.x, logs.u, e, np.array(system.values), logs.c[logs.owner]).T
    states = {name: logs.x[:, j] for j, name in enumerate(logs.states)}
    head = {"id": np.array(logs.ids)[logs.owner], "t": logs.t, **states}
    return pd.DataFrame({**head, "T": logs.u[:, 0], "d": d, "v": v})


def experiments(logs: Logs) -> pd.DataFrame:
    """Return id, profile, start, speed (rms of omega, rad/s) and slow (whether in the slower half)."""
    table = logs.experiments_with_speed()
    speed = table["rms_omega"].to_numpy(np.float64)
    order = np.argsort(speed, kind="stable")
    slow = np.isin(np.arange(len(order)), order[: len(order) // 2])
    columns = table[["id", "profile", "start"]].astype({"profile": int})
    return columns.assign(speed=speed, slow=slow)


def forces(
    predictions: dict[str, Path], measured: dict[str, pd.DataFrame], truth: dict[str, Path]
) -> pd.DataFrame:
    """Return the forces of the networks in the training data, beside the true load of the bench."""
    parts = []
    for campaign, folder in predictions.items():
        own = measured[campaign][["id", "t", "d", "v"]]
        load = _sample_by_sample(own, read_parquet(truth[campaign]))
        for model, _, extra, split, path in cells(folder):
            if extra or split != "leave_one_out" or model not in ("hybrid_free", "nnap_split"):
                continue
            efforts = read_parquet(path / "efforts.parquet").drop(columns=["id", "t"])
            columns = {name: efforts[name].to_numpy() for name in efforts}
            if "F" not in columns:
                columns["F"] = columns["F_c"] + columns["F_nc"]
            blank = {name: np.nan for name in ("F_c", "F_nc") if name not in columns}
            table = own.assign(**columns, **blank, F_true=load, campaign=campaign, stage="converged")
            parts.append(table.assign(model="nnap" if model == "hybrid_free" else model))
    return pd.concat(parts, ignore_index=True)


def _sample_by_sample(own: pd.DataFrame, truth: pd.DataFrame) -> Array:
    """The bench's load at the samples of `own`; its clock has no jitter, so that samples are counted."""
    tables = (table.assign(sample=table.groupby("id").cumcount()) for table in (own, truth))
    joined = next(tables)[["id", "sample"]].merge(next(tables), on=["id", "sample"], how="left")
    return np.asarray(joined["F"], np.float64)


def surface(predictions: Path) -> pd.DataFrame:
    """Return stage, d, v and force F of the network of a fold on a grid, before and after training."""
    table = read_parquet(predictions / "surface.parquet")
    return table.rename(columns={"q0": "d", "q1": "v", "effort": "F"}).drop(columns="network")


def spring_errors(force: pd.DataFrame, spring: pd.DataFrame) -> dict[str, Array]:
    """Return the error (samples,) of the conservative network as a spring, at the visited positions."""
    split = force[force["model"] == "nnap_split"]
    result = {}
    for campaign, table in split.groupby("campaign"):
        true = np.interp(table["d"], spring["d"], spring["F"]) if campaign == "spring" else 0.0
        result[str(campaign)] = np.asarray(table["F_c"] - true, np.float64)
    return result
