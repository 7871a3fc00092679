"""Laws that a user brings, from objects or a file (laws/1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from unmodelled.base.errors import BadInput
from unmodelled.effects.library import effects
from unmodelled.effects.own_law import Law
from unmodelled.systems.document import Node, as_node, load_yaml

SCHEMA = "laws/1"
#: Own laws: objects, or the path of a file of them.
LawsGiven: TypeAlias = Sequence[Law] | Path | str


def given_laws(given: LawsGiven | None) -> tuple[Law, ...]:
    """Return own laws, read from their file if that is given; no two laws have one name.

    A law that an installed package brings may be given, too; it is left out, because it is in the library.
    """
    found = read_laws(Path(given)) if isinstance(given, str | Path) else tuple(given or ())
    known = {effect.family for effect in effects() if effect not in found}
    for k, law in enumerate(found):
        if not isinstance(law, Law):
            raise BadInput(f"laws: must be um.Law objects or the path of a file, got {type(law).__name__}")
        if law.name in known | {other.name for other in found[:k]}:
            raise BadInput(f"law {law.name}: the name is taken; give it another one")
    return tuple(law for law in found if law not in effects())


def read_laws(path: Path) -> tuple[Law, ...]:
    """Read a file of own laws (laws/1)."""
    top = load_yaml(path, "laws").fields(("schema", "laws"))
    if top["schema"].text() != SCHEMA:
        raise top["schema"].wrong(f"must be {SCHEMA}")
    return tuple(_read(name, node) for name, node in top["laws"].entries().items())


def laws_of_answer(entries: Sequence[Any], file: Path) -> tuple[Law, ...]:
    """Return the laws that an answer lists, which are read as those of a file.

    Takes the entries `laws` of diagnosis.json, see `Law.definition`.
    """
    found = []
    for node in as_node([*entries], file, "laws").items():
        own = dict(node.fields(("name", "formula", "numbers"), ("at", "only")))
        found.append(_read(own.pop("name").text(), replace(node, content=own)))
    try:
        return given_laws(found)
    except BadInput as fault:
        raise BadInput(f"{file}: {fault}") from None


def _read(name: str, node: Node) -> Law:
    given = node.fields(("formula", "numbers"), ("at", "only"))
    numbers = {}
    for key, entry in given["numbers"].entries().items():
        own = entry.fields(("unit", "plausible"), ("low", "high", "like"))
        texts = {k: own[k].text() for k in ("unit", "like") if k in own}
        values = {k: own[k].number() for k in ("plausible", "low", "high") if k in own}
        numbers[key] = dict[str, Any](**texts, **values)
    more: dict[str, Any] = {"at": given["at"].text()} if "at" in given else {}
    if "only" in given:
        more["only"] = tuple(item.text() for item in given["only"].items())
    try:
        return Law(name, given["formula"].text(), numbers, **more)  # type: ignore[arg-type]
    except BadInput as fault:
        raise node.wrong(str(fault)) from None
