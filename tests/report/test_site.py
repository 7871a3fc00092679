"""The site opens from disk: its links resolve, it escapes what it shows, and damaged input is named."""

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from pipeline.errors import BadInput
from pipeline.report.tables import number, quantity
from pipeline.stages.report import report

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 500.5 300"><path d="M0 0h9"/></svg>'
EVIL = "<script>alert('x')</script>"
PAGES = {
    "index.html",
    *(f"site/chapter_{number}.html" for number in (3, 4, 5, 6)),
    *(f"site/{name}.html" for name in ("emps", "cam_drivetrain", "withheld", "data", "runs")),
}


def claim(**changes: Any) -> dict[str, Any]:
    return {
        "id": "hybrids",
        "chapter": 6,
        "page": "section 6.5.2",
        "claim": "hybrids extrapolate better",
        "dissertation": "better",
        "ours": 0.25123,
        "interval": [0.23, 0.28],
        "unit": "V",
        "protocol": "ten repeats",
        "data": "virtual",
        "verdict": "holds",
    } | changes


def formula(mathml: str) -> dict[str, Any]:
    return {"chapter": 6, "rows": [{"kind": "dynamics", "text": "v", "mathml": mathml}]}


def figure(number: str, **changes: Any) -> dict[str, Any]:
    about = {
        "caption": f"caption of {number}",
        "note": "note",
        "command": "python -m pipeline draw",
        "data": "virtual",
    }
    return (
        {"id": f"fig_{number.replace('.', '_')}", "number": number, "chapter": int(number[0])}
        | about
        | changes
    )


def put(path: Path, content: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))


@pytest.fixture
def inputs(tmp_path: Path) -> Path:
    folder = tmp_path / "inputs"
    leaf = {"value": 0.25, "unit": "V", "interval": [0.23, 0.28], "n": 10}
    head = {"data": "virtual", "profile": "quick", "revision": "abc1234", "seconds": 3.5}
    put(
        folder / "metrics" / "chapter6.json",
        {**head, "protocol": "free run", "boundary": {"10%": {"f_h2": leaf}}},
    )
    put(folder / "metrics" / "cam_labels.json", {**head, "stall": {"value": 9, "unit": "runs", "n": 180}})
    put(
        folder / "bench" / "claims.json",
        [claim(), claim(id="none", chapter=5, page=98, ours=None, interval=None)],
    )
    put(folder / "tables" / "table_5_1.csv", "name,value\na,0.123456\nb,\n")
    put(folder / "tables" / "table_5_1.json", {"title": "Table 5.1", "caption": "cams", "chapter": 5})
    numbers = ("6.20", "6.23", "6.24", "5.11", "5.4")
    put(folder / "figures" / "figures.json", [figure(n) for n in numbers])
    for n in numbers:
        put(folder / "figures" / f"fig_{n.replace('.', '_')}.svg", SVG)
    put(
        folder / "raw" / "cam_follower" / "provenance.json",
        {"data": "virtual", "description": "virtual bench", "experiments": 180},
    )
    fit = {"folds": ["10%", "20%"], "repeats": 3, "seed": 0, "seconds": 1.5, "parameters": 1234}
    put(folder / "fits" / "cam_follower" / "f_h2" / "extrapolation" / "fit.json", fit)
    return folder


def make(inputs: Path, out: Path) -> dict[str, str]:
    """Build; return the text of every page by its address."""
    folders = {name: inputs / name for name in ("metrics", "tables", "figures")}
    files = {"claims": inputs, "provenance": inputs / "raw"}
    report(**folders, **files, runs=inputs / "fits", out=out)
    return {path.relative_to(out).as_posix(): path.read_text() for path in out.rglob("*.html")}


