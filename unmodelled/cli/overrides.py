"""Check keys and values of the command line against the configuration files."""

from __future__ import annotations

import argparse
import inspect
import math
import re
import shlex
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException, MissingConfigException
from hydra.utils import get_method
from omegaconf import DictConfig, OmegaConf

from unmodelled.base.errors import BadInput, Faults, closest, nearest
from unmodelled.base.ownership import check_name, path_arguments
from unmodelled.cli.program import Program

#: No count or seed is larger.
LARGEST = 2**32


#: What stands for a key that is null in its config file, by the annotation of the stage's argument.
INSTEAD = {
    **{"str": "", "Path": "", "int": -1, "float": -1.0, "list[str]": [""], "list[float]": [-1.0]},
    "Mapping[str, float]": dict[str, float](),
}


#: Keys that name what a verb reads, with what is said of one that is not there.
INPUTS = {
    "system": "no such file: check the path",
    "logs": "no such folder",
    "laws": "no such file: check the path",
}


#: Packages of the launchers of sweeps, by the first word of the launcher's name.
LAUNCHERS = {name: f"hydra-{name}-launcher" for name in ("joblib", "submitit", "ray", "rq")}


def checked_paths(config: DictConfig, program: Program) -> dict[str, Path]:
    """Check the keys of the stage that `config` names, and resolve it; those that are paths as such."""
    given = inspect.signature(get_method(config["_target_"])).parameters
    if unknown := sorted({str(key) for key in config} - {"_target_", *given}):
        raise BadInput(f"unknown key {unknown[0]!r}{closest(unknown[0], given)}")
    kinds = {name: str(p.annotation) for name, p in given.items()}
    missing = OmegaConf.missing_keys(config)
    missing |= {name for name, kind in kinds.items() if kind == "Path" and config.get(name) is None}
    missing |= {name for name, p in given.items() if p.default is p.empty and name not in config}
    if missing:
        names = sorted(missing, key=lambda name: [*given, name].index(name))
        verb = str(config["_target_"]).rpartition(".")[2]
        as_keys = " ".join(f"{name}=..." for name in names)
        raise BadInput(f"{', '.join(names)} must be given: {as_keys}{_all_keys(program, verb)}")
    OmegaConf.resolve(config)
    check_overrides(config, program, kinds)
    given_paths = [name for name in path_arguments(given) if config.get(name) is not None]
    return _paths(config, given_paths)


def _paths(config: DictConfig, names: Iterable[str]) -> dict[str, Path]:
    """The values of keys as paths."""
    for name in names:
        if OmegaConf.is_config(config[name]):
            raise _wrong(name, "the path of a file or folder", config[name])
    found = {name: Path(str(config[name])) for name in names}
    for name, path in found.items():
        check_name(name, path)
    return found


def check_given(config: DictConfig, program: Program) -> None:
    """Refuse missing keys and inputs before the libraries of the verb are loaded, which takes seconds."""
    verb = str(config["_target_"]).rpartition(".")[2]
    if verb not in program.verbs or {str(key) for key in config} - program.keys(verb):
        return  # an unknown key is the first thing to say
    required = program.required_keys(verb)
    missing = [name for name in required if name in OmegaConf.missing_keys(config)]
    if missing:
        as_keys = " ".join(f"{name}=..." for name in missing)
        raise BadInput(f"{', '.join(missing)} must be given: {as_keys}{_all_keys(program, verb)}")
    paths = _paths(config, [name for name in (*INPUTS, "out") if config.get(name) is not None])
    given = {name: path for name, path in paths.items() if name in INPUTS}
    for name, path in given.items():
        around = [path, *path.parents]
        if not path.exists() and not any(each.is_file() for each in around):  # else an address in a file
            raise BadInput(f"{path}: {INPUTS[name]}")


