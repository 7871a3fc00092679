"""Numbers, units and tables as people read them, and all digits beside them."""

from typing import Any

import pytest

from pipeline.report.claims import claims_table
from pipeline.report.numbers import duration, percentage
from tests.report.case import claim
from unmodelled.report.numbers import number, quantity, unit_text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (float("nan"), "–"),
        (754, "754"),
        (12345, "12\u202f345"),
        (-0.123456, "−0.1235"),
        (1.234e-7, "1.23×10⁻⁷"),
        (98765.4, "98\u202f765"),
        (0.0, "0"),
        (2e9, "2×10⁹"),
        ("H2 < H1", "H2 < H1"),
    ],
)
def test_numbers_have_sensible_digits(value: Any, text: str) -> None:
    assert number(value) == text


def test_units_shares_and_durations_are_readable() -> None:
    assert [unit_text(unit) for unit in ("(rad/s)^2", "m^-1", "-", None)] == ["(rad/s)²", "m⁻¹", "", ""]
    assert percentage("share") == (True, "") and percentage("lower, share") == (True, "lower")
    assert percentage("higher, share (median)") == (True, "higher (median)")
    assert percentage("share of the sum") == (False, "share of the sum")
    assert [duration(s) for s in (0.31, 59.94, 59.97, 200, 3725)] == [
        *("0.3 s", "59.9 s", "1 min 0 s", "3 min 20 s", "1 h 2 min"),
    ]


def test_an_interval_sets_the_digits() -> None:
    assert quantity(0.251234, [0.2312, 0.2799]) == ("0.251", "0.231 to 0.280")
    assert quantity(-41.23, [-48.3, -35.1]) == ("−41", "−48 to −35")
    assert quantity(3.0, [3.0, 3.0]) == ("3", "3 to 3")
    assert quantity(None, None) == ("–", "")
    # 0 would say that there is none
    assert quantity(0.3232, [0.0845, 20.31]) == ("0.32", "0.085 to 20")
    assert quantity(0.002, [-3.0, 3.0]) == ("0.0", "−3.0 to 3.0")


def test_claims_are_saved_as_they_were_made() -> None:
    lower = claim(ours=0.5833, interval=[0.568, 0.609], unit="lower, share", dissertation=0.42)
    table = claims_table("claims", [lower, claim(ours="a 1, b 2, c 3", interval=None, unit="mm^2")])
    (theirs, ours), several = (table.rows[0][i] for i in (2, 3)), table.rows[1][3]
    assert (theirs.text, ours.text) == ("42\u202f%", "58.3\u202f%")
    assert ours.note == "lower, 95 %: 56.8 to 60.9\u202f%" and ours.badge == "virtual"
    assert (several.text, several.note) == ("a 1\nb 2\nc 3", "mm²")
    heading, first = table.csv.splitlines()[:2]
    assert heading.startswith("id,chapter,page,claim,dissertation,ours,interval,unit")
    assert '0.42,0.5833,0.568 to 0.609,"lower, share"' in first
