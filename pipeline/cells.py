"""Run a verb for many cells, side by side: python -m pipeline.cells <verb> key=value ... [+ <verb> ...]

A value `@<name>` stands for every entry of that list of params.yaml in turn, and `{<key>}` in another value
for the entry chosen. Each process loads its libraries once. Commands are independent of each other.

    python -m pipeline.cells evaluate model=@models fits=data/fits/{model} out=data/predictions/{model}
"""

import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import yaml

from pipeline.jobs import run_jobs
from unmodelled.base import workers

Words = list[str]


class Failed(Exception):
    """A command ended with an exit code, and has said why."""


def cells(arguments: Sequence[str], params: Mapping[str, Any]) -> dict[str, Words]:
    """Return the commands of all cells by their names, which are unique."""
    found: dict[str, Words] = {}
    for command in _commands(arguments):
        lists = {
            key: params[name]
            for key, name in re.findall(r"^([\w.]+)=@(\w+)$", "\n".join(command), re.MULTILINE)
        }
        for chosen in product(*lists.values()):
            entries = dict(zip(lists, map(str, chosen), strict=True))
            words = [_filled(word, entries) for word in command]
            out = next((word.removeprefix("out=") for word in words if word.startswith("out=")), "")
            name = "-".join(entries.values()) or "-".join(Path(out).parts[2:]) or out  # without data/<what>
            if name in found:
                raise ValueError(f"two cells are called {name!r}: give them different places for out")
            found[name] = words
    return found


def _commands(arguments: Sequence[str]) -> Iterator[Words]:
    command: Words = []
    for word in (*arguments, "+"):
        if word != "+":
            command.append(word)
        elif command:
            yield command
            command = []


def _filled(word: str, entries: Mapping[str, str]) -> str:
    key, _, value = word.partition("=")
    if value.startswith("@"):
        entry = entries[key]
        # a text that Hydra would take for something else
        return f"{key}='{entry}'" if entry in ("null", "true", "false") else f"{key}={entry}"
    return re.sub(r"\{([\w.]+)\}", lambda found: entries[found[1]], word)


def _run(stage: str, name: str, words: Words) -> None:
    from pipeline.__main__ import main

    if stage:  # what is noted of an execution bears the name of its cell
        os.environ["DVC_STAGE"] = f"{stage}@{name}"
    try:
        code = main(words)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    if code:
        raise Failed(code)


def run(arguments: Sequence[str]) -> int:
    """Run all cells of a command line."""
    params = yaml.safe_load(Path("params.yaml").read_text())
    found = cells(arguments, params)
    if not found:
        print(__doc__, file=sys.stderr)
        return 2
    stage = os.environ.get("DVC_STAGE", "")
    jobs = {name: partial(_run, stage, name, words) for name, words in found.items()}
    try:
        run_jobs(jobs, os.cpu_count() or 1, found[next(iter(found))][0])
    except Failed as failed:
        return int(failed.args[0])
    except BaseException:
        if not workers.interrupted.is_set():
            raise
        print(workers.INTERRUPTION, file=sys.stderr)
        return workers.exit_code()
    return 0


if __name__ == "__main__":
    workers.limit_threads()
    workers.heed_interruptions()
    workers.leave(run(sys.argv[1:]))
