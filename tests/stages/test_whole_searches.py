"""From logs to the page with nothing left out: one law of every kind, and experiments with awkward names."""

from collections.abc import Iterator

import pytest

from tests.stages.planted_law import Diagnosed, check_answer, check_page, diagnosing, laws

#: No mathematics, no markup, no numbers: what users call their experiments is shown as it is.
IDS = (r"$\frac{$", "cold $x_1$ & <b>wet</b>", "Größe 3 – “β”", "a" * 90)
#: At a port without memory and with it, at an input with memory, at an output, of a parameter.
KINDS = ("coulomb_friction", "hysteresis dahl", "actuator_lag", "sensor_gain", "scatter")


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Diagnosed]:
    yield from diagnosing(tmp_path_factory.mktemp("laws"), alone=False, ids=IDS)


@pytest.mark.long
@pytest.mark.parametrize("name", KINDS)
def test_a_law_of_every_kind_is_found_among_all_others(name: str, diagnosed: Diagnosed) -> None:
    folder = diagnosed(name)
    content = check_answer(folder)
    (effect,) = content["effects"]
    assert laws()[name].family in {effect["family"], *(e["family"] for e in effect["indistinguishable"])}
    assert {row["id"] for row in content["where"]["experiments"]} == set(IDS)
    check_page(folder)
