"""The page of a diagnosis opens from disk, needs nothing else, and says what diagnosis.json says."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from pipeline.report.equations import ELEMENTS
from tests.diagnosis.chain_answers import by_evidence
from tests.diagnosis.diagnoses import BENCH, friction
from tests.report.case import Page
from tests.report.test_site import check_addresses
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.where.where import Where, where
from unmodelled.report.diagnosis_page import command_of, write_page
from unmodelled.report.figures import files as figures
from unmodelled.report.figures.files import write_figures
from unmodelled.report.formula import formula
from unmodelled.report.headline import headline

COMMAND = "python -m pipeline diagnose system=<b>.yaml logs=logs out=out"


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[Diagnosis, Where]:
    diagnosis = friction(tmp_path_factory.mktemp("case"), replace(BENCH, runs=4, samples=300))
    return diagnosis, where(diagnosis)


@pytest.fixture(scope="module")
def folder(found: tuple[Diagnosis, Where], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All that a diagnosis writes but the page."""
    return written(*found, tmp_path_factory.mktemp("diagnosis"))


def written(diagnosis: Diagnosis, place: Where, out: Path) -> Path:
    write_tables(diagnosis, place, out)
    write_json(out / "diagnosis.json", summary(diagnosis, place))
    write_figures(out)
    return out


def page_of(source: Path, out: Path, **changes: Any) -> str:
    """The page of a copy in which some entries of diagnosis.json are others."""
    shutil.copytree(source, out)
    content = json.loads((out / "diagnosis.json").read_text())
    (out / "diagnosis.json").write_text(json.dumps(content | changes))
    write_page(out, COMMAND)
    return (out / "index.html").read_text()


def test_the_page_needs_nothing_else(folder: Path, tmp_path: Path) -> None:
    text = page_of(folder, tmp_path / "out")
    check_addresses(tmp_path / "out", {"index.html": text})
    page = Page(text)
    assert not re.search(r'<(?:link|script)[^>]*(?:href|src)="(?!data:)', text)
    images = [address for address in page.addresses if address.startswith("data:image/svg+xml;base64,")]
    assert len(images) == len(list((folder / "figures").glob("*.svg"))) == 7
    assert {"verdict", "effects", "where", "lacking", "notes"} <= set(page.ids)
    assert "https://" not in re.sub(r"data:[^\"]*", "", text)
    write_page(tmp_path / "out", COMMAND)
    assert (tmp_path / "out" / "index.html").read_text() == text


def test_the_page_says_what_was_found(folder: Path, tmp_path: Path) -> None:
    text = page_of(folder, tmp_path / "out")
    amount = r'<h1 class="sentence">[\d.]+\xa0mN\xa0m of Coulomb friction at joint: '
    falls = r"the error after 0\.1\xa0s falls from [\d.]+\xa0mrad to [\d.]+\xa0[mµ]rad on experiments that"
    assert re.search(amount + falls, text)
    assert re.search(r"<title>Coulomb friction at joint explains \d+(?:\.\d)?\u202f% of the gap \(", text)
    assert re.search(r">What remains is [\d.]+ times the error that sensor noise alone causes\.<", text)
    assert "<mi>τ</mi><mo>=</mo>" in text and "<mi>sign</mi>" in text
    models = (tmp_path / "out" / "tables" / "models.csv").read_text().splitlines()
    assert models[0] == "Model,Probability,Why it is not the one,Difference,Standard error"
    assert [row.partition(",")[0] for row in models[1:]] == [
        *("Coulomb friction at joint", "viscous friction at joint", "no effect")
    ]
    for part in ("viscous friction at joint", "omega was estimated from theta", "system=&lt;b&gt;.yaml"):
        assert part in text
    rows = (tmp_path / "out" / "tables" / "effect_1.csv").read_text().splitlines()
    assert rows[0] == "Number,Value,95 % interval,Unit" and rows[1].startswith("F_c,0.0")