def check_words(program: Program, verb: str, words: Sequence[str]) -> None:
    """Refuse words of a command line that are neither key=value nor an option."""
    said = StringIO()
    try:
        with redirect_stderr(said):
            parsed, options = _options().parse_known_args(list(words))
    except SystemExit:
        raise BadInput(said.getvalue().strip().splitlines()[-1].partition("error: ")[2]) from None
    faults = Faults()
    for option in options:
        plain = option.lstrip("-")
        meant = f"; did you mean {plain!r}?" if "=" in plain else ""
        faults.add(f"unknown option {option!r}{meant}")
    for word in parsed.overrides:
        with faults.collected():
            _check_word(program, verb, word)
    faults.check()


def _options() -> argparse.ArgumentParser:
    """The options of Hydra that a verb takes, by the page of its documentation on command line flags."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("overrides", nargs="*")
    parser.add_argument("-m", "--multirun", action="store_true")
    parser.add_argument("--resolve", action="store_true")
    parser.add_argument("--cfg", "-c", choices=("job", "hydra", "all"))
    parser.add_argument("-p", "--package")
    parser.add_argument("-cd", "--config-dir")
    return parser


def _check_word(program: Program, verb: str, word: str) -> None:
    name, equals, value = word.partition("=")
    if not name.partition("@")[0].strip("+~/ ") or not (equals or word.startswith("~")):
        raise BadInput(f"{word!r} is not key=value{_all_keys(program, verb)}")
    try:
        OverridesParser.create().parse_override(word)
    except (HydraException, ValueError):
        raise BadInput(f"{word!r} cannot be read; as a text write {quoted(name, value)}") from None


def quoted(name: str, text: str) -> str:
    """Return a word of a command line that gives a key any text: in quotes for Hydra, and for the shell."""
    escaped = text.replace("\\", "\\\\").replace("'", "\\'")
    word = f"{name}='{escaped}'"
    return shlex.quote(word) if set('"$`\\!') & set(word) else f'"{word}"'


def _all_keys(program: Program, verb: str) -> str:
    """Return the end of an error message, which leads to the keys of a verb."""
    return f" (all keys: {program.name} help {verb})"


def explained(error: Exception, program: Program, verb: str, words: Sequence[str]) -> str:
    """Return on one line what is wrong with a command line that Hydra refuses."""
    text = " ".join(str(error).split())
    if isinstance(error, MissingConfigException) and error.options and error.missing_cfg_file:
        group, _, choice = error.missing_cfg_file.rpartition("/")
        near = nearest(choice, error.options)
        meant = f"; did you mean {near!r}?" if near else "."
        package = LAUNCHERS.get(choice.partition("_")[0], "") if group == "hydra/launcher" else ""
        meant += f" Its package is missing: pip install {package}." if package else ""
        return f"{group}={choice}: there is no such choice{meant} Choices: {', '.join(error.options)}"
    if found := re.match(
        r"(?:Could not (?:override|delete from config\.) '|Error merging override ~)([^'=]+)", text
    ):
        keys = _keys(program, verb, [word for word in words if program.is_choice(word)])
        if found[1] in keys:
            named = "|".join(program.choices(verb).get(found[1], ["..."]))
            return f"{found[1]}: can be neither removed nor changed so: give {found[1]}={named}"
        return f"unknown key {found[1]!r} of {verb}{_either(found[1], keys)}"
    if found := re.match(r"Ambiguous value for argument '([^=]+)=(.*?)' 1\. ", text):
        place = f"{found[1]}: commas separate the runs of a sweep (-m)"
        return f"{place}; as a text write {quoted(found[1], found[2])}"
    cause = error.__cause__ or error.__context__
    if (found := re.match(r"Error merging override (.*)", text)) and cause is not None:
        return f"{found[1]}: {str(cause).splitlines()[0]}: check the key and its value"
    return text.partition(" See https://hydra.cc")[0]


def _either(name: str, known: Collection[str]) -> str:
    """Return the suggestion of `closest` for dotted names, whose last part may be right elsewhere."""
    last = name.rpartition(".")[2]
    near = nearest(last, {key.rpartition(".")[2] for key in known})
    same = [key for key in known if key.rpartition(".")[2] == near]
    if same:
        return f"; did you mean {(nearest(name, same) or same[0])!r}?"
    place = name.rpartition(".")[0]
    beside = [key for key in known if key.rpartition(".")[0] == place]
    added = f"; what its config file leaves at the default is given as +{name}=..." if place else ""
    among = beside or [key for key in known if "." not in key]
    return f", must be one of {', '.join(among)}{added}"


def _keys(program: Program, verb: str, choices: list[str]) -> list[str]:
    """Dotted names of all keys of a verb after some choices of config files."""
    try:
        config = program.compose(verb, choices)
    except HydraException:  # one of them is the word at fault, or several of a sweep
        config = program.compose(verb)
    return list(_dotted(OmegaConf.to_container(config), ""))


def _dotted(node: Any, place: str) -> Iterator[str]:
    for name, inner in node.items() if isinstance(node, dict) else ():
        if not str(name).endswith("_"):  # _target_ and the like
            dotted = f"{place}.{name}" if place else str(name)
            yield dotted
            yield from _dotted(inner, dotted)


def check_overrides(config: DictConfig, program: Program, kinds: Mapping[str, str]) -> None:
    """Refuse what `check_kinds` refuses of the configuration of the job that Hydra runs."""
    job = HydraConfig.get()
    choices = [change for change in job.overrides.task if program.is_choice(change)]
    if len(choices) == len(job.overrides.task):
        return
    before = program.compose(str(job.job.config_name), choices)
    given, written = (_plain(c) for c in (config, before))
    for name, kind in ((name, kind.removesuffix(" | None")) for name, kind in kinds.items()):
        if "|" in kind:
            given.pop(name, None)
        elif written.get(name) is None and given.get(name) is not None:
            written[name] = INSTEAD.get(kind)
    check_kinds(given, written)


def _plain(config: DictConfig) -> dict[str, Any]:
    found = OmegaConf.to_container(config, resolve=True)
    assert isinstance(found, dict)
    return {str(name): value for name, value in found.items()}


def check_kinds(given: Mapping[str, Any], written: Mapping[str, Any], place: str = "") -> None:
    """Refuse a value of another kind than the config files write in its place.

    A number stays a number, and not negative if it was not; a whole number stays one, and positive if it was;
    a list stays a list of such things. Where null is written anything may stand.
    """
    for name in written.keys() & given.keys():
        _check(given[name], written[name], f"{place}.{name}" if place else name)


def _check(given: Any, written: Any, place: str) -> None:
    if given == written and type(given) is type(written):
        return
    match written:
        case None | "???":
            return
        case dict():
            if not isinstance(given, dict):
                raise _wrong(place, "a mapping", given)
            check_kinds(given, written, place)
        case list():
            if not isinstance(given, list):
                raise _wrong(place, "a list, [...]", given)
            if not given and _numbers(written):
                raise BadInput(f"{place}: must not be empty")
            for k, item in enumerate(given):
                _check(item, _like(written, k), f"{place}[{k}]")
        case bool():
            if not isinstance(given, bool):
                raise _wrong(place, "true or false", given)
        case int() | float():
            _check_number(given, written, place)
        case str():
            if not isinstance(given, str | int | float) or isinstance(given, bool):
                raise _wrong(place, "a text", given)


def _numbers(values: list[Any]) -> bool:
    return bool(values) and all(isinstance(value, int | float) for value in values)


def _like(written: list[Any], k: int) -> Any:
    """Return the written value that an item of a list is compared with; of numbers the least strict."""
    if _numbers(written):
        return min(written) if all(isinstance(value, int) for value in written) else float(min(written))
    return written[min(k, len(written) - 1)] if written else None


def _check_number(given: Any, written: int | float, place: str) -> None:
    whole = isinstance(written, int)
    kind = "a whole number" if whole else "a number"
    if isinstance(given, bool) or not isinstance(given, int if whole else int | float):
        raise _wrong(place, kind, given)
    if not math.isfinite(given) or abs(given) > (LARGEST if whole else 1e300):
        raise _wrong(place, f"{kind}, finite and not that large", given)
    least = 1 if whole and written >= 1 else 0
    if written >= 0 and given < least:
        raise _wrong(place, f"{kind} from {least} up", given)


def _wrong(place: str, kind: str, given: Any) -> BadInput:
    return BadInput(f"{place}: must be {kind}, got {str(given)[:60]!r}")
