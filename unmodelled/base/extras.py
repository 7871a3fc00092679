"""The command that installs a library that is missing, such as that of an extra."""

from __future__ import annotations

from importlib.metadata import requires


def missing(error: ModuleNotFoundError) -> str | None:
    """Return the sentence about a library that is not installed, with the command that installs it.

    Examples:
        >>> missing(ModuleNotFoundError("No module named 'pyarrow'", name="pyarrow"))
        'pyarrow is not installed: pip install "pyarrow>=20"'
    """
    name = str(error.name).partition(".")[0]
    for requirement in requires("unmodelled") or ():
        wanted = requirement.partition(";")[0].strip()
        if wanted.startswith(name) and not wanted[len(name) :][:1].isalnum():
            return f'{name} is not installed: pip install "{wanted}"'
    return None
