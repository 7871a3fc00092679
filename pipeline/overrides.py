"""What the command line gives must be of the kind that the config file has."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.utils import get_method
from omegaconf import DictConfig, OmegaConf

from pipeline.errors import BadInput
from pipeline.files import check_name, check_writable

#: No count or seed is larger.
LARGEST = 2**32


#: What stands for a key that is null in its config file, by the annotation of the stage's argument.
INSTEAD = {"str": "", "Path": "", "int": -1, "float": -1.0, "list[str]": [""], "list[float]": [-1.0]}


def checked_paths(config: DictConfig, conf: Path) -> dict[str, Path]:
    """Check the keys of the stage that `config` names, and resolve it; those that are paths as such.

    Args:
        config: of the job that Hydra runs. conf: folder of the config files.

    Raises:
        BadInput: one line that names the key.
    """
    if missing := sorted(OmegaConf.missing_keys(config)):
        raise BadInput(f"{missing[0]} must be given: {missing[0]}=...")
    given = inspect.signature(get_method(config["_target_"])).parameters
    if unknown := sorted({str(key) for key in config} - {"_target_", *given}):
        raise BadInput(f"unknown key {unknown[0]!r}, must be one of {', '.join(given)}")
    kinds = {name: str(p.annotation) for name, p in given.items()}
    for name, kind in kinds.items():
        if kind == "Path" and config.get(name) is None:
            raise BadInput(f"{name} must be given: {name}=...")
    OmegaConf.resolve(config)
    check_overrides(config, conf, kinds)
    paths = {name for name, kind in kinds.items() if kind.split(" | ")[0] == "Path"}
    found = {name: Path(str(config[name])) for name in paths if config.get(name) is not None}
    for name, path in found.items():
        check_name(name, path)
    if "out" in found:
        check_writable(found["out"])
    return found


def check_overrides(config: DictConfig, conf: Path, kinds: Mapping[str, str]) -> None:
    """Refuse what `check_kinds` refuses of the configuration of the job that Hydra runs.

    Args:
        config: resolved. conf: folder of the config files.
        kinds: annotations of the stage's arguments; those that take several kinds are not looked at.

    Raises:
        BadInput: one line that names the key.
    """
    job = HydraConfig.get()
    choices = [change for change in job.overrides.task if (conf / change.split("=")[0]).is_dir()]
    if len(choices) == len(job.overrides.task):
        return
    running = GlobalHydra.instance().is_initialized()  # not in a worker of a sweep
    with nullcontext() if running else initialize_config_dir(str(conf.resolve()), version_base="1.3"):
        before = compose(str(job.job.config_name), choices)
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

    Args:
        given: the configuration after changes, as plain Python. written: the same before them.
        place: dotted name of both.

    Raises:
        BadInput: one line that names the key.
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
    """What an item of a list must be like; of numbers the least strict, whatever their order."""
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
