"""Ownership of result folders: a verb replaces only a folder that it made itself."""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from unmodelled.base.errors import BadInput
from unmodelled.base.markers import MARKER, RECORD, files_in, is_on_its_way, marker_text, stamp

P = ParamSpec("P")
R = TypeVar("R")

#: Arguments of verbs that name what is written; all other paths are inputs.
OUTPUTS = ("out", "reports")


class Out(Enum):
    """Kind of output that the argument `out` of a verb names."""

    FOLDER = "a folder of the verb's own"
    FILE = "a file"
    SHARED = "a folder in which some files and folders are the verb's own"


@dataclass(frozen=True)
class OutputPlace:
    """Output of a verb and the inputs that may contain it."""

    out: Out = Out.FOLDER
    #: input arguments (folders searched for results of many verbs) that `out` may lie inside
    inside: frozenset[str] = frozenset()
    #: input arguments (folders of a user's files) into which `out` may be written
    beside: frozenset[str] = frozenset()


@dataclass(frozen=True)
class _Running:
    """Verb at work: its name, its own folder if it has one, and its input paths by argument name."""

    verb: str = "a Python program"
    place: OutputPlace = OutputPlace()
    own: Path | None = None
    inputs: Mapping[str, Path] = field(default_factory=dict)


_NONE = _Running()
_RUNNING = ContextVar("_RUNNING", default=_NONE)


def verb(
    out: Out = Out.FOLDER, inside: Collection[str] = (), beside: Collection[str] = ()
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Make a function a verb: an `out` that would overwrite foreign files is refused first."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature, place = inspect.signature(function), OutputPlace(out, frozenset(inside), frozenset(beside))
        paths = path_arguments(signature.parameters)

        @functools.wraps(function)
        def run(*args: P.args, **kwargs: P.kwargs) -> R:
            given = signature.bind(*args, **kwargs).arguments
            found = {name: Path(given[name]) for name in paths if given.get(name) is not None}
            inputs = {name: path for name, path in found.items() if name not in OUTPUTS} | _carried(given)
            own = found["out"].absolute() if "out" in found and place.out is Out.FOLDER else None
            token = _RUNNING.set(_Running(function.__name__, place, own, inputs))
            try:
                if "out" in found:
                    _check_out(found["out"], place.out)
                _check_kinds(function, given)
                return function(*args, **kwargs)
            finally:
                _RUNNING.reset(token)

        run.__dict__["place"] = place
        return run

    return decorate


def _check_kinds(function: Callable[..., Any], given: Mapping[str, Any]) -> None:
    """Refuse an argument that a configuration of another kind made, such as a model of another machine."""
    for name, value in given.items():
        kind = function.__globals__.get(str(function.__annotations__.get(name)))
        if isinstance(kind, type) and is_dataclass(kind) and not isinstance(value, kind | None):
            raise BadInput(
                f"{name}: {function.__name__} needs a {kind.__name__}, got a {type(value).__name__}: choose "
                f"another {name}=..., `help {function.__name__}` names the default"
            )


def _carried(given: Mapping[str, Any]) -> dict[str, Path]:
    """Paths in the attributes of arguments, such as the data of a model, by their dotted names."""
    return {
        f"{name}.{attribute.name}": path
        for name, value in given.items()
        if is_dataclass(value) and not isinstance(value, type)
        for attribute in fields(value)
        if isinstance(path := getattr(value, attribute.name), Path)
    }


@contextmanager
def writing(verb: str, out: Path, sources: Mapping[str, str]) -> Iterator[None]:
    """Write the folder `out` as the verb `verb` would; a verb that is running already stays in charge.

    Results that are saved from Python so get the same refusals and the same `MARKER`.
    """
    if _RUNNING.get() is not _NONE:
        yield
        return
    inputs = {name: Path(source) for name, source in sources.items() if source}
    token = _RUNNING.set(_Running(verb, OutputPlace(), out.absolute(), inputs))
    try:
        _check_out(out, Out.FOLDER)
        yield
    finally:
        _RUNNING.reset(token)


def path_arguments(parameters: Mapping[str, inspect.Parameter]) -> list[str]:
    """Return the names of the arguments of a verb that are paths."""
    return [name for name, p in parameters.items() if str(p.annotation).split(" | ")[0] == "Path"]


def check_writable(path: Path) -> None:
    """Refuse an output that cannot be written, before any work is done."""
    try:
        there = next(p for p in (path, *path.absolute().parents) if p.exists())
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    if there != path and not there.is_dir():
        raise BadInput(
            f"{there}: is a file, so that the folder {path} cannot be written: give another folder"
        )
    if not os.access(there, os.W_OK):
        raise BadInput(f"{there}: cannot be written: no permission: give a folder that you may write to")


def _check_out(path: Path, kind: Out) -> None:
    check_named(path.absolute() if kind is Out.SHARED and path == Path() else path)
    check_writable(path)
    if kind is Out.FOLDER:
        check_replaceable(path)
        return
    if kind is Out.FILE and path.is_dir():
        raise BadInput(f"{path}: is a folder: give the name of a file")
    _check_apart(path, may_hold_inputs=kind is Out.SHARED)


def check_named(path: Path) -> None:
    """Refuse a path that is not a valid name for a file or folder."""
    if path.name in ("", "..") or "\0" in str(path):
        raise BadInput(
            f"{str(path)!r}: is no valid name for a file or a folder to be written: give another name"
        )


def check_name(key: str, path: Path) -> None:
    """Refuse a path that the file system rejects, or that lies in a folder without access."""
    try:
        path.exists()
    except OSError as error:
        raise BadInput(f"{key}: {error.strerror}: {str(path)[:60]!r}: give another path") from None


def check_replaceable(path: Path, whole: bool = False) -> None:
    """Refuse to replace a folder, or to add to it, unless the running verb made it or it is empty."""
    if is_on_its_way(path):
        return
    if path.is_symlink():
        raise BadInput(f"{path}: cannot be replaced: is not a folder but a link: give the folder itself")
    if path.exists() and not path.is_dir():
        raise BadInput(f"{path}: is a file, so that the folder {path} cannot be written: give another name")
    _check_apart(path)
    own, made = _RUNNING.get().verb, stamp(path / MARKER)
    try:
        names = sorted(p.name for p in path.iterdir() if p.name != RECORD) if path.is_dir() else []
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}: check its permissions") from None
    if not names:
        return
    if made is None:
        raise BadInput(
            f"{path}: holds {names[0]!r} and has no file {MARKER}, so that no verb made it: "
            "give another folder, or remove this one yourself"
        )
    maker, files = made
    if maker != own:
        raise BadInput(
            f"{path}: was made by {maker}, not by {own}: give another folder, or remove this one yourself"
        )
    if files is None and whole and any(files_in(path)):
        raise BadInput(
            f"{path}: was made by an older version of {own}, which did not list its files: give another "
            "folder, or remove this one yourself"
        )
    if foreign := sorted(set(files_in(path)) - files) if files is not None else []:
        raise BadInput(
            f"{path}: would be replaced with {foreign[0]!r}, which {own} did not write: "
            "move that elsewhere, or give another folder"
        )


