"""The notebooks run from their first to their last cell, and show what their text says."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
#: Notebook -> patterns of what its text says that the outputs show.
SHOWN = {
    "own_machine": [r"coulomb_friction .*at rail", r"F_c = 6\.[12]\d* N", r"with dry friction +0\.000[2-9]"],
    "balances": [
        r"storage at air(.|\n)*k_air = (399|40[01])(\.\d)? W/K",
        r"Rc branch at sensor U(.|\n)*tau_1 = 33\.\d* s(.|\n)*cannot distinguish it from storage at cell",
        r"Input delay at input T_in(.|\n)*T_d_T_in = 7\.[45]\d* s",
        r"input m acts 0\.\d+ s later",
    ],
    "hybrid_model": [r"b is absorbed by the network", r"hybrid model, held out +0\.0[0-4]"],
    "use_a_hybrid": [
        r"5 N more load +5\.0 +(4\.[5-9]|5\.[0-4])",
        r"4 N s/m more friction +5\.0 +(4\.[2-9]|5\.[0-4])",
        r"known physics +\d\d\d?\.\d+ +-?\d\d?\.",
        r"hybrid adapted +-?[0-3]\.\d+ +-?0\.",
    ],
    "uncertain_parameters": [r"mu_1 = 0\.\d+ is identified", r"sigma_1 = 0\.\d+ is identified"],
}


def cells(path: Path) -> list[nbformat.NotebookNode]:
    return list(nbformat.read(path, as_version=4).cells)


def outputs(path: Path, folder: Path) -> str:
    """All texts that the cells show, when they are run in a folder."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "\n".join(one.get("text", "") or one.get("data", {}).get("text/plain", "") for one in shown)


def test_every_notebook_is_checked_and_listed() -> None:
    names = {path.stem for path in FOLDER.glob("*.ipynb")}
    assert names == set(SHOWN)
    assert all(f"({name}.ipynb)" in (FOLDER / "README.md").read_text() for name in names)


@pytest.mark.parametrize("name", SHOWN)
def test_it_is_stored_without_outputs_and_explains_its_cells(name: str) -> None:
    kinds = [cell.cell_type for cell in cells(FOLDER / f"{name}.ipynb")]
    assert all(not cell.get("outputs") for cell in cells(FOLDER / f"{name}.ipynb"))
    assert kinds[0] == "markdown" and kinds.count("markdown") >= kinds.count("code") / 2
    assert "code code code" not in " ".join(kinds)


@pytest.mark.long
@pytest.mark.parametrize("name", SHOWN)
def test_it_runs_and_shows_what_it_says(name: str, tmp_path: Path) -> None:
    said = outputs(FOLDER / f"{name}.ipynb", tmp_path)
    for pattern in SHOWN[name]:
        assert re.search(pattern, said), pattern
    assert not list(tmp_path.iterdir())
