"""The benchmark Withheld and strangers: answers, names, archives that are odd, damaged or harmful."""

import json
import os
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.withheld import row as withheld
from benchmarks.withheld import score as scored
from benchmarks.withheld.case import Case
from benchmarks.withheld.entrant import Entrant
from benchmarks.withheld.measured import real
from benchmarks.withheld.table import main as write_tables
from benchmarks.withheld.table import read_rows
from tests.edits import edits
from tests.test_withheld_bench import case, given, rates_of
from unmodelled.base.errors import BadInput


def test_names_of_an_answer_are_neither_code_nor_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither in the terminal nor in the Markdown nor in the page, be it of an answer or of a case."""
    name = '"><script>alert(1)'
    given([case(tmp_path, name, "single", "viscous_friction")], monkeypatch)
    evil = "\x1b]0;pwn\x07<img src=x onerror=alert(1)>[a](javascript:alert(1))"
    script = 'import json, pathlib, sys\nwords = dict(w.split("=", 1) for w in sys.argv if "=" in w)\n'
    script += f"effect = {{'family': {evil!r}, 'port': 'joint'}}\nout = pathlib.Path(words['out'])\n"
    script += "said = {'verdict': 'effect', 'confidence': 1, 'effects': [effect]}\nout.mkdir()\n"
    script += "(out / 'answer.json').write_text(json.dumps(said))\n(out / 'more').symlink_to('..')\n"
    failing = f"import sys\nsys.stdout.buffer.write(b'\\xff')\nsys.exit({evil!r})\n"
    for who, text in (("named", script), ("failed", failing)):
        (tmp_path / f"{who}.py").write_text(text)
        withheld.answer("", 0, Entrant.of(f"{who}:{tmp_path / who}.py"), tmp_path)
    write_tables(["named", "failed", f"out={tmp_path}"])
    told, page = capsys.readouterr().out, (tmp_path / "index.html").read_text()
    assert "\x1b" not in told + page and "<img" not in told + page and "[a]" not in told
    assert "&lt;img" in told and "<script" not in page and "default-src &#39;none&#39;" in page
    assert "cases/%22%3E%3Cscript%3Ealert%281%29" in page
    assert read_rows(tmp_path / "rows" / "failed")[name]["error"].endswith("(javascript:alert(1))")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not a JSON file"),
        ("[" * 50_000 + "]" * 50_000, "nested too deeply"),
        (f'{{"verdict": "no_gap", "confidence": {"1" * 400}}}', "not a finite number"),
        ('{"verdict": "no_gap", "confidence": NaN}', "NaN is not a finite number"),
        ('{"verdict": "effect"}', "confidence is missing"),
        ('{"verdict": "yes", "confidence": 0.5}', "verdict: must be one of"),
        ('{"verdict": "effect", "confidence": 0.5, "effects": [{"family": "drag"}]}', "port is missing"),
        ('{"verdict": "no_gap", "confidence": 50}', "confidence: 50 is greater than the maximum of 1"),
    ],
)
def test_a_bad_answer_is_one_line(tmp_path: Path, text: str, said: str) -> None:
    (path := tmp_path / "answer.json").write_text(text)
    with pytest.raises(BadInput, match=said) as fault:
        scored.read_answer(path)
    assert str(fault.value).startswith(f"{path}: ") and "\n" not in str(fault.value)


def test_an_edited_answer_is_scored_or_refused_in_one_line(tmp_path: Path) -> None:
    planted = {"family": "coulomb_friction", "channel": "rail", "alike": [], "parameters": {"force": 2.0}}
    tolerated = [{"family": "sensor_delay", "channel": "sensor:x"}]
    truth = {"verdict": "effect", "effects": [planted], "tolerated": tolerated, "acts_at": {"b": ["rail"]}}
    other = {"family": "drag", "port": "b", "parameter": "b", "factor": "oil", "level": "old"}
    effect = {"family": "coulomb_friction", "port": "rail", "indistinguishable": [other]}
    named = {
        **{"verdict": "effect", "confidence": 0.5, "model": "model.yaml", "logs": [{"channel": "x"}]},
        "effects": [{**effect, "number": {"value": 2.0, "interval": [1.5, 2.5]}}],
    }
    shares = [{"port": "rail", "share": 0.9}, {"port": "b", "share": 0.1}]
    unknown = {"verdict": "unknown", "confidence": 0.5, "where": {"channels": shares}}
    path, scores, refused = tmp_path / "answer.json", 0, 0
    for edited in (edited for content in (named, unknown) for edited in edits(content)):
        path.write_text(json.dumps(edited))
        try:
            found = scored.score(truth, scored.read_answer(path))
        except BadInput as fault:
            assert str(fault).isprintable() and str(fault).startswith(f"{path}: ")
            refused += 1
        else:
            text = "".join(map("".join, scored.summary([found])))
            assert (text + found["said"]).isprintable()
            scores += 1
    assert scores > 40 and refused > 150


def test_three_alternatives_count_and_an_interval_has_a_width() -> None:
    """Whoever lists every law, or every number, has said nothing."""
    planted = {"family": "backlash", "channel": "rail", "alike": [], "material": True}
    truth = {"verdict": "effect", "effects": [planted]}
    others = [{"family": f"law_{k}", "port": "rail"} for k in range(20)]
    for place, right in ((0, True), (2, True), (3, False), (20, False)):
        listed = [*others[:place], {"family": "backlash", "port": "rail"}, *others[place:]]
        effect = {"family": "drag", "port": "rail", "indistinguishable": listed}
        said = {"verdict": "effect", "confidence": 1.0, "effects": [effect], "logs": []}
        found = scored.score(truth, said)
        assert found["right"] is found["in_set"] is right and found["material_named"] == right
    chain = {"family": "sensor_delay", "channel": "sensor:x"}
    nothing = {"verdict": "no_gap", "effects": [], "tolerated": [chain]}
    said["effects"][0]["indistinguishable"] = [*others, {"family": "sensor_delay", "port": "sensor:x"}]
    assert not scored.score(nothing, said)["right"]

    planted |= {"family": "constant_load", "parameters": {"load": -2.0}}
    rows = []
    for interval in ([-2.2, -1.8], [-3.0, -1.0], [-1e99, 1e99]):
        named = {"family": "constant_load", "port": "rail", "indistinguishable": []}
        said["effects"] = [{**named, "number": {"interval": interval}}]
        rows.append(scored.score(truth, said))
    assert [row["width"] for row in rows] == [[pytest.approx(0.1)], [0.5], [pytest.approx(5e98)]]
    rates = dict(scored.summary(rows))
    assert rates["number in its interval"].startswith("3 of 3")
    assert rates["half width of these intervals"] == "50 % of the number in the median"
    assert rates["intervals wider than ± 100 %"].startswith("1 of 3")


def test_an_odd_answer_does_not_end_the_scoring(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    odd: dict[str, Callable[[Path], object]] = {
        "folder": Path.mkdir,
        "pipe": os.mkfifo,
        "device": lambda path: path.symlink_to("/dev/zero"),
        "text": lambda path: path.write_text('{"verdict": "effect", "confidence": 0.5, "effects": [1]}'),
        "large": lambda path: path.write_text('{"verdict": "unknown"}' + " " * 5_000_000),
        "absent": lambda path: None,
        "whole": lambda path: path.write_text('{"verdict": "no_gap", "confidence": 0.5}'),
    }
    (tmp_path / "answers").mkdir()
    for name, put in odd.items():
        case(tmp_path, name, "null", None)
        put(tmp_path / "answers" / f"{name}.json")
    scored.main([f"truth={tmp_path}/truth", f"answers={tmp_path}/answers"])
    told = capsys.readouterr()
    rates = rates_of(told.out)
    assert rates["right"].startswith("1 of 7") and rates["without an answer"].startswith("6 of 7")
    lines = sorted(told.err.splitlines())
    assert len(lines) == 6 and all(
        line.startswith(f"without an answer: {tmp_path}/answers/") for line in lines
    )
    assert any("text.json: effects[0]: must be an object, got 1" in line for line in lines)
    assert any("has 5 MB" in line for line in lines) and any("a named pipe" in line for line in lines)


def zipped(path: Path, **members: bytes) -> Path:
    """An archive with a system file, whatever its name, and further members; `__` is a slash."""
    path.parent.mkdir(exist_ok=True)
    every = {"known.md": b"## Right answers\n- `swing` dry friction\n", "swing.yaml": b"schema: system/1\n"}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in {**every, "logs__a.csv": b"t\n", **members}.items():
            archive.writestr(f"{path.stem}/{name.replace('__', '/')}", content)
    return path


def brought(archives: Path, cases: Path) -> list[Case]:
    """The cases that archives bring themselves, without published data that the environment names."""
    return [found for found in real(archives, cases) if found.kind == "archive"]


def test_an_archive_brings_its_system_files_and_logs_alone(tmp_path: Path) -> None:
    """A name that is a pattern of exponential time, and a member that wants to lie outside."""
    stem = "(a+)+" + "a" * 30
    path = zipped(tmp_path / "given" / f"{stem}.zip", **{"..__..__evil": b"x"})
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("/tmp/evil", b"x")
        link = zipfile.ZipInfo(f"{stem}/logs/link")
        link.external_attr = 0o120777 << 16
        archive.writestr(link, "/etc/passwd")
    (found,) = brought(path.parent, tmp_path / "cases")
    found.make()
    assert (found.name, found.truth) == (f"{stem}_swing", "`swing` dry friction")
    made = {
        p.relative_to(tmp_path / "cases").as_posix(): p for p in tmp_path.rglob("cases/**/*") if p.is_file()
    }
    own = f"archives/{stem}"
    assert {*made} == {f"{own}/known.md", f"{own}/swing.yaml", f"{own}/logs/a.csv", f"{own}/logs/link"}
    assert made[f"{own}/logs/link"].read_bytes() == b"/etc/passwd" and not any(
        p.is_symlink() for p in made.values()
    )
    assert found.system in made.values() and found.logs.is_dir()


@pytest.mark.parametrize(
    ("members", "said"),
    [
        ({"logs__b.csv": b"0" * 201_000_000}, "has 4 files of 201 MB, at most 200 MB are unpacked"),
        ({f"logs__{k}": b"" for k in range(10_001)}, "has 10004 files, at most 10000"),
        ({f"x{k}.yaml": b"" for k in range(10_001)}, "has 10004 files, at most 10000"),
        ({"logs__a.csv__below": b"x"}, "cannot be unpacked"),
        ({f"logs__{'x' * 300}": b"x"}, "cannot be unpacked: File name too long"),
    ],
    ids=["size", "files", "systems", "below a file", "long name"],
)
def test_an_archive_is_unpacked_within_limits(members: dict[str, bytes], said: str, tmp_path: Path) -> None:
    zipped(tmp_path / "given" / "swing.zip", **members)
    with pytest.raises(BadInput, match=said):
        brought(tmp_path / "given", tmp_path / "cases")[0].make()
    assert not any(p.is_file() for p in tmp_path.rglob("cases/**/*"))


@pytest.mark.parametrize("name", ["..zip", "...zip"])
def test_an_archive_has_a_name_for_its_folder(name: str, tmp_path: Path) -> None:
    zipped(tmp_path / "given" / name)
    with pytest.raises(BadInput, match=r"zip: must have a name"):
        brought(tmp_path / "given", tmp_path / "cases")


def test_a_member_that_is_larger_than_its_archive_says_is_not_unpacked(tmp_path: Path) -> None:
    """What was declared is all that is unpacked, of whatever a few bytes become."""
    path = zipped(tmp_path / "given" / "swing.zip", **{"logs__b.csv": b"0" * 300_000_000})
    content = bytearray(path.read_bytes())
    at = content.rfind(b"PK\x01\x02") + 24  # of the last entry of the directory: its size
    content[at : at + 4] = (100).to_bytes(4, "little")
    path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(BadInput, match=r"swing/logs/b\.csv: cannot be read \(Bad CRC-32"):
        brought(tmp_path / "given", tmp_path / "cases")[0].make()
    assert tracemalloc.get_traced_memory()[1] < 10e6
    tracemalloc.stop()


def test_what_is_known_of_an_archive_fits_into_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("unmodelled.base.limits._allowed", lambda left: 5e7)
    zipped(tmp_path / "given" / "swing.zip", **{"known.md": b" " * 5_000_000})
    with pytest.raises(BadInput, match=r"swing/known\.md: is too large"):
        list(real(tmp_path / "given", tmp_path / "cases"))
