"""What the tests share: small campaigns, in memory and on disk."""

import gc
import os
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import settings

from unmodelled.base.campaign import Campaign
from unmodelled.base.progress import VARIABLE

ROOT = Path(__file__).parents[1]

# a first example may compile, and a busy machine is slow: how long an example takes is no property
settings.register_profile("no deadline", deadline=None)
settings.load_profile("no deadline")

os.environ["DVC_NO_ANALYTICS"] = "1"  # projects of the tests have no .dvc/config that says so


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the file that takes longest by far first, so that no core waits for it in the end."""
    items.sort(key=lambda item: "tests/graph/test_graph.py" not in item.nodeid)


def pytest_collection_finish() -> None:
    """Spare the garbage collector from going through all modules and tests again and again.

    That took a tenth of the processor time of all tests.
    """
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


@pytest.fixture(autouse=True)
def _progress_is_shown_as_before() -> Iterator[None]:
    """A command with -q says so to the processes that it starts, by a variable of the environment."""
    before = os.environ.get(VARIABLE)
    yield
    if before is None:
        os.environ.pop(VARIABLE, None)
    else:
        os.environ[VARIABLE] = before


@pytest.fixture(autouse=True)
def _numpy_errors_are_errors() -> None:
    np.seterr(divide="raise", invalid="raise")


@pytest.fixture(scope="session")
def dataset_path() -> Path:
    """The measured data set, where it is at hand."""
    path = os.environ.get("CAM_FOLLOWER_DATASET", "")
    if not path or not Path(path).exists():
        pytest.skip("the measured data set is not here: set CAM_FOLLOWER_DATASET to its folder or zip")
    return Path(path)


def stages() -> dict[str, Any]:
    """The stages of the graph by their names."""
    found: dict[str, Any] = yaml.safe_load((ROOT / "dvc.yaml").read_text())["stages"]
    return found


def files_of(folder: Path) -> dict[str, bytes]:
    """All files below a folder."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def log_text(n: int = 200, period: float = 0.0005, rate: float = 12.0) -> list[list[str]]:
    """Cells of a well-formed log: seven rows of `n` columns."""
    t = np.arange(n) * period
    theta = np.mod(rate * t, 2 * np.pi)
    h = 0.01 * np.sin(theta)
    rows = (t, theta, np.full(n, rate), np.sin(t), h, h, 1e-5 * np.cos(t))
    return [[f"{x:.5g}" for x in row] for row in rows]


def write_archive(path: Path, logs: dict[int, list[list[str]]], parameters: str | None = None) -> Path:
    """A campaign archive of the given logs."""
    table = parameters
    if table is None:
        table = "exp,H,beta,m,V\n" + "".join(f"{i},0.03,3.14,1.1238,{5 + i}\n" for i in logs)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("Dataset/parameters.csv", table)
        for exp, rows in logs.items():
            archive.writestr(f"Dataset/experiments/exp{exp}.csv", "\n".join(",".join(r) for r in rows) + "\n")
    return path


def campaign_of(rows: Sequence[Mapping[str, Any]], logs: Sequence[Mapping[str, np.ndarray]]) -> Campaign:
    """A virtual campaign of experiments, which are numbered from 1, and their logs."""
    table = pd.DataFrame(rows)
    table.insert(0, "exp", range(1, len(rows) + 1))
    signals = {name: np.concatenate([log[name] for log in logs]) for name in logs[0]}
    offsets = np.cumsum([0, *(len(log["t"]) for log in logs)]).astype(np.int64)
    return Campaign(table, signals, offsets, {"data": "virtual"})


@pytest.fixture(scope="session")
def small_campaign() -> Campaign:
    """Thirty smooth runs at 100 Hz that a drivetrain could have made."""
    generator = np.random.default_rng(0)
    rows, logs = [], []
    for i in range(30):
        H, beta = [(0.01, np.pi), (0.03, 0.5 * np.pi)][i % 2]
        V = 4.0 + 0.2 * i
        n = 120 + 2 * i
        t = np.arange(n) * 0.01
        final = 3.5 * V - 9.0
        omega = final * (1 - np.exp(-t / 0.1)) + 0.05 * generator.standard_normal(n)
        logs.append({"t": t, "theta": np.cumsum(omega) * 0.01, "omega": omega})
        row = {"H": H, "beta": beta, "m": 0.7 + 0.02 * i, "V": V, "label": "contact" if i < 26 else "jump"}
        rows.append(row | {"f_min": 10.0 - 0.3 * i, "eps_share": 0.001 * i})
    return campaign_of(rows, logs)


@pytest.fixture(scope="session")
def jump_campaign() -> Campaign:
    """Forty runs at 100 Hz on a grid: eps is what a leaky integrator makes of a negative force."""
    generator = np.random.default_rng(0)
    grid = [
        (H, beta, m, V) for H in (0.01, 0.03) for beta in (1.5, 3.0) for m in (0.7, 1.3) for V in range(5)
    ]
    rows, logs = [], []
    for i, (H, beta, m, V) in enumerate(grid):
        n = 120 - 10 * V
        t = np.arange(n) * 0.01
        omega = (12.0 + 6.0 * V) * (1 - np.exp(-t / 0.05)) + 0.05 * generator.standard_normal(n)
        theta = np.cumsum(omega) * 0.01
        force = 9.81 * m - H * m * omega**2 * np.cos(beta * np.sin(theta))
        eps = np.zeros(n)
        for k in range(1, n):
            eps[k] = 0.7 * eps[k - 1] + 3e-4 * max(0.0, -force[k])
        eps += 1e-6 * generator.standard_normal(n)
        h = H * np.sin(0.5 * theta) ** 2
        signals = {"t": t, "theta": theta, "omega": omega, "alpha": np.gradient(omega, 0.01), "eps": eps}
        signals |= {"h": h, "F_dagger": force} | {
            k: np.gradient(h, 0.01) for k in ("dh", "d2h", "h_dot", "h_ddot")
        }
        logs.append(signals)
        share = eps.max() / H
        label = "stall" if i == 0 else "jump" if share > 0.013 else "contact"
        row = {"H": H, "beta": beta, "m": m, "V": 4.0 + V, "label": label, "eps_share": share}
        rows.append(row | {"f_min": force.min(), "f_bar_min": force.min(), "samples": n})
    return campaign_of(rows, logs)
