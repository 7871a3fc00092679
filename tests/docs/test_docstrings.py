"""Docstrings: complete for what users meet and for protocols, else a summary with the shapes of arrays."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from docs.reference.docstrings import Classes, classes, docstring
from unmodelled.cli.program import full_docstring

ROOT = Path(__file__).parents[2]
PACKAGES = ("unmodelled", "pipeline")

#: A description or summary that begins so is part of a sentence that only its author knows.
FRAGMENTS = set(
    re.findall(
        r"\w+",
        "of that what which who whose where how when why from as by for in to with see exists it they also "
        "those these this whatever",
    )
)
#: A summary of a function begins with its verb, so with none of these.
NOT_VERBS = FRAGMENTS | set(
    re.findall(
        r"\w+",
        "a an the all any both each every like one some two whether not none no is are its their another",
    )
)
#: An annotation of numbers that have a shape.
ARRAYS = re.compile(r"\b(?:Array|NDArray|ndarray|Tensor|Indices|Mask|Single)\b")
#: How a shape is told.
SHAPE = re.compile(r"\bshapes?\b|\bscalar\b", re.I)
SECTION = re.compile(r"^(Args|Attributes|Examples|Raises|Returns|Yields):$", re.M)
ENTRY = re.compile(r"^(\*{0,2}\w+)(?: \([^)]*\))?: *(.*)$")
#: Stands in files of loops that numba compiles: the functions around them say what their arguments are.
LOOPS = "# mypy: ignore-errors"
#: What users meet: functions of verbs, the interface of `import unmodelled`, and the words of laws.
FOR_USERS = ("unmodelled/api/", "unmodelled/cli/verbs/", "pipeline/stages/", "unmodelled/effects/effect.py")
FOR_USERS += ("unmodelled/effects/law.py", "unmodelled/effects/place.py")
NAMES = frozenset(re.findall(r"import (\w+) as \1", (ROOT / "unmodelled" / "__init__.py").read_text()))
#: Functions and classes that a configuration names.
TARGETS = frozenset(
    target
    for folder in ("conf", "unmodelled/conf")
    for path in (ROOT / folder).rglob("*.yaml")
    for target in re.findall(r"_target_: *([\w.]+)", path.read_text())
)
EVERY = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
FILES = [path for path in EVERY if LOOPS not in path.read_text()]


@dataclass(frozen=True)
class Documented:
    """A public function or class, as it is written."""

    name: str
    node: ast.FunctionDef | ast.ClassDef
    owner: ast.ClassDef | None
    source: tuple[str, ...] = ()  # lines of the file

    @property
    def is_complete(self) -> bool:
        """Whether it is for users or a protocol, so that all of it is described."""
        names = [self.node.name] + ([] if self.owner is None else [self.owner.name])
        module = self.name.partition(".py:")[0].replace("/", ".")
        whole = ".".join([module, *reversed(names)])
        named = bool({*names} & NAMES) or any(t == whole or whole.startswith(f"{t}.") for t in TARGETS)
        protocol = any(
            _is_protocol(each) for each in (self.node, self.owner) if isinstance(each, ast.ClassDef)
        )
        return named or protocol or self.name.startswith(FOR_USERS)

    @property
    def text(self) -> str:
        return full_docstring(self.node)

    @property
    def is_property(self) -> bool:
        names = {ast.unparse(each).split(".")[-1] for each in self.node.decorator_list}
        return bool(names & {"property", "cached_property"})

    def section(self, *headings: str) -> str:
        parts = SECTION.split(self.text)
        return "\n".join(
            text for name, text in zip(parts[1::2], parts[2::2], strict=True) if name in headings
        )

    def entries(self) -> dict[str, str]:
        """Descriptions of the parameters, one parameter a line, further lines indented."""
        found: dict[str, str] = {}
        last = None
        for line in self.section("Args", "Attributes").strip("\n").splitlines():
            entry = ENTRY.match(line[4:]) if line[:4].isspace() else None
            if entry is not None:
                last = entry[1].lstrip("*")
                found[last] = entry[2]
            elif last is not None:
                found[last] += f" {line.strip()}"
        return found

    def parameters(self) -> dict[str, str]:
        """Names -> annotations of the arguments; for a class those of its constructor."""
        if isinstance(self.node, ast.FunctionDef):
            return _arguments(self.node)
        kinds = {ast.unparse(each).split("(")[0].split(".")[-1] for each in self.node.decorator_list}
        bases = {ast.unparse(each) for each in self.node.bases}
        if "dataclass" in kinds or "NamedTuple" in bases:
            fields = [n for n in self.node.body if isinstance(n, ast.AnnAssign)]
            found = {n.target.id: ast.unparse(n.annotation) for n in fields if isinstance(n.target, ast.Name)}
            # a class variable or a field that is computed is no argument
            computed = {n.target.id for n in fields if isinstance(n.target, ast.Name) and _computed(n)}
            return {k: v for k, v in found.items() if not k.startswith("_") and k not in computed}
        inits = [n for n in self.node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"]
        return _arguments(inits[0]) if inits else {}


def _is_protocol(node: ast.ClassDef) -> bool:
    bases = {ast.unparse(base).split(".")[-1].split("[")[0] for base in node.bases}
    inside = (each for each in node.body if isinstance(each, ast.FunctionDef))
    abstract = any("abstractmethod" in ast.unparse(d) for each in inside for d in each.decorator_list)
    return abstract or bool(bases & {"ABC", "Protocol"})


def _computed(field: ast.AnnAssign) -> bool:
    return "ClassVar" in ast.unparse(field.annotation) or "init=False" in ast.unparse(
        field.value or field.target
    )


def _arguments(node: ast.FunctionDef) -> dict[str, str]:
    given = node.args
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    found = {a.arg: ast.unparse(a.annotation) if a.annotation else "" for a in every if a is not None}
    return {k: v for k, v in found.items() if k not in ("self", "cls") and not k.startswith("_")}


@cache
def public(path: Path) -> list[Documented]:
    text = path.read_text()
    lines = tuple(text.splitlines())
    found = list(_public(ast.parse(text).body, None, path.relative_to(ROOT).as_posix(), lines))
    return [each for each in found if not ("figures" in path.parts and _is_captioned(each.node))]


def _public(
    body: list[ast.stmt], owner: ast.ClassDef | None, prefix: str, source: tuple[str, ...]
) -> Iterator[Documented]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            found = Documented(f"{prefix}: {node.name}", node, owner, source)
            if isinstance(node, ast.ClassDef):
                yield found
                yield from _public(node.body, node, found.name, source)
            elif found.text or not docstring(node, owner, _classes()):
                yield found


def _is_captioned(node: ast.AST) -> bool:
    """Whether a function draws a figure, so that its docstring is the caption."""
    is_drawing = isinstance(node, ast.FunctionDef) and node.returns is not None
    return is_drawing and ast.unparse(node.returns) == "Figure" and list(_arguments(node)) == ["data"]


@cache
def _classes() -> Classes:
    return classes(ast.parse(path.read_text()) for path in EVERY)


def faults(found: Documented) -> list[str]:
    """What is lacking, a line each."""
    name, said, parameters = found.name, found.entries(), found.parameters()
    if not found.text:
        return [f"{name}: has no docstring"]
    lines = []
    first = re.sub(r"\W", "", found.text.split()[0]).lower()
    if first in (FRAGMENTS if isinstance(found.node, ast.ClassDef) or found.is_property else NOT_VERBS):
        lines.append(f"{name}: the summary begins with {first!r}: begin with a verb, for a class with a noun")
    if not found.is_complete:
        return [*lines, *_of_inside(found)]
    lines += [f"{name}: Args do not name {each}" for each in parameters if each not in said]
    if isinstance(found.node, ast.FunctionDef):
        lines += [
            f"{name}: Args name {each}, which is no parameter" for each in said if each not in parameters
        ]
    for each, text in said.items():
        word = re.sub(r"\W.*", "", text).lower()
        if not text or word in FRAGMENTS:
            lines.append(f"{name}: {each} is described by a fragment: begin with a noun, not with {word!r}")
        elif ARRAYS.search(parameters.get(each, "")) and not SHAPE.search(text):
            lines.append(f"{name}: the description of the array {each} has no shape")
    returned = getattr(found.node, "returns", None)
    if returned is not None and ARRAYS.search(ast.unparse(returned)):
        told = found.text if found.is_property else found.section("Returns", "Yields")
        if not SHAPE.search(told):
            lines.append(f"{name}: Returns has no shape of the array")
    return lines


def _of_inside(found: Documented) -> list[str]:
    """What is too much, or lacking, of a function or class that only the program uses."""
    lines = []
    if found.section("Args", "Attributes", "Returns", "Yields", "Raises"):
        lines.append(
            f"{found.name}: say what names do not in the summary or beside a field, with shapes of arrays"
        )
    if isinstance(found.node, ast.ClassDef):
        return [*lines, *(f"{found.name}: the array {each} has no shape" for each in _without_shape(found))]
    kinds = [*found.parameters().values(), ast.unparse(found.node.returns) if found.node.returns else ""]
    if any(map(ARRAYS.search, kinds)) and "(" not in found.text:
        lines.append(f"{found.name}: the docstring has no shape of its arrays")
    return lines


def _without_shape(found: Documented) -> Iterator[str]:
    """Array fields of a class whose shape stands neither beside them nor in the docstring of the class."""
    for each in found.node.body:
        if isinstance(each, ast.AnnAssign) and ARRAYS.search(ast.unparse(each.annotation)):
            beside = "".join(found.source[each.lineno - 1 : each.end_lineno])
            above = found.source[each.lineno - 2] if each.lineno > 1 else ""
            told = beside.partition("#")[2] + (above if above.strip().startswith("#") else "")
            name = ast.unparse(each.target)
            if not name.startswith("_") and "(" not in found.text and not re.search(r"\(|scalar", told):
                yield name


def test_docstrings_are_complete() -> None:
    texts = {path: path.read_text() for path in FILES}
    lacking = [
        f"{p}: the module has no docstring" for p, t in texts.items() if not ast.get_docstring(ast.parse(t))
    ]
    lacking += [line for path in FILES for each in public(path) for line in faults(each)]
    assert FILES and not lacking, "\n" + "\n".join(lacking)


def test_an_incomplete_docstring_is_found() -> None:
    text = '''
def pick(rows: Array, seed: int) -> Array:
    """Of the rows, one.

    Args:
        rows: the candidates.
        seed: of the draw.
    """
'''
    (node,) = ast.parse(text).body
    assert isinstance(node, ast.FunctionDef)
    lacking = "\n".join(faults(Documented("pick", node, None)))
    assert "begins with 'of'" in lacking and "say what names do not in the summary" in lacking
    lacking = "\n".join(faults(Documented("unmodelled/api/draws.py: pick", node, None)))
    for part in (
        "begins with 'of'",
        "array rows has no shape",
        "seed is described by a fragment",
        "Returns has",
    ):
        assert part in lacking


def test_the_shape_of_a_field_stands_beside_it() -> None:
    text = '''
class Gap:
    """The gap of a model."""

    size: Array  # (windows, outputs)
    noise: Array
    #: (outputs,), of all sensors together.
    floor: Array
'''
    (node,) = ast.parse(text).body
    assert isinstance(node, ast.ClassDef)
    assert faults(Documented("Gap", node, None, tuple(text.splitlines()))) == [
        "Gap: the array noise has no shape"
    ]


def test_an_override_has_the_docstring_of_the_method() -> None:
    text = """
class Base:
    def run(self) -> None:
        'Run.'
class Middle(Base): ...
class Last(Middle):
    def run(self) -> None: ...
    def walk(self) -> None: ...
"""
    tree = ast.parse(text)
    last = tree.body[-1]
    assert isinstance(last, ast.ClassDef)
    told = [docstring(n, last, classes([tree])) for n in last.body if isinstance(n, ast.FunctionDef)]
    assert told == ["Run.", ""]
