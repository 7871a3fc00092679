"""Run forms of the diagnosis on the same cases, and compare them: see CONTRIBUTING.md.

    python -m benchmarks.search_bench cases=withheld:SEED:COUNT out=FOLDER form=old:PATH form=new:PATH,WORD
    python -m benchmarks.search_bench compare old new out=FOLDER

Words: cases (withheld:SEED:COUNT, number:SEED:COUNT with a wrong number in every file, real:FOLDER of
archives, field:FOLDER of inputs; can be given repeatedly),
form (NAME:CHECKOUT[,WORD...]; repeatedly), out, cap (CPU seconds per case, default 300), jobs (cases side by
side, default 1). A row that exists is not computed again.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.search_bench.case import Case, cases_of
from benchmarks.search_bench.compare import page
from benchmarks.search_bench.form import Form
from benchmarks.search_bench.row import add_row, read_rows, row
from unmodelled.base.errors import BadInput

SEVERAL, SINGLE = ("cases", "form"), {"out": "", "cap": "300", "jobs": "1"}


def rows_of(out: Path, name: str) -> Path:
    """Return the path of the rows of a form.

    Args:
        out: folder of the bench.
        name: name of the form.
    """
    return out / f"rows_{name}.jsonl"


def run(cases: Sequence[Case], forms: Sequence[Form], out: Path, cap: float = 300.0, jobs: int = 1) -> None:
    """Add the missing rows of all forms, case after case; every row is written as its case ends.

    Args:
        cases: cases.
        forms: forms of the diagnosis.
        out: folder of rows, answers and cases.
        cap: CPU seconds after which a case counts as unanswered.
        jobs: number of cases that run side by side.
    """
    done = {form.name: read_rows(rows_of(out, form.name)) for form in forms}
    left = [(case, form) for case in cases for form in forms if case.name not in done[form.name]]
    print(f"{len(left)} of {len(cases) * len(forms)} rows are missing", flush=True)
    making, writing, stopped = threading.Lock(), threading.Lock(), threading.Event()

    def add(case: Case, form: Form) -> None:
        if stopped.is_set():
            return
        try:
            with making:  # cases of one machine have the same logs
                case.make()
        except Exception as fault:  # of a published archive, for instance: it gets a row once it can be read
            print(f"{case.name}: its files cannot be made: {fault}", file=sys.stderr, flush=True)
            return
        made = row(case, form, out / "answers" / form.name, cap)
        with writing:
            add_row(rows_of(out, form.name), made)
        what = made["error"] or f"{made['said']}; truth {made['truth'][:60]}"
        print(f"{form.name} {case.name}: {made['cpu']:.0f} s, {what}", flush=True)

    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(add, case, form) for case, form in left]
        try:
            for future in futures:
                future.result()
        finally:  # an interruption, or a fault of the bench itself
            stopped.set()


def compare(names: Sequence[str], out: Path) -> str:
    """Write compare_<names>.md of one or two forms, and return its text.

    Args:
        names: names of the forms.
        out: folder of the bench.

    Raises:
        BadInput: when a form has no rows.
    """
    forms = {name: read_rows(rows_of(out, name)) for name in names}
    if missing := [name for name, rows in forms.items() if not rows]:
        raise BadInput(f"{rows_of(out, missing[0])}: holds no row; run this form first")
    text = page(forms)
    (out / f"compare_{'_'.join(names)}.md").write_text(text)
    return text


def main(words: Sequence[str]) -> None:
    """Do what the words say (see the top of this file).

    Args:
        words: words of the command line.

    Raises:
        BadInput: when a word cannot be used.
    """
    given: dict[str, list[str]] = {}
    for word in words:
        key, _, value = word.partition("=") if "=" in word else ("", "", word)
        given.setdefault(key, []).append(value)
    compared, plain = given.pop("", []), {key: given.pop(key, [value])[-1] for key, value in SINGLE.items()}
    if (unknown := set(given) - set(SEVERAL)) or not plain["out"]:
        raise BadInput(
            f"words: {', '.join(unknown) or 'out is missing'}; keys are {', '.join((*SEVERAL, *SINGLE))}"
        )
    out = Path(plain["out"]).resolve()
    names = compared[1:]
    if compared[:1] != ["compare"]:
        if compared or not given.get("form") or not given.get("cases"):
            raise BadInput("words: give cases=, form= and out=, or: compare NAME [NAME] out=")
        out.mkdir(parents=True, exist_ok=True)
        cases = [case for word in given["cases"] for case in cases_of(word, out / "cases")]
        forms = [Form.of(word) for word in given["form"]]
        run(cases, forms, out, float(plain["cap"]), int(plain["jobs"]))
        names = [form.name for form in forms]
    print(compare(names[:2], out))


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        main(sys.argv[1:])
    except (BadInput, KeyboardInterrupt) as ended:
        sys.exit(str(ended) or "interrupted; the same command goes on")
