"""What simulate, diagnose, identifiability and identify_uncertainty return: texts, tables, pages, files."""

import inspect
import os
import re
from dataclasses import FrozenInstanceError, fields, replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

import unmodelled as um
from tests.conftest import files_of
from tests.diagnosis.diagnoses import HELD_OUT, Said, diagnosis
from tests.diagnosis.studies import HORIZON, JOINT
from tests.diagnosis.test_augmented import CASES
from unmodelled.base.files import read_json
from unmodelled.base.markers import MARKER
from unmodelled.base.next_step import next_step
from unmodelled.base.parquet import read_parquet
from unmodelled.base.progress import say, silence
from unmodelled.diagnosis.answer.findings import Findings
from unmodelled.diagnosis.where.where import where
from unmodelled.learning.uncertainty.identified import CLIPPED_NORMAL
from unmodelled.learning.uncertainty.problem import callable_response
from unmodelled.report.diagnosis_page import command_of
from unmodelled.report.figures.files import figures_of

CONF = Path(um.__file__).parent / "conf"
#: What is saved of an answer without its pages.
FILES = {"diagnosis.json", "augmented_system.yaml", "tables"}
FRICTION = Said("coulomb_friction", JOINT, {"F_c": 0.06, "v_c": 0.05})


@pytest.fixture(scope="module")
def simulation() -> um.Simulation:
    return um.simulate(*um.example("pendulum"))


@pytest.fixture(scope="module")
def answer(tmp_path_factory: pytest.TempPathFactory) -> um.Answer:
    """A diagnosis whose numbers are simply said."""
    found = diagnosis(tmp_path_factory.mktemp("case"), FRICTION)
    return um.Answer.of(Findings(found, where(found), exported=True))


@pytest.fixture(scope="module")
def study() -> um.ParameterStudy:
    return um.identifiability(*um.example("pendulum"))


@pytest.fixture(scope="module")
def uncertainty() -> um.IdentifiedUncertainty:
    gain = np.linspace(1.0, 2.0, 8)
    model = callable_response(lambda theta: np.asarray(theta * gain), ["theta"], [[0.5, 1.5]])
    drawn = gain * np.random.default_rng(0).normal(1.0, 0.1, 8)
    observed = pd.DataFrame({"id": [f"P{k}" for k in range(8)], "y": drawn})
    return um.identify_response(model, observed, data_sets=2)


#: Fixtures, and the verbs that make such results.
RESULTS = {"simulation": "simulate", "answer": "diagnose", "study": "identifiability"}
RESULTS |= {"uncertainty": "identify_uncertainty"}


@pytest.fixture(params=RESULTS)
def result(request: pytest.FixtureRequest) -> Any:
    return request.getfixturevalue(request.param)


def test_a_result_prints_itself_in_sentences(result: Any) -> None:
    assert str(result) == repr(result)
    assert "object at 0x" not in repr(result) and len(repr(result).splitlines()) > 2
    assert max(map(len, repr(result).splitlines())) < 250


def test_a_result_is_frozen(result: Any) -> None:
    with pytest.raises(FrozenInstanceError):
        result.system = None


def test_a_notebook_shows_a_result_as_a_heading_with_tables(result: Any) -> None:
    page = result._repr_html_()
    assert page.startswith("<div>\n<h4>") and page.count("<table") == page.count("</table>") > 0
    assert "<script" not in page


def test_a_result_has_a_table(result: Any) -> None:
    table = result.table()
    assert isinstance(table, pd.DataFrame) and len(table) > 0


