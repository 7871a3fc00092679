"""The site opens from disk: its links resolve, it escapes what it shows, and damaged input is named."""

import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from pipeline.chapters import verdicts
from pipeline.report.claims import VERDICTS, claims_table, read_full
from pipeline.report.pages import PAGES as DECLARED
from tests.conftest import ROOT, files_of
from tests.report.case import (
    Page,
    claim,
    execution,
    figure,
    formula,
    make,
    put,
    write_diagnosis,
    write_inputs,
)
from unmodelled.base.errors import BadInput
from unmodelled.report.rendering import STATIC

EVIL = "<script>alert('x')</script>"
PAGES = {"index.html", *(f"site/{page.file}" for page in DECLARED[1:])}


@pytest.fixture
def inputs(tmp_path: Path) -> Path:
    return write_inputs(tmp_path / "inputs")


def check_addresses(out: Path, pages: dict[str, str]) -> None:
    parsed = {(out / name).resolve(): Page(text) for name, text in pages.items()}
    for file, page in parsed.items():
        assert len(page.ids) == len(set(page.ids)), file
        for address in page.addresses:
            parts = urlsplit(address)
            if parts.scheme == "data":
                continue
            assert not parts.scheme and not parts.netloc, f"{file}: {address} needs a network"
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.is_file(), f"{file}: {address}"
            if parts.fragment:
                assert parts.fragment in parsed[target].ids, f"{file}: {address}"


def test_pages_links_and_banner(inputs: Path, tmp_path: Path) -> None:
    pages = make(inputs, tmp_path / "out")
    assert set(pages) == PAGES
    check_addresses(tmp_path / "out", pages)
    virtual = ("index.html", *(f"site/{name}.html" for name in ("chapter_5", "chapter_6", "data", "runs")))
    assert all("Virtual campaign – simulated logs, not measurements" in pages[name] for name in virtual)
    assert all("No campaign yet" in pages[f"site/{name}.html"] for name in ("real", "withheld"))
    assert "make real" in pages["site/real.html"]
    home = pages["index.html"]
    assert home.index("Figure 6.24") < home.index("Figure 6.20") < home.index("Figure 5.11")
    assert "Figure 6.23" not in home and "180" in home and "virtual bench" in home
    assert "free run" in pages["site/chapter_6.html"] and "stall" in pages["site/chapter_5.html"]
    assert 'width="667" height="400"' in home


