"""Benchmarks are run by hand; that what they measure is still where they look for it is seen here."""

from importlib import import_module
from pathlib import Path

import pytest

import benchmarks
from benchmarks.__main__ import table

FILES = sorted(Path(next(iter(benchmarks.__path__))).glob("[!_]*.py"))


# shap asks matplotlib for what will be removed
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
@pytest.mark.parametrize("name", [path.stem for path in FILES])
def test_imports(name: str) -> None:
    import_module(f"benchmarks.{name}")


def test_the_table_names_the_work_and_begins_with_the_largest_ratio() -> None:
    measured = {"peer_version": "peer 1.0", "ours": 2.0, "threads": 1, "ratio_low": 1.4, "ratio_high": 5.5}
    results = {
        "free_run": {**measured, "peer": 3.0, "ratio": 1.5},
        "lstm_training": {**measured, "peer": 10.0, "ratio": 5.0, "ours_xla": 1.0},
    }
    rows = table(results)
    assert list(rows["times as fast"]) == [5.0, 1.5]
    assert "nn.LSTM" in rows["work"][0]
    assert rows["peer"][0] == "peer 1.0"
    assert list(rows["peer (s)"] / rows["ours (s)"]) == list(rows["times as fast"])
