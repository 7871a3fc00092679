"""Which verbs a program of the command line has, and where their config files lie."""

from __future__ import annotations

import ast
import functools
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


@dataclass(frozen=True)
class Source:
    """A package that brings verbs.

    Attributes:
        package: dotted name of the package of its verbs; a verb is the function of a module's own name.
        verbs: folder of that package.
        conf: folder of its config files.
    """

    package: str
    verbs: Path
    conf: Path


#: Verbs of the library, which every program has.
LIBRARY = Source("unmodelled.cli.verbs", PACKAGE / "cli" / "verbs", PACKAGE / "conf")


def version() -> str:
    """The version of the library and of Python."""
    from importlib.metadata import version as installed

    return f"unmodelled {installed('unmodelled')} (Python {'.'.join(map(str, sys.version_info[:3]))})"


@dataclass(frozen=True)
class Program:
    """A program of the command line.

    Attributes:
        name: what a user types before the verb.
        sources: where verbs and config files come from; of two files of one name the first is used.
        version: function that returns the line that `--version` prints.
        note: function that notes every finished verb: its command, configuration (YAML), seed and time, s;
            None: nothing is noted.
    """

    name: str
    sources: tuple[Source, ...]
    version: Callable[[], str]
    note: Callable[[str, str, int | None, float], None] | None = None

    @functools.cached_property
    def verbs(self) -> dict[str, Path]:
        """The file of every verb, by its name in alphabetical order."""
        found = {path.stem: path for source in self.sources[::-1] for path in source.verbs.glob("[a-z]*.py")}
        return {name: found[name] for name in sorted(found) if self._find(f"{name}.yaml")}

    def target(self, verb: str) -> str:
        """Dotted name of a verb's function."""
        package = next(s.package for s in self.sources if s.verbs == self.verbs[verb].parent)
        return f"{package}.{verb}.{verb}"

    def summaries(self) -> dict[str, str]:
        """The first line of every verb's module, which says what the verb does."""
        return {name: file.read_text().splitlines()[0].strip('"') for name, file in self.verbs.items()}

    def docstring(self, verb: str) -> str:
        """The docstring of a verb, read without importing anything."""
        tree = ast.parse(self.verbs[verb].read_text())
        function = next(n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == verb)
        return ast.get_docstring(function) or ""

    def config(self, verb: str) -> Path:
        """The config file of a verb."""
        found = self._find(f"{verb}.yaml")
        assert found is not None, verb
        return found

    def groups(self) -> dict[str, dict[str, Path]]:
        """The config files that keys choose: group, choice, file."""
        found: dict[str, dict[str, Path]] = {}
        for source in self.sources[::-1]:
            for path in source.conf.glob("*/*.yaml"):
                found.setdefault(path.parent.name, {})[path.stem] = path
        return {group: dict(sorted(found[group].items())) for group in sorted(found)}

    def choices(self, verb: str) -> dict[str, list[str]]:
        """The groups that a verb's keys choose from, with their choices."""
        config = self.config(verb).read_text()
        return {group: list(files) for group, files in self.groups().items() if f"- {group}:" in config}

    def is_choice(self, override: str) -> bool:
        """Whether an override such as `model=hybrid` chooses a config file."""
        return any((source.conf / override.split("=")[0]).is_dir() for source in self.sources)

    def folder(self, verb: str) -> str:
        """Folder of config files that Hydra starts from: the one with the verb's own."""
        return str(self.config(verb).parent.resolve())

    def search_path(self, verb: str) -> list[str]:
        """Overrides by which Hydra finds the config files in the other folders."""
        folders = [str(source.conf.resolve()) for source in self.sources]
        others = [folder.replace("'", "\\'") for folder in folders if folder != self.folder(verb)]
        paths = ",".join(f"'file://{folder}'" for folder in others)
        return [f"hydra.searchpath=[{paths}]"] if paths else []

    def compose(self, verb: str, overrides: Sequence[str] = (), with_hydra: bool = False) -> DictConfig:
        """The configuration of a verb after overrides, with Hydra's own part if asked for."""
        from hydra import compose, initialize_config_dir
        from hydra.core.global_hydra import GlobalHydra

        running = GlobalHydra.instance().is_initialized()  # not in a worker of a sweep
        with nullcontext() if running else initialize_config_dir(self.folder(verb), version_base="1.3"):
            return compose(verb, [*self.search_path(verb), *overrides], return_hydra_config=with_hydra)

    def _find(self, name: str) -> Path | None:
        return next((path for s in self.sources if (path := s.conf / name).exists()), None)
