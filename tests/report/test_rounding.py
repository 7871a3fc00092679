"""Numbers that are in git have the digits that another machine reproduces."""

import json
import re
from pathlib import Path

import pandas as pd

from pipeline.chapters.readable import rounded, write_metrics, write_table
from pipeline.report.results import Results
from pipeline.stages.site import summary
from tests.conftest import ROOT


def test_numbers_in_git_have_four_digits(tmp_path: Path) -> None:
    assert rounded({"a": [1.23456e-9, (7, "1.23456", None, True)]}) == {
        "a": [1.235e-9, [7, "1.23456", None, True]]
    }
    write_metrics(tmp_path, "x", "virtual", "quick", {"a": {"value": 0.123456, "n": 123456}})
    content = json.loads((tmp_path / "metrics" / "x.json").read_text())
    assert content["a"] == {"value": 0.1235, "n": 123456} and set(content) == {
        "a",
        "data",
        "profile",
        "revision",
    }
    write_table(tmp_path / "x", pd.DataFrame({"a": [0.123456], "b": [123456]}), None, "", "")
    assert (tmp_path / "x.csv").read_text() == "a,b\n0.1235,123456\n"


def test_no_number_in_git_has_more_or_is_a_time() -> None:
    for path in [*(ROOT / "reports" / "metrics").glob("*.json"), ROOT / "reports" / "claims.json"]:
        if path.stem != "benchmarks":  # speeds, which `make bench` measures
            text = path.read_text()
            assert json.loads(text) == rounded(json.loads(text)), path
            assert not re.search(r'"(seconds|memory)\w*":', text), path


def test_the_summary_counts_verdicts_and_right_answers() -> None:
    claims = [{"verdict": verdict} for verdict in ("holds", "holds", "does not hold")]
    metrics = {"real": {"cases": {"holds": {"value": 3}}}}
    found = summary(Results(claims=claims, metrics=metrics))
    assert found == {"holds": 2, "direction": 0, "fails": 1, "few": 0, "untestable": 0, "machines": 3}
