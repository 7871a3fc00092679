"""Laws that a measurement chain could hide or stand in for, from logs to the page."""

import pytest

from tests.stages.planted_law import Diagnosed, check_law, laws
from tests.stages.planted_law import diagnosed as diagnosed
from unmodelled.base.files import read_json

#: Behind a lag an input drives no speed, and is used; deviations of experiments may have a mean.
NAMES = ("input_dependence load", "actuator_gain")
LONG = ("actuator_saturation constant_power", "scatter")


@pytest.mark.parametrize("name", [*NAMES, *(pytest.param(n, marks=pytest.mark.long) for n in LONG)])
def test_a_law_that_a_chain_could_hide_is_named(name: str, diagnosed: Diagnosed) -> None:
    check_law(name, diagnosed)
    law, effects = laws()[name], read_json(diagnosed(name) / "out" / "diagnosis.json")["effects"]
    assert [(e["family"], e.get("variant", "")) for e in effects] == [(law.family, law.variant)]