def test_search_finds_what_exists(inputs: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    pages = make(inputs, out)
    text = (out / "site" / "search.js").read_text()
    entries = json.loads(text.removeprefix("window.SEARCH = ").rstrip(";\n"))
    assert {entry["kind"] for entry in entries} == {"page", "figure", "claim", "table", "metrics"}
    for entry in entries:
        file, _, anchor = entry["url"].partition("#")
        target = (out / "site" / file).resolve().relative_to(out.resolve()).as_posix()
        assert not anchor or anchor in Page(pages[target]).ids


def test_measured_data_are_named_and_exceptions_marked(inputs: Path, tmp_path: Path) -> None:
    put(
        inputs / "raw" / "cam_follower" / "provenance.json",
        {"data": "measured", "description": "bench", "experiments": 1600},
    )
    pages = make(inputs, tmp_path / "out")
    assert all("Measured data" in pages[f"site/{name}.html"] for name in ("chapter_6", "data", "runs"))
    assert "Measured data" in pages["index.html"]
    assert "results on this page are from virtual data" in pages["site/chapter_6.html"]


def test_everything_is_escaped(inputs: Path, tmp_path: Path) -> None:
    put(inputs / "bench" / "claims.json", [claim(claim=EVIL, protocol=EVIL, page=EVIL)])
    put(inputs / "figures" / "figures.json", [figure("6.20", caption=EVIL, note=EVIL)])
    put(inputs / "tables" / "table_5_1.csv", f"{EVIL},value\n<b>,1\n")
    pages = make(inputs, tmp_path / "out")
    assert not [name for name, text in pages.items() if "<script>alert" in text or "<b>" in text]
    assert "&lt;script&gt;alert" in pages["index.html"]


@pytest.mark.long
def test_equal_inputs_give_equal_bytes(inputs: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    for out in (first, second, second):  # the last one replaces an old site
        make(inputs, out)
    assert files_of(first) == files_of(second)


def test_missing_inputs_are_said_to_be_missing(tmp_path: Path) -> None:
    pages = make(tmp_path / "nothing", tmp_path / "out")
    assert set(pages) == PAGES
    check_addresses(tmp_path / "out", pages)
    assert "No claims yet" in pages["index.html"] and "No figures yet" in pages["index.html"]
    assert "No fitted models yet" in pages["site/runs.html"]
    assert all("No campaign yet" in text for text in pages.values())


def test_results_without_a_page_of_their_own_get_one(inputs: Path, tmp_path: Path) -> None:
    put(inputs / "bench" / "claims.json", [claim(chapter=3)])
    put(
        inputs / "metrics" / "robot.json",
        {"data": "measured", "arm": {"verdict": {"value": "found", "unit": "-"}}},
    )
    put(inputs / "tables" / "extra.csv", "a\n1\n")
    pages = make(inputs, tmp_path / "out")
    assert set(pages) == PAGES | {"site/chapter_3.html", "site/other.html"}
    check_addresses(tmp_path / "out", pages)
    assert "extra" in pages["site/other.html"] and "arm · verdict" in pages["site/other.html"]


def test_a_diagnosis_has_a_page_in_the_site(inputs: Path, tmp_path: Path) -> None:
    write_diagnosis(inputs / "diagnoses" / "real" / "emps" / "coulomb_withheld")
    out = tmp_path / "out"
    pages = make(inputs, out)
    assert set(pages) == PAGES | {"site/diagnoses/emps_coulomb_withheld/index.html"}
    check_addresses(out, pages)
    verdict = "Coulomb friction at rail explains 98\u202f% of the gap (confidence 94\u202f%)."
    for name in ("index.html", "site/real.html", "site/diagnoses/emps_coulomb_withheld/index.html"):
        assert verdict in pages[name]
    assert verdict not in pages["site/withheld.html"]
    rows = (out / "site/diagnoses/emps_coulomb_withheld/tables/effect_1.csv").read_text().splitlines()
    assert rows[1] == "F_c,22.4,22.10 to 22.80,N"


def test_a_damaged_diagnosis_is_named(inputs: Path, tmp_path: Path) -> None:
    folder = inputs / "diagnoses" / "slider_crank"
    write_diagnosis(folder)
    content = json.loads((folder / "diagnosis.json").read_text())
    put(folder / "diagnosis.json", {**content, "gap": {}})
    with pytest.raises(BadInput, match="slider_crank: not a diagnosis"):
        make(inputs, tmp_path / "out")


def test_times_seeds_configurations_and_versions_of_the_stages(inputs: Path, tmp_path: Path) -> None:
    cells = {"train@a": 90.0, "train@b": 30.0, "acquire": 5.0}
    for stage, seconds in cells.items():
        put(inputs / "executions" / f"{stage}.json", execution(stage, seconds=seconds))
    put(
        inputs / "executions" / "draw.json",
        execution("draw", seconds=15.0, versions={"python": "3.12.0"}, seed=None),
    )
    out = tmp_path / "out"
    pages = make(inputs, out)
    check_addresses(out, pages)
    tables = {name: (out / f"site/tables/{name}.csv").read_text() for name in ("stages", "versions")}
    assert tables["stages"].splitlines()[1:3] == ["train,2,120.0,90.0,0.8571", "draw,1,15.0,15.0,0.1071"]
    assert "python,3.11.2,3\npython,3.12.0,1\ntorch,2.13.0,3\n" in tables["versions"]
    runs = pages["site/runs.html"]
    assert "2 min 20 s of wall time added up" in runs and 'href="configs/train%40a.txt"' in runs
    assert "seed: 0" in (out / "site/configs/train@a.txt").read_text()
    assert "4 cells of the stage graph, 2 min 20 s added up" in pages["index.html"]


def test_measured_machines_have_a_page(inputs: Path, tmp_path: Path) -> None:
    leaf = {"value": "effect", "n": 3}
    put(inputs / "metrics" / "real.json", {"data": "measured", "emps": {"nothing": {"verdict": leaf}}})
    put(inputs / "tables" / "real_left_over.csv", "withheld,where\nnothing,q from 0 to 1\n")
    put(inputs / "tables" / "real_left_over.json", {"title": "What is left", "data": "measured"})
    put(inputs / "tables" / "real_gaps.csv", "a column without rows\n")
    put(inputs / "tables" / "real_gaps.json", {"title": "Gaps", "protocol": "no protocol of nothing"})
    put(inputs / "tables" / "real.csv", f"machine,known\nemps,{'a sentence of some length ' * 2}\n")
    pages = make(inputs, tmp_path / "out")
    assert set(pages) == PAGES
    page = pages["site/real.html"]
    assert "Gaps" in page and "0 rows" in page
    assert "a column without rows" not in page and "no protocol of nothing" not in page
    assert re.search(r'<td data-label="known" class="words">a sentence', page)
    assert "emps · nothing · verdict" in page and "q from 0 to 1" in page and "measured" in page


def test_every_verdict_has_a_tile_and_a_colour(inputs: Path, tmp_path: Path) -> None:
    every = [verdicts.HOLDS, verdicts.DIRECTION, verdicts.FAILS, verdicts.TOO_FEW, verdicts.UNTESTED]
    counts = {verdict: 7 + k for k, verdict in enumerate(every)}
    rows = [claim(id=f"{VERDICTS[v]}_{k}", verdict=v) for v, count in counts.items() for k in range(count)]
    put(inputs / "bench" / "claims.json", rows)
    page, style = make(inputs, tmp_path / "out")["index.html"], (STATIC / "style.css").read_text()
    for verdict, count in counts.items():
        kind = VERDICTS[verdict]
        label = f'<span>claims <span class="verdict {kind}">{verdict}<'
        (found,) = re.findall(rf'data-show="{kind}"><strong>(\d+)</strong>{label}', page)
        assert int(found) == count
        assert page.count(f'class="verdict {kind}"') == 1 + count
        assert f".{kind} {{ color:" in style and f".{kind}::before" in style


def test_verdicts_of_a_full_run_stand_beside_and_sort(inputs: Path, tmp_path: Path) -> None:
    rows = [claim(id=name, claim=name, verdict="too few repeats") for name in ("second", "first", "unknown")]
    full = [claim(id="second", verdict="does not hold", ours=8.25), claim(id="first", ours="a 1, b 2, c 3")]
    put(inputs / "bench" / "claims.json", rows)
    put(inputs / "full.csv", claims_table("full", full).csv)
    page = make(inputs, tmp_path / "out")["index.html"]
    table = page.partition('id="claims-index"')[2]
    assert table.index(">first<") < table.index(">second<") < table.index(">unknown<")
    assert 'class="full verdict fails">does not hold</span>' in table and "8.25 V" in table
    tiles = dict(re.findall(r'data-show="(\w+)"><strong>(\d+)', page))
    assert tiles == {"holds": "1", "fails": "1", "direction": "0", "few": "0", "untestable": "0"}
    assert re.findall(r"<span>(\d) in this run", page) == ["0", "0", "0", "3", "0"]
    put(inputs / "full.csv", "id,verdict\nfirst,true\n")
    with pytest.raises(BadInput, match="claim 'first': must have a verdict"):
        make(inputs, tmp_path / "out")


def test_the_committed_full_run_has_every_claim() -> None:
    full = read_full(ROOT / "docs" / "results" / "claims.csv")
    assert set(full) == {row["id"] for row in json.loads((ROOT / "reports" / "claims.json").read_text())}
    kinds = verdicts.HOLDS, verdicts.DIRECTION, verdicts.FAILS, verdicts.UNTESTED
    said = [sum(row["verdict"] == kind for row in full.values()) for kind in kinds]
    assert sum(said) == len(full)
    claims = "Of its {} claims, {} hold, {} hold in direction and {} do not".format(len(full), *said[:3])
    assert claims in " ".join((ROOT / "README.md").read_text().split())
    assert "| all | {} | {} | {} |".format(*said[:3]) in (ROOT / "docs" / "results" / "README.md").read_text()


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("bench/claims.json", "{", "not a JSON file"),
        ("bench/claims.json", {"id": 1}, "must be a list of objects"),
        ("bench/claims.json", [{"id": 1}], "row 1 has no chapter"),
        ("bench/claims.json", [claim(verdict="true")], "verdict 'true', must be one of holds"),
        ("bench/claims.json", [claim(interval=[1])], "must be two numbers"),
        ("bench/equations.json", {"chapter": 6}, "must have chapter and rows"),
        ("bench/equations.json", formula("<math><script>alert(1)</script></math>"), "script is not part"),
        ("bench/equations.json", formula("<math onclick='a()'/>"), "math is not part of a formula"),
        ("bench/equations.json", formula("<math>"), "not MathML"),
        ("raw/cam_follower/provenance.json", {"data": "invented"}, "must be one of measured, virtual"),
        ("metrics/chapter6.json", [], "must be an object"),
        ("metrics/chapter6.json", {"data": "virtual", "a": {"value": 1, "interval": 2}}, "a interval 2"),
        ("tables/table_5_1.csv", "a,b\n1\n", "equally long rows"),
        ("tables/table_5_1.csv", "", "header"),
        ("tables/table_5_1.json", "[", "not a JSON file"),
        ("figures/figures.json", [figure("6.20", id="../6")], "must be letters"),
        ("fits/cam_follower/f_h2/extrapolation/fit.json", "nonsense", "not a JSON file"),
        ("executions/train.json", {"stage": "train"}, "has no command"),
        ("diagnoses/emps/figures/figures.json", [], "diagnosis.json: no such file"),
    ],
)
def test_damaged_input_is_named(
    inputs: Path, tmp_path: Path, name: str, content: Any, complaint: str
) -> None:
    put(inputs / name, content)
    with pytest.raises(BadInput, match=complaint) as caught:
        make(inputs, tmp_path / "out")
    assert str(inputs / name.split("/figures/")[0]) in str(caught.value) and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_a_listed_figure_must_exist(inputs: Path, tmp_path: Path) -> None:
    (inputs / "figures" / "fig_6_20.svg").unlink()
    with pytest.raises(BadInput, match=r"fig_6_20\.svg: no such file"):
        make(inputs, tmp_path / "out")