def test_the_page_of_an_answer_by_evidence(
    found: tuple[Diagnosis, Where], folder: Path, tmp_path: Path
) -> None:
    """Kind before form, how the logs were made, evidence by length; without them nothing of it is there."""
    diagnosis, place = found
    out = written(by_evidence(diagnosis), place, tmp_path / "out")
    write_page(out, COMMAND)
    text = (out / "index.html").read_text()
    page, plain = Page(text), text.replace("\xa0", " ")
    kind = "Dry friction at joint 94 %, damping at joint 2 %, something else 4 %"
    for part in (
        f'<h1 class="sentence">{kind}</h1>',
        "<p>Form: Coulomb friction 72 %, hysteresis (Dahl) 22 %. Other kinds: viscous friction 2 %.</p>",
        "<strong>Next:</strong> simulate augmented_system.yaml on new logs",
        "N m of Coulomb friction at joint: the error after 0.1 s falls from",
        f"<title>{kind}",
        "Experiment run1 does not follow this law: look at what was different there.",
        "<h3>Dry friction at joint",
        "<li>torque acts 12 ms late</li>",
        "Evidence of laws, by length of the windows.",
    ):
        assert part in plain
    assert {"made", "evidence", "chain_parts", "law_evidence"} <= set(page.ids)
    tables = {name: (out / "tables" / f"{name}.csv").read_text() for name in ("law_evidence", "chain_parts")}
    laws = tables["law_evidence"].splitlines()
    assert laws[0] == "Law,Windows (s),Evidence (nats),Removed" and len(laws) == 14
    assert laws[1].startswith("Coulomb friction at joint,0.1,420.0,") and laws[-1].startswith(
        "quadratic drag"
    )
    assert "sensor_gain,sensor:theta,4.3,0.07,%" in tables["chain_parts"]
    before = page_of(folder, tmp_path / "before")
    assert not {"made", "evidence", "chain_parts", "law_evidence"} & set(Page(before).ids)


def test_every_law_that_was_fitted_has_its_error_and_why_it_is_not_the_one(
    folder: Path, tmp_path: Path
) -> None:
    content = json.loads((folder / "diagnosis.json").read_text())
    errors = {"theta": {"value": 0.0123, "unit": "rad"}}
    rows = [row | {"probability": 0.4, "errors": errors, "horizon": 0.1} for row in content["comparison"]]
    text = page_of(folder, tmp_path / "out", comparison=rows)
    plain = text.replace("\xa0", " ")
    for part in (
        ">12.3 mrad</td>",
        "free runs over windows of 0.1 s",
        "leaves out a named effect, and predicts experiments left out worse",
        "the error that sensor noise alone causes is left",
        "error of theta after 0.1 s, as given and with the effects",
    ):
        assert part in plain
    search = json.loads(re.search(r'id="search-data">(.*?)</script>', text)[1])  # type: ignore[index]
    assert any("12.3" in one["text"] and one["url"] == "#models" for one in search)
    assert text.count('<p class="command">') == 1


def test_the_command_of_a_page_has_relative_paths_and_all_that_was_given(tmp_path: Path) -> None:
    files = {name: str(Path.cwd() / "machine" / name) for name in ("system", "logs", "laws")}
    content = {"sources": files, "gap": {"horizon": 0.1}, "seed": 3, "options": {"level": 0.99}}
    assert command_of(content, Path.cwd() / "answer") == (
        "unmodelled diagnose system=machine/system logs=machine/logs laws=machine/laws horizon=0.1 seed=3 "
        "'options={level: 0.99}' out=answer"
    )


SVG_NAME = "{http://www.w3.org/2000/svg}"


def drawings(text: str) -> list[ElementTree.Element]:
    return [ElementTree.fromstring(svg) for svg in re.findall(r"<svg class=.*?</svg>", text, re.DOTALL)]


def test_the_machine_is_drawn_with_what_is_missing(folder: Path, tmp_path: Path) -> None:
    found = drawings(page_of(folder, tmp_path / "out"))
    assert [svg.get("class") for svg in found] == ["wide", "narrow"]
    for svg in found:
        (guilty,) = (
            g
            for g in svg.iter(f"{SVG_NAME}g")
            if (r := g.find(f"{SVG_NAME}rect")) is not None and r.get("class") == "guilty"
        )
        lines = [text.text for text in guilty.iter(f"{SVG_NAME}text")]
        assert lines[:2] == ["port joint", "effort tau (N\u00a0m)"]
        assert (
            " ".join(filter(None, lines[2:]))
            == "✕ missing: Coulomb friction 100\u202f% of the gap enters here"
        )
        words = {text.text for text in svg.iter(f"{SVG_NAME}text")}
        assert {"torque (N\u00a0m)", "actuator of torque", "sensor of theta", "theta (rad)"} <= words
        width, height = (float(n) for n in str(svg.get("viewBox")).split()[2:])
        for rect in svg.iter(f"{SVG_NAME}rect"):
            x, y, w, h = (float(rect.get(key, "nan")) for key in ("x", "y", "width", "height"))
            assert x >= 0.0 and y >= 0.0 and x + w <= width and y + h <= height


