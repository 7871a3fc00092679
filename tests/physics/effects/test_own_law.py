"""Laws of a user: formulas, units, places, files, packages."""

import json
import time
from contextlib import nullcontext
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import unmodelled as um
from tests.machines.folders import changed
from tests.machines.known import refusals
from tests.physics.effects.benches import scales, system
from unmodelled import BadInput, Law
from unmodelled.base import additions
from unmodelled.effects import library
from unmodelled.effects.law_files import given_laws, read_laws

DRAG = {"c": {"unit": "N m s^2/rad^2", "plausible": 0.01, "low": 0}}
GRIP: dict[str, dict[str, Any]] = {"F": {"unit": "mN m", "plausible": 50.0, "low": 0}}
GRIP["v_s"] = {"unit": "rad/s", "plausible": 0.3, "like": "v"}
FILE = """schema: laws/1
laws:
  grip:
    formula: F*tanh(v/v_s)
    numbers:
      F: {unit: mN m, plausible: 50, low: 0}
      v_s: {unit: rad/s, plausible: 0.3, like: v}
    only: [joint]
"""
#: What a package would name in its entry point.
DRAGGING = Law("of_a_package", "c*v*abs(v)", DRAG)


def test_a_law_has_the_numbers_of_its_definition_in_si() -> None:
    law = Law("grip", "F*tanh(v/v_s)", GRIP)
    known, sizes = system("pendulum"), scales("pendulum")
    (place,) = law.places(known)
    added = law.add(known, place, sizes)
    assert law.check(known, sizes) == ("joint",)
    assert added.law == "F*tanh(omega/v_s)" and added.units == {"F": "N m", "v_s": "rad/s"}
    assert added.bounds == {"F": (0.0, 50.0), "v_s": (3e-4, 300.0)} and added.scales["F"] == 0.05
    assert added.shapes["v_s"] == pytest.approx((0.1, 0.3, 0.9))
    assert Law(**law.definition) == law


def test_dry_friction_of_a_formula_passes_its_corner_as_that_of_the_library() -> None:
    numbers = {"F": {"unit": "N m", "plausible": 0.1}, "k": {"unit": "1", "plausible": 1.0, "like": "1"}}
    law = Law("rub", "F*sign(v)*(1 + k*x**2)", numbers)
    known = system("pendulum")
    added = law.add(known, law.places(known)[0], scales("pendulum"))
    assert "sign(omega)" in added.law and "tanh(omega/v_c)" in added.system.text["ports.joint.law"]


@pytest.mark.parametrize(
    ("at", "formula", "numbers", "channel"),
    [
        ("actuator", "u*(1 + g*t)", {"g": {"unit": "1/s", "plausible": 0.01}}, "actuator:torque"),
        ("sensor", "y + e*y**3", {"e": {"unit": "1/rad^2", "plausible": 0.01}}, "sensor:theta"),
        ("parameter", "p + d*sin(t)", {"d": {"unit": "kg m^2", "plausible": 0.01}}, "parameter:J"),
    ],
)
def test_a_law_may_act_at_every_kind_of_place(at: Any, formula: str, numbers: Any, channel: str) -> None:
    law = Law("mine", formula, numbers, at, only=(channel.split(":")[1],))
    assert law.check(system("pendulum"), scales("pendulum")) == (channel,)


@pytest.mark.parametrize(
    ("formula", "numbers", "said"),
    [
        ("c*q", DRAG, "unknown symbol 'q', must be one of x, v, l, c, t, pi"),
        ("c*v + 1", DRAG, "formula: must be 0 where c = 0, not 1; give `like`"),
        ("c**2*v", DRAG, "formula: must be linear in c"),
        ("c*v", {"c": {"unit": "Nn", "plausible": 1.0}}, "numbers.c: unknown unit 'Nn'"),
        ("c*v", {"c": {"unit": "N", "plausible": -1.0}}, "numbers.c: plausible must be positive"),
        ("c*v", {"c": {"unit": "N"}}, "numbers.c: plausible is missing"),
        ("c*v", {"c": {"unit": "N", "plausible": 1.0, "size": 2}}, "numbers.c: unknown key 'size', must be"),
        ("v*v", {"v": {"unit": "N", "plausible": 1.0}}, "numbers.v: is no name of a number"),
        ("v", {}, "numbers: needs one without `like`"),
    ],
)
def test_a_law_that_cannot_be_used_is_one_line(formula: str, numbers: Any, said: str) -> None:
    (told,) = refusals(lambda: Law("mine", formula, numbers))
    assert told.startswith("law mine: ") and said in told and "\n" not in told


