"""Write the page on verbs."""

from __future__ import annotations

import re
from typing import Any

import yaml

from docs.reference.docstrings import of
from docs.reference.markdown import code, table, value
from pipeline.__main__ import CONF, PROGRAM

OUT = "${hydra:runtime.output_dir}"


def page() -> str:
    """Return one section per verb, in alphabetical order."""
    known = PROGRAM.summaries()
    index = "\n".join(f"- [{verb}](#{verb}): {line}" for verb, line in known.items())
    head = f"# Verbs\n\n`python -m pipeline <verb> key=value ...`\n\n{index}\n"
    return "\n".join([head, *(_section(verb, line) for verb, line in known.items())])


def _section(verb: str, line: str) -> str:
    found = of(PROGRAM.target(verb))
    config = yaml.safe_load(PROGRAM.config(verb).read_text())
    defaults = [entry for entry in config.get("defaults", []) if isinstance(entry, dict)]
    chosen = {group: name for entry in defaults for group, name in entry.items()}
    meanings = found.meanings()
    rows = [
        (code(name), _default(verb, name, kind, config, chosen), meanings.get(name, ""))
        for name, kind in found.parameters.items()
    ]
    head = f"## {verb}\n\n{line}\n\n{_joined(found.text)}\n"
    parts = [head, table(("key", "default", "meaning"), rows)]
    if "Raises" in found.sections:
        refused = " ".join(found.sections["Raises"].split()).removeprefix("BadInput: ")
        parts.append(f"Refused: {refused}\n")
    return "\n".join(parts)


def _default(verb: str, name: str, kind: str, config: dict[str, Any], chosen: dict[str, str]) -> str:
    if name in chosen or name == "profile_name":
        return f"[{code(chosen.get(name, config.get(name)))}](configs.md#{name.removesuffix('_name')})"
    content = config[name]
    if content == OUT:
        return "a folder under `outputs/`"
    if content == "???" or (content is None and kind == "Path"):
        return "must be given"
    if isinstance(content, dict) and len(str(content)) > 80:
        return f"see [{verb}.yaml](../../{PROGRAM.config(verb).relative_to(CONF.parent)})"
    return code(value(content))


def _joined(text: str) -> str:
    """Return the text with every paragraph and every list item on one line."""
    paragraphs = re.split(r"\n\n|\n(?=- )", text)
    lines = [" ".join(paragraph.split()) for paragraph in paragraphs]
    return "\n\n".join(lines).replace("\n\n- ", "\n- ").replace(":\n- ", ":\n\n- ")