def _check_apart(path: Path, may_hold_inputs: bool = False) -> None:
    """Refuse an output that is, contains or lies inside an input; links are followed."""
    running, result = _RUNNING.get(), Path(os.path.realpath(path))
    for name, given in running.inputs.items():
        try:
            source = Path(os.path.realpath(given, strict=True))
        except (OSError, ValueError):
            continue  # the verb says what is wrong with it, if it reads it
        how = ""
        if source == result:
            how = "" if name in running.place.beside else "is"
        elif source in result.parents and name not in running.place.inside and given != Path():
            how = "lies inside"  # the folder in which one works holds results and inputs
        elif result in source.parents and not may_hold_inputs:
            how = "holds"
        if how:
            raise BadInput(f"{path}: {how} the input {name}={given}: give another place for the results")


def mark(new: Path, path: Path) -> None:
    """Write into a new folder which verb made it and which files it holds."""
    if not is_on_its_way(path):
        content = {"made_by": _RUNNING.get().verb, "files": sorted(files_in(new))}
        (new / MARKER).write_text(marker_text(content))


def missing_marker(path: Path) -> tuple[Path, str] | None:
    """Return the marker, without files, that the output folder of the running verb lacks."""
    running = _RUNNING.get()
    if running.own is None or running.own not in path.absolute().parents or path.name == MARKER:
        return None
    marker = running.own / MARKER
    return None if marker.exists() else (marker, marker_text({"made_by": running.verb}))