@pytest.mark.parametrize(
    ("rest", "zero"),
    [
        (" * ".join(f"cos({k}*v + {k})" for k in range(1, 60)), False),
        (" * ".join(f"(x + {k}*v + 1)" for k in range(1, 200)), False),
        ("max(x - 100, 0)", False),
        ("abs(v) - v", False),
        ("1e-8*x**2", False),
        ("sqrt(-1 - x**2)", False),
        ("(sin(x)**2 + cos(x)**2 - 1)*v", True),
        ("v*(x + 1)**2 - v*x**2 - 2*v*x - v", True),
        ("sinh(x) - tanh(x)*cosh(x)", True),
    ],
)
def test_whether_a_formula_vanishes_is_found_in_no_time(rest: str, zero: bool) -> None:
    """The rest of a formula at size zero, by its values: to simplify the first one takes hours."""
    began = time.process_time()
    with nullcontext() if zero else pytest.raises(BadInput, match="formula: must be 0 where c = 0"):
        Law("mine", f"c*v*abs(v) + {rest}", DRAG)
    assert time.process_time() - began < 5.0


#: What an argument of a law is not, and what it may be of another type.
ODD: tuple[Any, ...] = (
    *(None, 3, float("inf"), float("-inf"), float("nan"), True, 10**400, object(), b"c", "joint", "\x1b"),
    *([], {}, [None], (1,), {1: 2}, np.float32(0.5), np.int64(2)),
)


@pytest.mark.parametrize("key", ["name", "formula", "numbers", "at", "only"])
def test_an_odd_argument_of_a_law_is_one_line(key: str) -> None:
    known = {"name": "grip", "formula": "F*tanh(v/v_s)", "numbers": GRIP, "at": "port", "only": ("joint",)}
    for odd in ODD:
        if (key, repr(odd)) not in [("name", "'joint'"), ("only", "[]")]:
            (told,) = refusals(lambda odd=odd: Law(**known | {key: odd}))  # type: ignore[misc]
            assert told.startswith("law ") and told.isprintable()


@pytest.mark.parametrize("key", ["", "unit", "plausible", "low", "high", "like"])
def test_an_odd_number_of_a_law_is_one_line_or_a_number(key: str) -> None:
    number = {"unit": "N m", "plausible": 0.1, "low": 0.0, "high": 10.0}
    for odd in ODD:
        try:
            law = Law("grip", "F*tanh(v)", {"F": {**number, key: odd} if key else odd})
        except BadInput as fault:
            assert str(fault).startswith("law grip: ") and not fault.others
        else:
            assert np.isfinite(law.numbers["F"].bounds).all() and json.dumps(law.definition)


def test_units_and_places_are_those_of_the_machine() -> None:
    known, sizes = system("pendulum"), scales("pendulum")
    with pytest.raises(BadInput, match="law mine: c: at joint it must be in N m s/rad, not N"):
        Law("mine", "c*v", {"c": {"unit": "N", "plausible": 1.0}}).check(known, sizes)
    words = "only: 'jiont' is no port with all that it needs; did you mean 'joint'"
    with pytest.raises(BadInput, match=words):
        Law("mine", "c*v*abs(v)", DRAG, only=("jiont",)).check(known, sizes)
    still = replace(known, ports=(replace(known.ports[0], velocity=None),))
    assert Law("mine", "c*v*abs(v)", DRAG).places(still) == ()
    with pytest.raises(BadInput, match="law mine: pendulum has no port with all that its formula needs"):
        um.check_law(Law("mine", "c*v*abs(v)", DRAG), still, um.example("pendulum")[1])


def test_laws_are_read_from_a_file_with_line_numbers(tmp_path: Path) -> None:
    (file := tmp_path / "laws.yaml").write_text(FILE)
    (law,) = read_laws(file)
    assert law == Law("grip", "F*tanh(v/v_s)", GRIP, only=("joint",)) and given_laws(file) == (law,)
    for old, new, said in [
        ("laws/1", "laws/2", "line 1: schema: must be laws/1"),
        ("formula: F", "formula: G", "line 3: laws.grip: law grip: formula: unknown symbol 'G'"),
        ("plausible: 50", "plausible: much", "line 6: laws.grip.numbers.F.plausible: must be a number"),
        ("only", "once", "line 8: laws.grip.once: unknown key 'once'"),
    ]:
        file.write_text(changed(FILE, (old, new)))
        told = refusals(lambda: read_laws(file))[0]
        assert str(file) in told and said in told


def test_a_name_that_is_taken_is_refused() -> None:
    with pytest.raises(BadInput, match="law backlash: the name is taken"):
        given_laws([Law("backlash", "c*v*abs(v)", DRAG)])
    with pytest.raises(BadInput, match="law mine: the name is taken"):
        given_laws([Law("mine", "c*v*abs(v)", DRAG)] * 2)


def test_a_package_adds_laws_by_an_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("drag", f"{__name__}:DRAGGING", library.GROUP)
    broken = EntryPoint("none", f"{__name__}:NONE", library.GROUP)
    library.effects.cache_clear()
    try:
        monkeypatch.setattr(additions, "entry_points", lambda group: [point] * (group == library.GROUP))
        assert DRAGGING in library.effects()
        # whoever wrote it checks it, too; given again, it is tried once
        assert given_laws([DRAGGING]) == () and um.check_law(DRAGGING, *um.example("pendulum")) == ("joint",)
        library.effects.cache_clear()
        monkeypatch.setattr(additions, "entry_points", lambda group: [broken])
        with pytest.raises(BadInput, match=r"law none .* cannot be loaded .*repair its package"):
            library.effects()
    finally:
        library.effects.cache_clear()
