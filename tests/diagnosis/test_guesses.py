"""A guessed number that logs cannot check: what is known in proportion to it only."""

from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from unmodelled.base.errors import BadInput
from unmodelled.base.sure_numbers import main_number, remark
from unmodelled.diagnosis.answer.guesses import over_guesses, proportions, resting_on_guesses
from unmodelled.diagnosis.answer.said_numbers import shown_number
from unmodelled.diagnosis.answer.sentences import numbers_of
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.effects.coulomb_friction import CoulombFriction
from unmodelled.effects.scales import Scales
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system

PISTON = """schema: system/1
name: press
states: {x: {unit: m}, v: {unit: m/s}}
inputs: {p: {unit: bar}}
outputs: {x: {unit: mm}, v: {unit: m/s}}
parameters:
  A: {value: 2.0e-3, unit: m^2, guess: true}
  m: {value: 40.0, unit: kg, identify: true}
  d: {value: 900.0, unit: N s/m, identify: true}
  F_c: {value: 60.0, unit: N, identify: true}
ports: {ram: {effort: F, unit: N, position: x, velocity: v, law: F_c*sign(v)}}
dynamics: {x: v, v: (A*p - d*v - F)/m}
"""


def press(folder: Path, *changes: tuple[str, str]) -> tuple[System, Logs]:
    """A press whose piston nobody measured, with logs that move it both ways."""
    text = PISTON
    for old, new in changes:
        text = text.replace(old, new)
    (folder / "press.yaml").write_text(text)
    system, t = read_system(folder / "press.yaml"), 0.01 * np.arange(200)
    log = {"t": t, "p": 3.0 * np.sin(7.0 * t), "x": 40.0 * np.cos(5.0 * t), "v": -0.2 * np.sin(5.0 * t)}
    frames, table = {"a": pd.DataFrame(log)}, pd.DataFrame({}, index=["a"])
    return system, prepare(system, Logs.from_frames(frames, system, table))


def found_in(system: System, logs: Logs) -> Diagnosis:
    """An answer that names friction F_c."""
    values = {p.name: SimpleNamespace(value=p.value) for p in system.parameters if p.identify}
    found = SimpleNamespace(
        augmented=SimpleNamespace(system=system, logs=logs),
        effects=[SimpleNamespace(estimates={"F_c": values.pop("F_c")})],
        parameters=values,
    )
    return cast(Diagnosis, cast(Any, found))


def notes_of(system: System, logs: Logs) -> list[str]:
    return [*resting_on_guesses(found_in(system, logs))]


def test_an_effect_is_said_over_the_guess(tmp_path: Path) -> None:
    """In the title, in the text and in the tables alike: all take what is shown of a number."""
    system, logs = press(tmp_path)
    over = over_guesses(found_in(system, logs))
    assert set(over) == {"F_c", "m", "d"}
    scales = Scales.measured(system, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
    law = CoulombFriction()
    added = law.add(system, law.places(system)[0], scales)
    (name,) = (each for each in added.units if each.startswith("F_c"))
    entry = {"value": 60.0, "interval": [58.0, 62.0], "unit": "N", "determined": True}
    entry |= shown_number(added, name, entry, over["F_c"])
    symbol = f"{name}/A"
    assert entry["shown"] == {
        **{"symbol": symbol, "words": "in N only once A is known", "value": pytest.approx(3e4), "unit": "Pa"},
        "interval": pytest.approx([2.9e4, 3.1e4]),
    }
    effect = {"family": "coulomb_friction", "port": "ram", "parameters": {name: entry}}
    said = "(95 % interval 29000 to 31000), in N only once A is known"
    assert [*numbers_of(effect)] == [f"{symbol} = 30000 Pa {said}"]
    assert main_number(effect) == {**entry, **entry["shown"]}
    assert remark({"remarks": ["guess"]}) == "in proportion to a guess of the system file"


def test_numbers_in_proportion_to_a_guess_are_told_over_it(tmp_path: Path) -> None:
    (note,) = notes_of(*press(tmp_path))
    assert note == (
        "A = 0.002 m^2 is a guess of the system file that these logs cannot check. Known without it: "
        "F_c/A = 3e+04 Pa, m/A = 2e+04 kg/m^2 and d/A = 4.5e+05 Pa s/m; the numbers themselves only once A "
        "is measured"
    )


def test_a_number_that_does_not_go_with_the_guess_is_not_told(tmp_path: Path) -> None:
    """A rate of d over m, and a coefficient over the square of a guess."""
    system, logs = press(
        tmp_path,
        ("d*v - F)/m", "F)/m - d*v"),
        ("{value: 900.0, unit: N s/m,", "{value: 20.0, unit: 1/s,"),
        ("A*p", "A**2*p"),
        ("unit: m^2, guess", "unit: m, guess"),
    )
    found = proportions(system, logs, system.parameters[0], ["m", "d", "F_c"])
    assert found == {"m": Fraction(2), "d": Fraction(0), "F_c": Fraction(2)}
    assert "F_c/A^(2) = 1.5e+07 Pa" in notes_of(system, logs)[0] and "d/A" not in notes_of(system, logs)[0]


def test_a_guess_beside_a_known_mass_can_be_fitted(tmp_path: Path) -> None:
    (note,) = notes_of(*press(tmp_path, ("kg, identify: true", "kg")))
    assert note.endswith("and was held: mark it identify: true to fit it, or measure it")


def test_a_guess_is_read_and_written(tmp_path: Path) -> None:
    system, _ = press(tmp_path)
    write_system(system, tmp_path / "copy.yaml")
    assert [p.name for p in read_system(tmp_path / "copy.yaml").parameters if p.guess] == ["A"]
    with pytest.raises(BadInput, match=r"parameters\.A\.guess: must be true or false, got 'perhaps'"):
        press(tmp_path, ("guess: true", "guess: perhaps"))
