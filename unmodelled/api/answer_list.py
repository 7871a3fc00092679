"""The answers of all diagnoses below a folder, as a user meets them: a table and a page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from unmodelled.base.errors import printable
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import check_writable
from unmodelled.report.answers import ListedAnswer, find_answers, table_lines
from unmodelled.report.answers_page import write_answers_page
from unmodelled.report.diagnosis_page import PAGE


@dataclass(frozen=True, eq=False, repr=False)
class AnswerList:
    """The answers below a folder; made by `list_answers`.

    Attributes:
        folder: folder of the answers.
        answers: answers in alphabetical order of their folders.
        notes: a sentence for every diagnosis.json that is no answer.
    """

    folder: Path
    answers: tuple[ListedAnswer, ...]
    notes: tuple[str, ...]

    def table(self) -> pd.DataFrame:
        """Return a row per answer.

        Columns: answer (folder), system, verdict, confidence (0 to 1), effects (in words), place, known and
        augmented (gaps of experiments left out, standard deviations of the outputs; nan where nothing was
        fitted), written (UTC, time of the file).
        """
        rows = [
            {
                "answer": one.name,
                "system": one.system,
                "verdict": one.verdict,
                "confidence": one.confidence,
                "effects": ", ".join(name for name, _ in one.effects),
                "place": one.place,
                "known": one.before.gap,
                "augmented": one.after.gap if one.after else float("nan"),
                "written": one.written,
            }
            for one in self.answers
        ]
        return pd.DataFrame(rows)

    def save(self, folder: Path | str | None = None) -> Path:
        """Write the page index.html, on which the answers can be filtered, sorted and compared.

        Args:
            folder: folder of the page; default: the folder of the answers.

        Returns:
            Path of the page.

        Raises:
            BadInput: when the folder has an index.html that is no earlier list, or cannot be written.
        """
        out = self.folder if folder is None else Path(folder)
        check_writable(out)
        write_answers_page(self.answers, self.notes, printable(self.folder.resolve().name), out)
        return out / PAGE

    def __repr__(self) -> str:
        return "\n".join([*table_lines(self.answers), *(f"note: {note}" for note in self.notes)])

    def _repr_html_(self) -> str:
        return shown(f"Answers in {printable(str(self.folder))}", self.notes, {"Answers": self.table()})


def list_answers(folder: Path | str) -> AnswerList:
    """List the answers of all diagnoses below a folder.

    Args:
        folder: folder that is searched for folders that `unmodelled diagnose` or `Answer.save` wrote.

    Returns:
        The answers, with notes on damaged ones.

    Raises:
        BadInput: when the folder cannot be read or holds no answer.

    Examples:
        >>> import tempfile, unmodelled as um
        >>> folder = Path(tempfile.mkdtemp())
        >>> um.diagnose(*um.example("pendulum")).save(folder / "monday", pages=False)
        ()
        >>> found = um.list_answers(folder)
        >>> found.table()[["answer", "verdict", "effects"]].iloc[0].tolist()
        ['monday', 'effect', 'Coulomb friction at joint']
        >>> found.save().name
        'index.html'
    """
    answers, notes = find_answers(Path(folder))
    return AnswerList(Path(folder), tuple(answers), tuple(notes))