@pytest.mark.long
@pytest.mark.parametrize("name", RESULTS)
def test_a_saved_result_is_that_of_its_verb(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    result = request.getfixturevalue(name)
    result.save(tmp_path / "out")
    result.save(tmp_path / "out")
    assert read_json(tmp_path / "out" / MARKER)["made_by"] == RESULTS[name]


@pytest.mark.parametrize("name", RESULTS)
def test_a_folder_that_no_verb_made_is_refused(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(um.BadInput, match=r"holds 'thesis.tex' and has no file .made_by"):
        request.getfixturevalue(name).save(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_result_is_not_saved_over_its_logs(answer: um.Answer) -> None:
    _, logs = answer.inputs()
    before = sorted(Path(logs.source).iterdir())
    with pytest.raises(um.BadInput, match=r"is the input logs="):
        answer.save(logs.source)
    with pytest.raises(um.BadInput, match=r"lies inside the input logs="):
        answer.save(Path(logs.source) / "out")
    assert sorted(Path(logs.source).iterdir()) == before


@pytest.mark.long
def test_a_saved_answer_is_read_back(answer: um.Answer, tmp_path: Path) -> None:
    answer.save(tmp_path / "out")
    read = um.read_answer(tmp_path / "out")
    assert (read.verdict, read.confidence, read.notes) == (answer.verdict, answer.confidence, answer.notes)
    for name in ("gaps", "units", "parameters"):
        pd.testing.assert_frame_equal(getattr(read, name), getattr(answer, name))
    pd.testing.assert_frame_equal(read.table(), answer.table())
    assert read.effects == answer.effects and read.system == answer.system
    assert len(read.plot("lacking").axes) == len(answer.plot("lacking").axes)
    assert str(read) == str(answer)
    read.save(tmp_path / "copy")
    assert um.read_answer(tmp_path / "copy").table().equals(answer.table())
    with pytest.raises(um.BadInput, match=r"is the input answer="):
        read.save(tmp_path / "out")
    _, logs = answer.inputs()
    assert um.simulate(read, logs).value == pytest.approx(um.simulate(answer, logs).value)


def test_an_answer_of_a_stranger_is_saved_without_what_its_links_show(
    answer: um.Answer, tmp_path: Path
) -> None:
    answer.save(tmp_path / "theirs", pages=False)
    (tmp_path / "secrets").mkdir()
    (tmp_path / "secrets" / "key").write_text("secret")
    (tmp_path / "theirs" / "key\x1b[31m.csv").symlink_to(tmp_path / "secrets" / "key")
    (tmp_path / "theirs" / "figures").symlink_to(tmp_path / "secrets")
    notes = um.read_answer(tmp_path / "theirs").save(tmp_path / "mine", pages=False)
    assert [note.split()[0] for note in notes] == ["figures", "key\\x1b[31m.csv"]
    assert {path.name for path in (tmp_path / "mine").iterdir()} == {*FILES, MARKER}


def test_an_answer_that_is_a_link_is_not_saved_without_itself(answer: um.Answer, tmp_path: Path) -> None:
    answer.save(tmp_path / "theirs", pages=False)
    (tmp_path / "theirs" / "diagnosis.json").rename(tmp_path / "elsewhere.json")
    (tmp_path / "theirs" / "diagnosis.json").symlink_to(tmp_path / "elsewhere.json")
    with pytest.raises(um.BadInput, match=r"diagnosis.json: is a link"):
        um.read_answer(tmp_path / "theirs").save(tmp_path / "mine", pages=False)
    assert not (tmp_path / "mine").exists()


def test_a_folder_without_an_answer_is_refused(tmp_path: Path) -> None:
    with pytest.raises(um.BadInput, match=r"diagnosis.json: no such file"):
        um.read_answer(tmp_path)
    (tmp_path / "diagnosis.json").write_text('{"schema": "diagnosis/1"}')
    with pytest.raises(um.BadInput, match=r"is no answer of this version \(schema diagnosis/2\): diagnose"):
        um.read_answer(tmp_path)


def test_a_result_of_one_verb_does_not_replace_that_of_another(
    study: um.ParameterStudy, simulation: um.Simulation, tmp_path: Path
) -> None:
    study.save(tmp_path / "out")
    with pytest.raises(um.BadInput, match="was made by identifiability, not by simulate"):
        simulation.save(tmp_path / "out")


def test_the_table_of_a_simulation_is_the_file(simulation: um.Simulation, tmp_path: Path) -> None:
    simulation.save(tmp_path / "out")
    pd.testing.assert_frame_equal(read_parquet(tmp_path / "out" / "simulation.parquet"), simulation.table())
    content = read_json(tmp_path / "out" / "simulation.json")
    assert content["gap"]["known"] == simulation.value and content["gap"]["floor"] == simulation.floor
    errors = simulation.units.set_index("output").loc["theta"]
    assert content["gap"]["units"]["theta"]["known_whole_run"] == errors["whole_run"]


def test_a_simulation_is_drawn_as_it_is_in_the_table(simulation: um.Simulation) -> None:
    own = simulation.table().query("experiment == 'run2'")
    axes = simulation.plot("run2").axes
    measured, simulated, error = (line for each in axes for line in each.get_lines())
    np.testing.assert_array_equal(measured.get_ydata(), own["theta_measured"])
    np.testing.assert_array_equal(simulated.get_ydata(), own["theta_simulated"])
    np.testing.assert_allclose(error.get_ydata(), own["theta_simulated"] - own["theta_measured"])
    with pytest.raises(um.BadInput, match="'run22' was not simulated; did you mean 'run2'"):
        simulation.plot("run22")


def test_a_notebook_shows_a_figure_as_a_file_has_it(simulation: um.Simulation) -> None:
    text = simulation.plot()._repr_svg_()  # type: ignore[attr-defined]
    assert text.startswith("<?xml") and "</svg>" in text


@pytest.mark.long
def test_an_answer_says_what_diagnosis_json_says(answer: um.Answer, tmp_path: Path) -> None:
    assert answer.save(tmp_path / "out") == ()
    content = read_json(tmp_path / "out" / "diagnosis.json")
    assert (answer.verdict, answer.confidence, answer.shrink) == ("effect", 0.94, 0.99)
    (effect,) = answer.effects
    assert (effect.family, effect.port) == ("coulomb_friction", "joint")
    assert effect.parameters == content["effects"][0]["parameters"]
    assert effect.indistinguishable == ("Stribeck friction at joint",)
    assert answer.table()["value"].tolist() == [p["value"] for p in effect.parameters.values()]
    number = content["effects"][0]["parameters"]["F_c"]
    assert (effect.F_c.value, effect.F_c.unit) == (number["value"], number["unit"])
    assert [*effect.F_c.interval] == number["interval"] and "F_c" in dir(effect)
    with pytest.raises(AttributeError, match="no attribute or number 'F_v'"):
        effect.F_v  # noqa: B018
    compared = answer.comparison
    assert compared["rank"].tolist() == list(range(1, 1 + len(content["comparison"])))
    assert compared["difference"].is_monotonic_increasing and compared["named"].sum() == 1
    assert len(str(compared).splitlines()) == 1 + len(compared) and "..." not in str(compared)
    assert answer.where.experiments.to_dict("records") == content["where"]["experiments"]
    models = ("known", "reidentified", "augmented", "neural", "floor", "persistence")
    assert answer.gaps.set_index("model")["gap"].to_dict() == {name: content["gap"][name] for name in models}
    assert answer.units["augmented"].tolist() == [content["gap"]["units"]["theta"]["augmented"]]
    assert answer.parameters["identified"].tolist() == [content["parameters"]["b"]["identified"]]
    assert answer.notes == tuple(content["notes"])


def test_an_interruption_while_figures_are_drawn_leaves_the_older_answer_whole(
    answer: um.Answer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Into a new folder the answer itself is written first, which a diagnosis of hours is worth."""

    def interrupted(folder: Path) -> dict[str, Exception]:
        raise KeyboardInterrupt

    out = tmp_path / "out"
    answer.save(out, pages=False)
    (out / "diagnosis.json").write_text("{}")  # an older one
    older = files_of(out)
    monkeypatch.setattr("unmodelled.api.answer.write_figures", interrupted)
    for place in (out, tmp_path / "new"):
        with pytest.raises(KeyboardInterrupt):
            answer.save(place)
    assert files_of(out) == older
    assert {path.name for path in (tmp_path / "new").glob("[!.]*")} == FILES
    assert {path.name for path in tmp_path.iterdir()} == {"out", "new"}


def test_the_system_of_an_answer_is_the_file_that_is_saved(answer: um.Answer, tmp_path: Path) -> None:
    answer.save(tmp_path / "out", pages=False)
    read = um.read_system(tmp_path / "out" / "augmented_system.yaml")
    _, logs = answer.inputs()
    saved, own = um.simulate(read, logs), um.simulate(answer.system, logs)
    assert saved.value == pytest.approx(own.value, rel=1e-9)
    assert {p.name for p in (tmp_path / "out").iterdir()} == {MARKER, *FILES}
    assert not (tmp_path / "out" / "tables" / "live.json").exists()  # data of a page that is not made


@pytest.mark.parametrize("name", ["coulomb", "group", "memory", "order", "scatter", "late_input", "many"])
def test_the_system_of_an_answer_is_simulated_along_the_same_logs(name: str, tmp_path: Path) -> None:
    said, timing = CASES[name]
    found = diagnosis(tmp_path / "case", *said, timing=timing)
    own = um.Answer.of(Findings(found, where(found), exported=True))
    held_out = [found.logs.ids[i] for i in HELD_OUT]
    again = um.simulate(own.system, found.logs, HORIZON, held_out)
    assert again.value == pytest.approx(found.augmented.gap.value, rel=1e-6)


@pytest.mark.long
def test_the_page_names_the_command_that_gives_the_same_answer(answer: um.Answer, tmp_path: Path) -> None:
    answer.save(tmp_path / "out")
    system, logs = answer.inputs()
    paths = {"system": system.source, "logs": logs.source, "out": tmp_path / "out"}
    files, logged, out = (f"{name}={os.path.relpath(path)}" for name, path in paths.items())
    page = unescape((tmp_path / "out" / "index.html").read_text())
    command = f"unmodelled diagnose {files} {logged} horizon={HORIZON} seed=3 {out}"
    assert page.count(f">{command}<") == 1
    without = command_of({**answer.content, "without": ["drift", "scatter"]}, tmp_path / "out")
    assert without == command.replace(" out=", " 'without=[drift,scatter]' out=")


def test_every_figure_of_the_page_can_be_drawn_by_its_name(answer: um.Answer) -> None:
    for name in figures_of(answer.folder):
        assert answer.plot(name).axes
    assert answer.plot()._repr_svg_() == answer.plot("gap")._repr_svg_()  # type: ignore[attr-defined]
    with pytest.raises(um.BadInput, match="figure: there is no 'gaps'; did you mean 'gap'"):
        answer.plot("gaps")


@pytest.mark.long
def test_of_logs_in_degrees_there_is_an_answer_without_effects(tmp_path: Path) -> None:
    system, logs = um.example("pendulum")
    degrees = logs.table().assign(theta=lambda rows: np.degrees(rows["theta"]))
    found = um.diagnose(system, um.Logs.from_frames(dict(iter(degrees.groupby("experiment"))), system))
    assert (found.verdict, found.effects, found.system) == ("check_logs", (), system)
    assert len(found.table()) == 0 and "degrees" in repr(found)
    assert found.plot()._repr_svg_() == found.plot("experiments")._repr_svg_()  # type: ignore[attr-defined]
    with pytest.raises(um.BadInput, match="figure: there is no 'gap'"):
        found.plot("gap")
    assert found.save(tmp_path / "out") == ()
    page = (tmp_path / "out" / "index.html").read_text()
    assert "degrees" in page and "unmodelled diagnose" not in page  # logs in memory are no argument
    assert not (tmp_path / "out" / "augmented_system.yaml").exists()


def test_what_cannot_be_diagnosed_is_refused_without_naming_files() -> None:
    system, logs = um.example("pendulum")
    (frame,) = (rows for name, rows in logs.table().groupby("experiment") if name == "run1")
    with pytest.raises(um.BadInput, match=r"^logs: column id: 1 experiment, too short .* needs 2 or more"):
        um.diagnose(system, um.Logs.from_frames({"run1": frame.head(90)}, system))


def test_effects_and_places_print_themselves(answer: um.Answer) -> None:
    assert "Coulomb friction at joint" in repr(answer.effects[0])
    assert "channels" in repr(answer.where) and "joint" in repr(answer.where)
    assert answer.where._repr_html_().count("<table") >= 2


def test_every_public_attribute_of_an_answer_is_documented_typed_and_readable(
    answer: um.Answer, tmp_path: Path
) -> None:
    refused = {"file": "augmented_system.yaml", "reason": "theta diverges", "keep": "pendulum.yaml"}
    fit = {"converged": True, "evaluations": 80, "seconds": 4.2}
    told = replace(answer, content={**answer.content, "refused": [refused], "fit": fit})
    assert told.refused == ("augmented_system.yaml is not offered: theta diverges; keep pendulum.yaml",)
    with pytest.raises(um.BadInput, match=r"not written: augmented_system\.yaml is not offered"):
        um.write_fmu(told, tmp_path / "machine.fmu")
    kinds = {"DataFrame": pd.DataFrame, "ComparisonTable": pd.DataFrame, "GapLocation": type(answer.where)}
    kinds |= {"FitSummary | None": tuple, "str": str, "float": float, "System": um.System, "Path": Path}
    attributes = {field.name for field in fields(um.Answer)}
    for name in [name for name in dir(um.Answer) if not name.startswith("_") and name not in attributes]:
        member = inspect.getattr_static(um.Answer, name)
        function = getattr(member, "fget", None) or getattr(member, "func", None)
        about = function or getattr(member, "__func__", member)
        assert inspect.getdoc(about) and about.__annotations__["return"], name
        if function is None:
            continue  # a method
        value, kind = getattr(told, name), about.__annotations__["return"].partition("[")[0]
        assert isinstance(value, tuple if kind == "tuple" else kinds[kind.rpartition(".")[2]]), name
        assert not re.search(r"<\S+ object at|\b[A-Z]\w+\(\w+=", str(value)), name
    assert attributes and all(f"{name}: " in str(um.Answer.__doc__) for name in attributes)


def test_a_study_gives_the_tables_that_it_saves(study: um.ParameterStudy, tmp_path: Path) -> None:
    study.save(tmp_path / "out")
    tables = {"sensitivity": study.sensitivity, "correlation": study.correlation, "advice": study.table()}
    for name, table in tables.items():
        pd.testing.assert_frame_equal(read_parquet(tmp_path / "out" / f"{name}.parquet"), table)
    assert read_json(tmp_path / "out" / "identifiability.json")["advice"] == list(study.advice)
    assert all(f"- {line}" in repr(study) for line in study.advice)


def test_estimates_are_saved(uncertainty: um.IdentifiedUncertainty, tmp_path: Path) -> None:
    uncertainty.save(tmp_path / "out")
    saved = read_parquet(tmp_path / "out" / "estimates.parquet")
    pd.testing.assert_frame_equal(saved, uncertainty.table())
    assert read_json(tmp_path / "out" / "uncertainty.json")["advice"] == list(uncertainty.advice)


def test_the_distribution_that_is_assumed_is_that_of_the_command_line() -> None:
    written = instantiate(OmegaConf.load(CONF / "uncertainty" / "clipped_normal.yaml"))
    given = {"deviations": tuple(written.deviations), "nodes": tuple(written.nodes)}
    assert replace(written, family=written.family.func, **given) == CLIPPED_NORMAL


@pytest.mark.parametrize(
    ("observed", "words"),
    [
        ({"y": [1.0, 2.0]}, "observations: column id is missing"),
        ({"id": [], "y": []}, "observations: row 1: no observations below it"),
        ({"id": ["a", "b"], "y": [1.0, np.nan]}, "row 2: column y: is not a finite number"),
        ({"id": ["a"], "y": [1.0]}, "must have 2 rows, one for every output of the model, got 1"),
    ],
)
def test_observations_that_cannot_be_used_are_refused(observed: dict[str, list[Any]], words: str) -> None:
    model = callable_response(lambda theta: np.hstack([theta, 2.0 * theta]), ["a"], [[0.5, 1.5]])
    with pytest.raises(um.BadInput, match=words):
        um.identify_response(model, pd.DataFrame(observed))


def test_an_answer_has_a_summary_and_gives_a_law_by_name(answer: um.Answer) -> None:
    assert answer.summary().splitlines()[-1] == f"Next: {next_step(answer.content)}."
    assert answer.law("coulomb_friction") is answer.law("Coulomb friction at joint") is answer.effects[0]
    with pytest.raises(
        um.BadInput, match=r"^law: the answer does not name 'backlash': it names coulomb_frict"
    ):
        answer.law("backlash")


def test_intervals_of_an_answer_have_any_level(answer: um.Answer) -> None:
    spread = {"curvature": 1.0, "experiments": 2.0, "count": 5, "bounds": [-3.0, None]}
    about = {"unit": "N m", "value": 0.0, "interval": [-3.0, 6.0], "determined": True, "at_bound": False}
    scattered = {**about, "values": {"run1": 1.0, "run2": 3.0, "run3": 2.0}}
    numbers = {"F_c": {**about, "spread": spread}, "gain": scattered, "c": about}
    fixed = {"b": {"known": 0.1, "identified": 0.1, "unit": "N m s/rad", "interval": [0.1, 0.1]}}
    effect = {**answer.content["effects"][0], "parameters": numbers}
    told = replace(answer, content={**answer.content, "effects": [effect], "parameters": fixed})
    usual, narrow = told.conf_int(), told.conf_int(alpha=0.5)
    assert usual.index.tolist() == ["b", "F_c", "gain", "c"] and usual.loc["F_c", "unit"] == "N m"
    # Student's t of four degrees of freedom: 2.776 and 0.741, cut at the lower bound
    assert usual.loc["F_c", ["low", "high"]].tolist() == pytest.approx([-3.0, 5.553], abs=1e-3)
    assert narrow.loc["F_c", ["low", "high"]].tolist() == pytest.approx([-1.481, 1.481], abs=1e-3)
    assert narrow.loc["gain", ["low", "high"]].tolist() == [1.5, 2.5]
    assert usual.loc["b", ["low", "high"]].tolist() == [0.1, 0.1]
    assert usual.loc["c", ["low", "high"]].isna().all()  # of an answer that does not say it
    for alpha in (0.0, 1.0, True, "95"):
        with pytest.raises(um.BadInput, match=r"^alpha: must be between 0 and 1, got "):
            told.conf_int(alpha)  # type: ignore[arg-type]


def test_an_answer_says_how_its_fit_ended(answer: um.Answer) -> None:
    assert answer.fit is None  # nothing was fitted for it
    fit = {"converged": False, "evaluations": 311}
    told = replace(answer, content={**answer.content, "fit": fit})
    assert told.fit == (False, 311, None)
    assert str(told.fit) == "the fit ended before it converged after 311 simulations"
    assert replace(told, content={**told.content, "fit": {**fit, "seconds": 2.5}}).fit == (False, 311, 2.5)


def test_a_family_that_is_left_out_is_one_of_the_library() -> None:
    with pytest.raises(um.BadInput, match=r"^without: there is no family 'hysterese'; did you mean"):
        um.diagnose(*um.example("pendulum"), without=["hysterese"])


def test_a_quiet_diagnosis_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with silence():
        say("compare laws")
    assert not capsys.readouterr().err
    say("compare laws")
    assert capsys.readouterr().err