def test_a_suspect_is_marked_where_no_effect_was_found(folder: Path, tmp_path: Path) -> None:
    text = page_of(folder, tmp_path / "out", verdict="unknown", effects=[])
    for svg in drawings(text):
        assert [r.get("class") for r in svg.iter(f"{SVG_NAME}rect")].count("guilty") == 1
        assert "missing:" not in ElementTree.tostring(svg, "unicode")
    assert not drawings(page_of(folder, tmp_path / "old", verdict="no_gap", effects=[], where=NOWHERE))[
        0
    ].findall(f".//{SVG_NAME}rect[@class='guilty']")


NOWHERE: dict[str, Any] = {"channels": [], "regions": [], "factors": [], "experiments": []}


def test_other_verdicts(folder: Path, tmp_path: Path) -> None:
    content = json.loads((folder / "diagnosis.json").read_text())
    nowhere = content["where"] | {"channels": [], "regions": [], "factors": []}
    text = page_of(folder, tmp_path / "none", verdict="no_gap", effects=[], where=nowhere)
    assert "<h1>No gap that matters.</h1>" in text
    assert "Nowhere: there is no gap to divide." in text
    left = {"share": 0.11, "predictable": 0.07, "channel": "actuator:torque"}
    text = page_of(folder, tmp_path / "part", verdict="main_effect", remainder=left)
    assert re.search(r"<title>.* of the gap \(confidence \d+\u202f%\); more is missing\.", text)
    assert ">More is missing: what remains is" in text
    assert "11\u202f% of the squared error; a network in every port predicts 7\u202f% of the whole." in text
    assert "The further effect that predicts best is at input torque." in text
    assert headline(content | {"verdict": "unknown", "effects": []}).startswith(
        "No law of the library explains the gap. What is left looks like an effort at joint (100\u202f%"
    )


def test_what_is_missing_shows_as_missing(folder: Path, tmp_path: Path) -> None:
    content = json.loads((folder / "diagnosis.json").read_text())
    (effect,) = content["effects"]
    numbers = {"F_c": {"value": None, "unit": "N m", "interval": [None, None]}}
    numbers |= {"b_deviation": {"value": 0.1, "unit": "1", "interval": [0, 0.2], "values": {"run0": 0.1}}}
    local = effect | {"parameters": numbers, "factor": "m", "level": 1.5, "port": "sensor:theta"}
    factors = content["where"] | {"factors": [{"factor": "m", "level": 1.5, "share": 0.4}]}
    text = page_of(folder, tmp_path / "out", effects=[local], where=factors, parameters={}, notes=[])
    for part in (
        "where m is 1.5",
        "one value for each of 1 experiments",
        "theta as it is shown",
        "Nothing to note.",
    ):
        assert part in text
    assert (tmp_path / "out" / "tables" / "factors.csv").read_text() == "Factor,Level,Share\nm,1.5,0.4\n"


