"""Reading of answers of strangers: diagnosis.json, and the answer.json of the benchmark, by one schema."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, Literal
from unicodedata import category

from jsonschema import Draft7Validator, ValidationError

from unmodelled.base.errors import BadInput, closest, printable
from unmodelled.base.files import read_json
from unmodelled.base.shapes import in_words

#: Version of diagnosis.json.
SCHEMA = "diagnosis/2"
#: What the schema describes: diagnosis.json, the answer.json of an entrant, and a law of the user.
Kind = Literal["diagnosis", "answer", "law"]
#: Bytes of an answer, checked within 10 CPU seconds; diagnosis.json of 5000 experiments has a tenth.
LARGEST = 4_000_000
#: Types of the schema in words.
TYPES = {
    **{"object": "an object", "array": "a list", "string": "a text", "null": "null"},
    **{"number": "a number", "integer": "a whole number", "boolean": "true or false"},
}


def read_diagnosis(path: Path) -> dict[str, Any]:
    """Read diagnosis.json; a BadInput names the file, the entry and what it must be.

    Control characters in texts are escaped, so that whatever shows the answer sends no command to a terminal.
    """
    content = _read(path)
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise BadInput(f"{path}: is no answer of this version (schema {SCHEMA}): diagnose again")
    check_content(path, content, "diagnosis")
    # paths, which are opened: a folder may have any name
    return _printable(path, content) | {key: content[key] for key in ("sources",) if key in content}


def read_answer(path: Path) -> dict[str, Any]:
    """Read the answer.json of an entrant of the benchmark, as `read_diagnosis` does.

    Args:
        path: file of the answer.
    """
    content = _read(path)
    check_content(path, content, "answer")
    return _printable(path, content)


def check_content(where: Path | str, content: Any, kind: Kind) -> None:
    """Refuse content that does not follow the schema; the message names `where` and the entry."""
    fault = next(_validator(kind).iter_errors(content), None)
    if fault is not None:
        place = "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in fault.absolute_path)
        said = f"{place.removeprefix('.')}: {_told(fault)}" if place else _told(fault)
        raise BadInput(f"{where}: {said}{': diagnose again' if kind == 'diagnosis' else ''}")


def printable_content(content: Any) -> Any:
    """Return JSON content whose texts a terminal shows as they are."""
    match content:
        case str():
            return "".join(c if category(c) == "Zs" else printable(c) for c in content)
        case list():
            return [printable_content(item) for item in content]
        case dict():
            return {printable_content(key): printable_content(value) for key, value in content.items()}
    return content


def _read(path: Path) -> Any:
    if path.is_file() and (size := path.stat().st_size) > LARGEST:
        raise BadInput(f"{path}: has {size / 1e6:.0f} MB, an answer has at most {LARGEST / 1e6:.0f} MB")
    return read_json(path)


def _printable(path: Path, content: dict[str, Any]) -> dict[str, Any]:
    try:
        found: dict[str, Any] = printable_content(content)
        return found
    except RecursionError:
        raise BadInput(f"{path}: not an answer (nested too deeply): write it again") from None


@cache
def _validator(kind: Kind) -> Draft7Validator:
    schema = json.loads(Path(__file__).with_name("answers.schema.json").read_text())
    return Draft7Validator({"$ref": f"#/definitions/{kind}", "definitions": schema["definitions"]})


def _told(fault: ValidationError) -> str:
    """What an entry must be, such as "must be an object, got 1.2"."""
    rule, wanted, found = fault.validator, fault.validator_value, fault.instance
    match rule:
        case "required":
            return f"{next(key for key in wanted if key not in found)} is missing"
        case "additionalProperties":
            known = fault.schema["properties"]
            key = next(key for key in found if key not in known)
            return f"unknown key {key!r}{closest(key, known)}"
        case "type":
            types = [wanted] if isinstance(wanted, str) else wanted
            return f"must be {' or '.join(TYPES[name] for name in types)}, got {in_words(found)}"
        case "enum":
            return f"must be one of {', '.join(wanted)}, got {in_words(found)}"
        case "minItems" | "maxItems":
            return f"must have {wanted} entries, got {len(found)}"
    return str(fault.message)
