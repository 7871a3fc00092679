"""Write this reference and the rooms of ARCHITECTURE.md: `make docs`, python -m docs.reference.generate."""

from __future__ import annotations

from pathlib import Path

from docs.reference import configs, effects, rooms, systems, verbs
from unmodelled.base.files import replacing

HERE = Path(__file__).parent

INDEX = """# Reference

`make docs` writes these pages from the code; a test compares pages and code.

- [Verbs](verbs.md): the purpose of every verb of `python -m pipeline <verb>`, its keys and their defaults.
- [Configs](configs.md): the configuration files that a key such as `model=` can choose (models, splits,
  profiles, sources), and the meaning of their keys.
- [Effects](effects.md): the effects that a diagnosis can name, with laws, parameters and units.
- [Systems](systems.md): the system files in this repository, and the language of their expressions.

`python -m pipeline <verb> --help` prints the same about one verb; `--cfg job` prints the configuration after
your changes. `make docs` also writes pages on all Python functions to `docs/api`.
"""


def pages() -> dict[str, str]:
    """Return the text of every page by file name."""
    return {
        "README.md": INDEX,
        "verbs.md": verbs.page(),
        "configs.md": configs.page(),
        "effects.md": effects.page(),
        "systems.md": systems.page(),
        "../../ARCHITECTURE.md": rooms.page(),
    }


if __name__ == "__main__":
    for name, text in pages().items():
        with replacing(HERE / name) as temporary:
            temporary.write_text(text)
