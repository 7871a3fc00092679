"""A method of the head to head as an entrant: `-m benchmarks.withheld.entrants.method NAME system=...`."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import sympy as sp

from benchmarks.head_to_head.__main__ import method
from benchmarks.head_to_head.case import Case
from benchmarks.head_to_head.method import Model
from benchmarks.withheld.score import ANSWER
from unmodelled.base.files import write_json
from unmodelled.diagnosis.data.study import Study
from unmodelled.systems.writer import write_system

#: A method says nothing of how sure it is.
CONFIDENCE = 0.5
MODEL = "model.yaml"


def main(words: Sequence[str]) -> None:
    """Fit the method to the learned experiments of a case, and write what it names and its model."""
    name, *rest = words
    given = dict(word.partition("=")[::2] for word in rest)
    out = Path(given["out"])
    study = Case("", Path(given["system"]), Path(given["logs"])).study()
    model = method(name).fit(study)
    named = model.named or tuple(dict.fromkeys(_families(model, study)))
    effects = [{"family": family, "port": port} for family, port in named]
    verdict = "effect" if effects else "no_gap"
    out.mkdir(parents=True, exist_ok=True)
    write_system(model.system, out / MODEL)
    said = {"verdict": verdict, "confidence": CONFIDENCE, "effects": effects, "model": MODEL}
    write_json(out / ANSWER, said)


def _families(model: Model, study: Study) -> Iterator[tuple[str, str]]:
    """The families whose terms a law in closed form has, at its port."""
    for name, law in model.laws.items():
        port = study.system.port(name)
        for term in sp.Add.make_args(sp.expand(law)):
            on = {symbol.name for symbol in term.free_symbols}
            yield _family(term, port.velocity in on, port.position in on), name


def _family(term: sp.Expr, of_speed: bool, of_place: bool) -> str:
    """The family of a term, by the functions of position and speed in it."""
    if term.has(sp.tanh) or term.has(sp.sign):
        return "coulomb_friction"
    if of_speed:
        return "quadratic_drag" if term.has(sp.Abs) else "viscous_friction"
    if term.has(sp.sin) or term.has(sp.cos):
        return "gravity_load"
    if not of_place:
        return "constant_load"
    is_linear = term.is_polynomial() and sp.Poly(term).total_degree() == 1
    return "linear_spring" if is_linear else "nonlinear_spring"


if __name__ == "__main__":
    main(sys.argv[1:])
