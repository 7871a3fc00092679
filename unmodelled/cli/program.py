"""Find the verbs of a program of the command line, and their configuration files."""

from __future__ import annotations

import ast
import functools
import re
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from omegaconf import DictConfig

#: Folder of the library.
PACKAGE = Path(__file__).parents[1]
#: Line in the docstring of a verb that leaves the meaning of keys to a function of the library.
SEE = re.compile(r"^    (\w+(?:, \w+)*): see `(unmodelled\.[\w.]+)`\.\n", re.M)


@dataclass(frozen=True)
class Source:
    """A package that provides verbs."""

    package: str  # of modules; a verb is the function of its module's own name
    verbs: Path  # folder of that package
    conf: Path  # folder of its config files


#: Verbs of the library, which every program has.
LIBRARY = Source("unmodelled.cli.verbs", PACKAGE / "cli" / "verbs", PACKAGE / "conf")


def version() -> str:
    """Return the version of the library and of Python."""
    from importlib.metadata import version as installed

    return f"unmodelled {installed('unmodelled')} (Python {'.'.join(map(str, sys.version_info[:3]))})"


def full_docstring(node: ast.FunctionDef | ast.ClassDef) -> str:
    """Return a docstring, with the meaning of keys that it leaves to a function of the library."""
    return SEE.sub(_entries, ast.get_docstring(node) or "")


def _entries(found: re.Match[str]) -> str:
    """Entries of some keys, as the docstring of the function has them."""
    module, _, name = found[2].rpartition(".")
    text = ast.get_docstring(_function(PACKAGE.parent / f"{module.replace('.', '/')}.py", name)) or ""
    told = {entry[1]: entry[0] for entry in re.finditer(r"^    (\w+): .*\n(?: {8}.*\n)*", text, re.M)}
    return "".join(told[key] for key in found[1].split(", "))


def _function(path: Path, name: str) -> ast.FunctionDef:
    nodes = ast.parse(path.read_text()).body
    return next(node for node in nodes if isinstance(node, ast.FunctionDef) and node.name == name)


@dataclass(frozen=True)
class Program:
    """A program of the command line."""

    name: str  # command before the verb
    sources: tuple[Source, ...]  # the first one wins if two have the same file
    version: Callable[[], str]  # the line that `--version` prints
    #: Records a finished verb: command, configuration (YAML), seed, duration (s).
    note: Callable[[str, str, int | None, float], None] | None = None

    @functools.cached_property
    def verbs(self) -> dict[str, Path]:
        """Path of the module of every verb, by name in alphabetical order."""
        found = {path.stem: path for source in self.sources[::-1] for path in source.verbs.glob("[a-z]*.py")}
        return {name: found[name] for name in sorted(found) if self._find(f"{name}.yaml")}

    def target(self, verb: str) -> str:
        """Return the dotted name of a verb's function."""
        package = next(s.package for s in self.sources if s.verbs == self.verbs[verb].parent)
        return f"{package}.{verb}.{verb}"

    def summaries(self) -> dict[str, str]:
        """Return the first line of the module docstring of every verb."""
        return {name: file.read_text().splitlines()[0].strip('"') for name, file in self.verbs.items()}

    def docstring(self, verb: str) -> str:
        """Return the docstring of a verb, without importing the verb."""
        return full_docstring(_function(self.verbs[verb], verb))

    def config(self, verb: str) -> Path:
        """Return the path of the configuration file of a verb."""
        found = self._find(f"{verb}.yaml")
        assert found is not None, verb
        return found

    def groups(self) -> dict[str, dict[str, Path]]:
        """Return the configuration files that keys can choose: paths by group and choice."""
        found: dict[str, dict[str, Path]] = {}
        for source in self.sources[::-1]:
            for path in source.conf.glob("*/*.yaml"):
                found.setdefault(path.parent.name, {})[path.stem] = path
        return {group: dict(sorted(found[group].items())) for group in sorted(found)}

    def choices(self, verb: str) -> dict[str, list[str]]:
        """Return the groups that the keys of a verb choose from, with their choices."""
        config = self.config(verb).read_text()
        return {group: list(files) for group, files in self.groups().items() if f"- {group}:" in config}

    def required_keys(self, verb: str) -> list[str]:
        """Return the names of the keys of a verb that must be given, in the order of its configuration."""
        return re.findall(r"^(\w+): \?\?\?", self.config(verb).read_text(), re.MULTILINE)

    def keys(self, verb: str) -> set[str]:
        """Return the names of all keys of a verb that its configuration file has, and its groups."""
        text = self.config(verb).read_text()
        return {"_target_", *self.choices(verb), *re.findall(r"^(\w+):", text, re.MULTILINE)}

    def is_choice(self, override: str) -> bool:
        """Tell whether an override such as `model=hybrid` chooses a configuration file."""
        group, _, choice = override.partition("=")
        return not choice.startswith("{") and any((source.conf / group).is_dir() for source in self.sources)

    def folder(self, verb: str) -> str:
        """Return the folder of the verb's own configuration file, with which Hydra starts."""
        return str(self.config(verb).parent.resolve())

    def search_path(self, verb: str) -> list[str]:
        """Return overrides with which Hydra finds the configuration files in the other folders."""
        folders = [str(source.conf.resolve()) for source in self.sources]
        others = [folder.replace("'", "\\'") for folder in folders if folder != self.folder(verb)]
        paths = ",".join(f"'file://{folder}'" for folder in others)
        return [f"hydra.searchpath=[{paths}]"] if paths else []

    def compose(self, verb: str, overrides: Sequence[str] = (), with_hydra: bool = False) -> DictConfig:
        """Compose the configuration of a verb."""
        from hydra import compose, initialize_config_dir
        from hydra.core.global_hydra import GlobalHydra

        running = GlobalHydra.instance().is_initialized()  # not in a worker of a sweep
        with nullcontext() if running else initialize_config_dir(self.folder(verb), version_base="1.3"):
            return compose(verb, [*self.search_path(verb), *overrides], return_hydra_config=with_hydra)

    def _find(self, name: str) -> Path | None:
        return next((path for s in self.sources if (path := s.conf / name).exists()), None)
