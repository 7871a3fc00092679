"""Give stages of the graph other values of keys: the mapping `keys` of params.yaml, for `dvc exp run -S`.

    keys:
      tune: {seed: 3}                # seed=3 for every stage of this verb
      model: {f_h1: {fit: {batch: 100}}}    # model.fit.batch=100 for every stage with model=f_h1

params.yaml has only plain values. DVC would write a changed configuration file with all its interpolations
resolved (a network of 0 steps), and refuses one with `???` or `${hydra:...}`, which every verb has.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from unmodelled.base.errors import Faults, closest
from unmodelled.cli.program import Program

FILE = Path("params.yaml")


def read_keys() -> dict[str, Any]:
    """Return the keys of params.yaml in the working directory, nothing where there is no such file."""
    params = yaml.safe_load(FILE.read_text()) if FILE.exists() else {}
    found: dict[str, Any] = params.get("keys") or {}
    return found


def check_keys(keys: Mapping[str, Any], program: Program) -> None:
    """Refuse names of `keys` that are no verb and no choice of a verb's keys, and places of results."""
    groups = program.groups()
    chosen = {group: groups[group] for verb in program.verbs for group in program.choices(verb)}
    faults = Faults()
    for name, values in keys.items():
        where = f"{FILE}: keys.{name}"
        if not isinstance(values, Mapping):
            faults.add(f"{where}: must be a mapping of keys and values, got {values!r}")
        elif name in chosen:
            for choice in values.keys() - chosen[name].keys():
                faults.add(f"{where}.{choice}: no such file in conf/{name}{closest(choice, chosen[name])}")
        elif name not in program.verbs:
            faults.add(f"{where}: no verb and no group{closest(name, {*chosen, *program.verbs})}")
        elif "out" in values:
            faults.add(f"{where}.out: dvc.yaml says where results of a stage are")
    faults.check()


def added_words(keys: Mapping[str, Any], words: Sequence[str], program: Program) -> list[str]:
    """Return the words that `keys` add to a command, which is a verb and its own words."""
    verb, *given = words
    if not keys or verb not in program.verbs:
        return []
    defaults = (yaml.safe_load(program.config(verb).read_text()) or {}).get("defaults", [])
    chosen = {group: name for entry in defaults if isinstance(entry, dict) for group, name in entry.items()}
    chosen |= dict(word.split("=", 1) for word in given if "=" in word and program.is_choice(word))
    own = {group: keys.get(group, {}).get(str(name).strip("'"), {}) for group, name in chosen.items()}
    return [*_words(own), *_words(keys.get(verb, {}))]


def _words(values: Mapping[str, Any], before: str = "") -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _words(value, f"{before}{key}.")
        elif isinstance(value, str):
            escaped = value.replace("\\", "\\\\").replace("'", "\\'")
            yield f"{before}{key}='{escaped}'"
        else:
            yield f"{before}{key}={json.dumps(value)}"
