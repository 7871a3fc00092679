"""Makes this reference from code and config files: `make docs`, or python -m docs.reference.generate."""

from __future__ import annotations

from pathlib import Path

from docs.reference import configs, effects, systems, verbs
from unmodelled.base.files import replacing

HERE = Path(__file__).parent

INDEX = """# Reference

Made from the code by `make docs`; a test compares the two.

- [Verbs](verbs.md): what `python -m pipeline <verb>` does, its keys and their defaults.
- [Configs](configs.md): models, splits, profiles, sources, and what else a key such as `model=` can be, with
  the meaning of their keys.
- [Effects](effects.md): what a diagnosis can name, with laws, numbers and units.
- [Systems](systems.md): the system files that come with the project, and what an expression in one may hold.

`python -m pipeline <verb> --help` says the same of one verb; `--cfg job` shows the configuration after your
changes.
"""


def pages() -> dict[str, str]:
    """The text of every page by the name of its file."""
    return {
        "README.md": INDEX,
        "verbs.md": verbs.page(),
        "configs.md": configs.page(),
        "effects.md": effects.page(),
        "systems.md": systems.page(),
    }


if __name__ == "__main__":
    for name, text in pages().items():
        with replacing(HERE / name) as temporary:
            temporary.write_text(text)
