"""List the answers of all diagnoses below a folder in one page."""

from __future__ import annotations

from pathlib import Path

from unmodelled.base.ownership import Out, verb


@verb(Out.SHARED, inside=["answers"])
def report(answers: Path, out: Path | None) -> None:
    """Write index.html, a page on which answers can be filtered, sorted and compared, and print the list.

    Every folder below `answers` that `diagnose` wrote is a row, with verdict, missing effects and their
    amounts, place, errors before and after, residuals, and a link to its page. Two ticked answers stand side
    by side; numbers whose 95 % intervals do not overlap are marked. A damaged answer is a note.
    `report <folder>` is short for `report answers=<folder>`.

    Args:
        answers: folder that is searched for answers.
        out: folder of index.html; null: the folder of the answers.

    Raises:
        BadInput: when there is no answer, or index.html exists and is no earlier list.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.answer_list import list_answers

    found = list_answers(answers)
    page = found.save(out)
    print(found)
    print(f"open {page}")
