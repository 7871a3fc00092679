"""Write the page on the configuration files that keys choose."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from docs.reference.docstrings import of
from docs.reference.markdown import code, comment, table, value
from pipeline.__main__ import PROGRAM

#: Group -> description.
GROUPS = {
    "model": "The model to fit, and how to fit it. For any system: `hybrid`, and "
    "`physics training@model=multi_step`. For the slider-crank only, because they name its parameters or "
    "inputs: the other `hybrid_*`, `nnap*` and `black_box`. For the drivetrain of the cam-follower: `f_bb`, "
    "`f_h1`, `f_h2`, `lls`, `motor`, `best`, `narx`, `rnn`, `gp`. For the jumps of the cam-follower: all "
    "others.",
    "training": "Settings that several models share. `training@model=shooting` chooses another file, "
    "`model.windows.epochs=50` changes one key.",
    "detachment": "Members of models of the follower's jumps: a model without the runs that it is fitted to.",
    "split": "Which experiments are for training, and which are for testing.",
    "profile": "How long trainings and studies run.",
    "budget": "Keys of a profile that both programs have: the duration of trainings of any system.",
    "source": "Where logs come from.",
    "uncertainty": "Families of distributions, and how they are propagated and identified.",
    "mechanism": "Constants of a mechanism that is written in Python.",
}
HYDRA = {"_target_", "_partial_", "_convert_", "defaults"}


def page() -> str:
    """Return one section per group of configuration files."""
    index = "\n".join(f"- [{group}](#{group})" for group in GROUPS)
    head = (
        "# Configs\n\nA key such as `model=hybrid` chooses the configuration file "
        "`unmodelled/conf/model/hybrid.yaml`. `model.windows.horizon=30` changes one of its keys. "
        "For launchers and sweepers, see [sweeps](../sweeps/README.md).\n\n"
    )
    return "\n".join([head + index + "\n", *(_section(group, text) for group, text in GROUPS.items())])


def _section(group: str, text: str) -> str:
    files = list(PROGRAM.groups()[group].values())
    rows = [_row(path) for path in files]
    used: dict[str, set[str]] = {}
    for path in files:
        for target, keys in _targets(_content(path)):
            used.setdefault(target, set()).update(keys)
    parts = [f"## {group}\n", f"{text}\n", table(("choice", "description", "includes", "own keys"), rows)]
    meanings = [_meaning(target, keys) for target, keys in used.items()]
    if any(meanings):
        parts += [f"### Keys of {group}\n", *filter(None, meanings)]
    return "\n".join(parts)


def _row(path: Path) -> tuple[str, str, str, str]:
    content = _content(path)
    base = [entry for d in content.get("defaults", []) if d != "_self_" for entry in _bases(d)]
    keys = [f"{code(f'{name}: {value(v)}')}" for name, v in _flat(content)]
    return code(path.stem), _about(path, content), ", ".join(map(code, base)), ", ".join(keys)


def _content(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(path.read_text())
    return content


def _bases(entry: str | dict[str, str]) -> Iterator[str]:
    """Return the names of the files that an entry of a defaults list includes."""
    if isinstance(entry, str):
        yield entry.partition("@")[0]
    else:
        for group, name in entry.items():
            yield f"{group.strip('/').partition('@')[0]}/{name}"


def _about(path: Path, content: dict[str, Any]) -> str:
    """Return the comment at the top of the file, or else the docstring of the most specific target in it."""
    inner = content.get("dynamics") or content.get("folds") or content
    return comment(path) or of(inner["_target_"]).first


def _targets(content: Any) -> Iterator[tuple[str, set[str]]]:
    """Return every target in a file, with the keys beside it."""
    if isinstance(content, dict):
        if "_target_" in content:
            yield content["_target_"], set(content)
        for inner in content.values():
            yield from _targets(inner)


def _flat(content: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Return all keys as written on the command line; the value of a key with a target is the target."""
    for name, inner in content.items():
        if name in HYDRA:
            continue
        if isinstance(inner, dict):
            if "_target_" in inner:
                yield f"{before}{name}", inner["_target_"].rpartition(".")[2]
            yield from _flat(inner, f"{before}{name}.")
        else:
            yield f"{before}{name}", inner


def _meaning(target: str, keys: set[str]) -> str:
    """Return the meanings of the keys of `target` that a file sets."""
    found = of(target)
    lines = [f"- {code(name)}: {text}" for name, text in found.meanings().items() if name in keys]
    name = ".".join(target.split(".")[-2:])
    return "\n".join([f"**{name}**: {found.first}\n", *lines]) + "\n" if lines else ""