def test_damaged_input_is_named(folder: Path, tmp_path: Path) -> None:
    page_of(folder, tmp_path / "out")
    (tmp_path / "out" / "diagnosis.json").write_text("{")
    with pytest.raises(BadInput, match=r"diagnosis\.json: not a JSON file"):
        write_page(tmp_path / "out", COMMAND)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("F_c*sign(v)", "F_c · sign ( v )"),
        ("-k*(x - x_0)/2", "− k · ( x − x_0 ) / 2"),
        ("a - (b - c)", "a − ( b − c )"),
        ("(a + b)**2", "( a + b ) ^ 2"),
        ("b*abs(omega)*omega", "b · | ω | · ω"),
        ("exp(-(v/v_s)**2)", "e ^ − ( v / v_s ) ^ 2"),
        ("where(v > 0, F_p, -F_n)", "{ F_p if v > 0 − F_n else"),
        ("(m == 1.5)*F_c", "( m = 1.5 ) · F_c"),
        ("sqrt(x) + min(a, 2e-7)", "√ x + min ( a , 2e-07 )"),
    ],
)
def test_laws_are_printed_in_order(text: str, expected: str) -> None:
    root = ElementTree.fromstring(formula(text))
    assert {element.tag for element in root.iter()} <= ELEMENTS
    assert " ".join(_read(root).split()) == expected


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ("u_f, T_u*d(u_f)/dt = u - u_f", ["F = u_f", "T_u · d u_f / d t = u − u_f"]),
        ("F_b*sign(v - d(r)/dt), abs(r) <= delta", ["F = F_b · sign ( v − d r / d t )", "| r | ≤ δ"]),
        ("F_h*clip(z, -1, 1)", ["F = F_h · clip ( z , − 1 , 1 )"]),
    ],
)
def test_a_law_of_several_equations_has_a_line_for_each(law: str, expected: list[str]) -> None:
    lines = ElementTree.fromstring(f"<div>{formula(law, 'F')}</div>")
    assert [" ".join(_read(line).split()) for line in lines] == expected


def test_a_law_that_is_too_long_for_a_formula_is_shown_as_it_is(folder: Path, tmp_path: Path) -> None:
    content = json.loads((folder / "diagnosis.json").read_text())
    law = " + ".join(["F_c*(omega < 1)"] * 1000)
    text = page_of(folder, tmp_path / "out", effects=[content["effects"][0] | {"law": law}])
    assert "<code>tau = F_c*(omega &lt; 1) + F_c*(omega &lt; 1)" in text


def _read(element: ElementTree.Element) -> str:
    parts = [_read(child) for child in element]
    match element.tag:
        case "msub":
            return f"{parts[0].strip()}_{parts[1].strip()}"
        case "msup":
            return f" {parts[0]} ^ {parts[1]} "
        case "mfrac":
            return f" {parts[0]} / {parts[1]} "
        case "msqrt":
            return f" √ {' '.join(parts)} "
    return f" {element.text or ''} {' '.join(parts)} "


def test_what_is_no_law_is_no_formula() -> None:
    with pytest.raises(BadInput):
        formula("__import__('os')")
    for text in ("mod(theta, 2*pi)", "u(t - delay)"):
        ElementTree.fromstring(formula(text, "u as it acts"))


def test_an_effect_at_many_places_is_told_once() -> None:
    """With the range of its numbers."""
    friction = [
        {
            "family": "coulomb_friction",
            "port": f"joint{k}",
            "parameters": {f"F_{k}": {"value": value, "unit": "N m", "interval": [0.9 * value, 1.1 * value]}},
        }
        for k, value in enumerate((2.5, 50.0, 7.0))
    ]
    damping = {"value": 900.0, "unit": "N m s", "interval": [800.0, 1000.0]}
    doubtful = {"F_3": {"value": 0.1, "unit": "N m", "interval": [0.0, 0.2]}, "d_3": damping}
    content = {"verdict": "effect", "confidence": 0.8, "gap": {"shrink": 0.9}}
    assert headline(content | {"effects": friction}).startswith(
        "Coulomb friction at 3 places (2.5\xa0N\xa0m to 50\xa0N\xa0m) explains"
    )
    friction.append({"family": "coulomb_friction", "port": "joint3", "parameters": doubtful})
    told = headline(content | {"effects": friction})
    assert "at 4 places (2.5\xa0N\xa0m to 50\xa0N\xa0m at 3 of them) explains" in told
    assert headline(content | {"effects": friction[:2]}).startswith(
        "Coulomb friction at joint0 and Coulomb friction at joint1 explain"
    )


@pytest.mark.parametrize("name", figures.FIGURES)
def test_a_caption_names_no_colour_that_only_some_answers_have(name: str) -> None:
    """What is green beside an effect is blue without one; a legend says which is which."""
    words = set(re.findall(r"[a-z]+", (figures.FIGURES[name].__doc__ or "").lower()))
    assert not words & {"purple", "orange", "blue"} and ("green" not in words or name == "evidence")