class Page(HTMLParser):
    """Addresses, ids and scripts of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.addresses += [value for key in ("href", "src") if (value := given.get(key))]
        self.ids += [value for key, value in attrs if key == "id" and value]


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
    assert all("Virtual campaign – simulated logs, not measurements" in text for text in pages.values())
    home = pages["index.html"]
    assert home.index("Figure 6.20") < home.index("Figure 6.23") < home.index("Figure 5.11")
    assert "Figure 6.24" not in home
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
    assert all("Measured data" in text for text in pages.values())
    assert "results on this page are from virtual data" in pages["site/chapter_6.html"]


def test_everything_is_escaped(inputs: Path, tmp_path: Path) -> None:
    put(inputs / "bench" / "claims.json", [claim(claim=EVIL, protocol=EVIL, page=EVIL)])
    put(inputs / "figures" / "figures.json", [figure("6.20", caption=EVIL, note=EVIL)])
    put(inputs / "tables" / "table_5_1.csv", f"{EVIL},value\n<b>,1\n")
    pages = make(inputs, tmp_path / "out")
    assert not [name for name, text in pages.items() if "<script>alert" in text or "<b>" in text]
    assert "&lt;script&gt;alert" in pages["index.html"]


def test_equal_inputs_give_equal_bytes(inputs: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    for out in (first, second, second):  # the last one replaces an old site
        make(inputs, out)
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(second) for path in second.rglob("*") if path.is_file())
    assert all((first / file).read_bytes() == (second / file).read_bytes() for file in files)


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


@pytest.mark.parametrize("machine", ["emps", "cam_drivetrain"])
def test_a_measured_machine_has_a_page(machine: str, inputs: Path, tmp_path: Path) -> None:
    leaf = {"value": "effect", "n": 3}
    put(inputs / "metrics" / "real.json", {"data": "measured", machine: {"nothing": {"verdict": leaf}}})
    put(inputs / "tables" / f"{machine}_left_over.csv", "withheld,where\nnothing,q from 0 to 1\n")
    put(inputs / "tables" / f"{machine}_left_over.json", {"title": "What is left", "data": "measured"})
    pages = make(inputs, tmp_path / "out")
    assert set(pages) == PAGES
    page = pages[f"site/{machine}.html"]
    assert f"{machine} · nothing · verdict" in page and "q from 0 to 1" in page and "measured" in page


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
    ],
)
def test_damaged_input_is_named(
    inputs: Path, tmp_path: Path, name: str, content: Any, complaint: str
) -> None:
    put(inputs / name, content)
    with pytest.raises(BadInput, match=complaint) as caught:
        make(inputs, tmp_path / "out")
    assert str(inputs / name) in str(caught.value) and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_a_listed_figure_must_exist(inputs: Path, tmp_path: Path) -> None:
    (inputs / "figures" / "fig_6_20.svg").unlink()
    with pytest.raises(BadInput, match=r"fig_6_20\.svg: no such file"):
        make(inputs, tmp_path / "out")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (float("nan"), "–"),
        (754, "754"),
        (12345, "12\u202f345"),
        (-0.123456, "−0.1235"),
        (1.234e-7, "1.23×10⁻⁷"),
        (98765.4, "98\u202f765"),
        (0.0, "0"),
        (2e9, "2.00×10⁹"),
        ("H2 < H1", "H2 < H1"),
    ],
)
def test_numbers_have_sensible_digits(value: Any, text: str) -> None:
    assert number(value) == text


def test_an_interval_sets_the_digits() -> None:
    assert quantity(0.251234, [0.2312, 0.2799]) == ("0.251", "0.231 to 0.280")
    assert quantity(-41.23, [-48.3, -35.1]) == ("−41", "−48 to −35")
    assert quantity(3.0, [3.0, 3.0]) == ("3", "3 to 3")
    assert quantity(None, None) == ("–", "")


def test_equations_are_typeset_and_named_as_written(inputs: Path, tmp_path: Path) -> None:
    put(inputs / "bench" / "equations.json", formula("<math><mi>v</mi><mo>=</mo><mn>1</mn></math>"))
    page = make(inputs, tmp_path / "out")["site/chapter_6.html"]
    assert "<math><mi>v</mi><mo>=</mo><mn>1</mn></math>" in page and 'title="v"' in page
    assert 'href="#equations"' in page
