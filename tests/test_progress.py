"""Progress: bars on a terminal, plain lines elsewhere, nothing or more on request."""

import io
import sys
from pathlib import Path

import pytest

from tests.commands import exit_code
from unmodelled.base import progress
from unmodelled.base.progress import Counter, say, track


class Clock:
    """Time that passes only when told."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    monkeypatch.delenv("EXP_PROGRESS", raising=False)
    found = Clock()
    monkeypatch.setattr(progress, "time", found)
    return found


def work(clock: Clock, seconds: float, items: int = 10) -> None:
    for _ in track(range(items), items, "training"):
        clock.now += seconds / items


def test_short_work_says_nothing(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    work(clock, 4.0)
    assert capsys.readouterr().err == ""


def test_plain_lines_come_after_five_seconds_and_now_and_then(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    work(clock, 1000.0, items=1000)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "training: 5/1000, 16 min 35 s left"
    assert lines[1] == "training: 20/1000, 16 min 20 s left"
    assert len(lines) == 67 and lines[-1] == "training: 995/1000, 5 s left"


def test_quiet_and_verbose(
    clock: Clock, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("EXP_PROGRESS", "quiet")
    work(clock, 1000.0)
    say("fitting")
    assert capsys.readouterr().err == ""
    monkeypatch.setenv("EXP_PROGRESS", "verbose")
    work(clock, 10.0)
    say("fitting")
    lines = capsys.readouterr().err.splitlines()
    assert lines[::9] == ["training: 1/10, 9 s left", "training: 10/10, 0 s left"]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_bars_on_a_terminal_one_within_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("EXP_PROGRESS", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setattr(progress, "SOON", 0.0)
    with Counter(4, "outer") as outer:
        outer.update(1)
        for _ in track(range(3), 3, "inner"):
            say("in between")
        outer.update(2)
    assert progress._Bars.shown is None
    text = shown.getvalue()
    assert all(word in text for word in ("outer", "inner", "in between ...", "1/4", "left"))


def test_a_bar_is_taken_away_when_work_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("EXP_PROGRESS", raising=False)
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(progress, "SOON", 0.0)
    with pytest.raises(ValueError), Counter(2, "work") as counter:
        counter.update(1)
        assert progress._Bars.shown is not None
        raise ValueError
    assert progress._Bars.shown is None


def test_flags_of_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def run(*flags: str) -> str:
        monkeypatch.delenv(progress.VARIABLE, raising=False)
        words = ["acquire", "source=pendulum", "source.runs=1", f"out={tmp_path}/logs", *flags]
        code, said = exit_code(*words), capsys.readouterr().err
        assert code == 0, said
        return said

    assert run("-q") == ""
    (line,) = run().splitlines()
    assert line.startswith(f"wrote {tmp_path}/logs: experiments.csv, provenance.json, run1.csv; read ")
    said = run("--verbose")
    assert "seed: 0" in said and "done in " in said.splitlines()[-1]
