"""Read equations for pages: MathML with known elements only."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json

#: What a formula consists of; nothing here can run, load or link.
ELEMENTS = {
    *("math", "mrow", "mi", "mo", "mn", "mfrac", "msup", "msub", "msubsup", "msqrt", "mroot", "mover"),
    *("mfenced", "mtable", "mtr", "mtd", "mtext", "mspace", "mstyle"),
}
ATTRIBUTES = {"display", "close", "open", "mathvariant"}


def read_equations(path: Path) -> dict[str, Any]:
    """Read a file with a chapter and rows of kind, text and mathml."""
    content = read_json(path)
    try:
        rows = [{key: str(row[key]) for key in ("kind", "text", "mathml")} for row in content["rows"]]
        chapter = int(content["chapter"])
    except (KeyError, TypeError, ValueError):
        raise BadInput(f"{path}: must have chapter and rows of kind, text and mathml") from None
    for number, row in enumerate(rows, start=1):
        try:
            formula = ElementTree.fromstring(row["mathml"])
        except ElementTree.ParseError as error:
            raise BadInput(f"{path}: row {number}: not MathML ({error})") from None
        for element in formula.iter():
            if element.tag not in ELEMENTS or not set(element.attrib) <= ATTRIBUTES:
                raise BadInput(f"{path}: row {number}: {element.tag} is not part of a formula")
        row["mathml"] = ElementTree.tostring(formula, encoding="unicode")
    return {"chapter": chapter, "rows": rows}
