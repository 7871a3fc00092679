"""Every example in a docstring prints what it shows.

Numbers are compared as they are printed: an example rounds them, or ends them in "...".
"""

import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = [path for package in ("unmodelled", "pipeline") for path in sorted((ROOT / package).rglob("*.py"))]
FILES = [path for path in CODE if ">>> " in path.read_text()]
MODULES = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in FILES]
#: Modules whose examples take longer than two seconds.
LONG = {f"unmodelled.api.{name}" for name in ("answer_list", "comparison", "diagnosis", "learned_laws")}
LONG |= {"unmodelled.api.next_experiment", "unmodelled.effects.own_law", "unmodelled.learning.evaluation"}
LONG |= {"unmodelled.learning.uncertainty.identified"}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long) if n in LONG else n for n in MODULES]
)
def test_examples_print_what_they_show(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)  # examples read systems/*.yaml
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as missing:
        if missing.name != "torch":
            raise
        pytest.skip("PyTorch is not installed: pip install 'unmodelled[train]'")
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    failed, tried = doctest.testmod(module, optionflags=flags)
    assert tried, f"{name}: no example is found; is it in the docstring of a function that stays a function?"
    assert not failed, f"{name}: the differences are printed above"