def test_equations_are_typeset_and_named_as_written(inputs: Path, tmp_path: Path) -> None:
    put(inputs / "bench" / "equations.json", formula("<math><mi>v</mi><mo>=</mo><mn>1</mn></math>"))
    page = make(inputs, tmp_path / "out")["site/chapter_6.html"]
    assert "<math><mi>v</mi><mo>=</mo><mn>1</mn></math>" in page and 'title="v"' in page
    assert 'href="#equations"' in page


def test_the_page_of_an_answer_runs_its_machine(
    inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_diagnosis(inputs / "diagnoses" / "virtual" / "bench")
    name = "site/diagnoses/bench/index.html"
    assert "live-data" not in make(inputs, tmp_path / "without")[name]
    monkeypatch.setattr("pipeline.report.site.live_data", lambda folder, shown: '{"steps": 1}')
    page = make(inputs, tmp_path / "out")[name]
    assert '<script type="application/json" id="live-data">{"steps": 1}</script>' in page
    assert 'id="live-machine"' in page and 'href="#live"' in page
    loaded = re.findall(r'(?:src|href)="(\.\./\.\./[\w.]+\.(?:js|css))"', page)
    assert {"../../live.js", "../../uplot.min.js", "../../uplot.min.css", "../../report.js"} <= set(loaded)
    assert all((tmp_path / "out" / name).parent.joinpath(link).exists() for link in loaded)
