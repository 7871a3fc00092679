"""The register machine in a browser computes what the compiled one computes, for every system."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page

from tests.physics.kernel.random_systems import random_structure
from unmodelled.base.errors import BadInput
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.javascript import as_data, as_text
from unmodelled.engine.machine.opcodes import Op
from unmodelled.engine.machine.program import Program
from unmodelled.report.rendering import STATIC
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

Array = NDArray[np.float64]

ROOT = Path(__file__).parents[2] / "systems"
#: System files; some files of this folder are no systems.
FILES = [path for path in sorted(ROOT.glob("**/*.yaml")) if "schema: system/1" in path.read_text()]
SAMPLES, RANDOM = 120, 60

RUN = """([data, u, t, p, c, x0, how]) => {
  const [program, given] = [machine.loaded(data), u.map(machine.numbers)];
  const windows = { u: given, t: machine.numbers(t), start: 3, steps: t_length - 4 };
  const found = machine.simulate(program, windows, ...[p, c, x0].map(machine.numbers), how);
  return found.map((y) => [...y].map(String));
}"""
AT = """([data, ...given]) => {
  const [x, u, p, c] = given.map(machine.numbers);
  return machine.evaluate(machine.loaded(data), 0.3, x, u, p, c).map(String);
}"""


@pytest.fixture(scope="module")
def page(browser: Browser) -> Iterator[Page]:
    with browser.new_context() as context:
        opened = context.new_page()
        opened.add_script_tag(content=(STATIC / "machine.js").read_text())
        yield opened


def random_systems() -> Iterator[System]:
    for seed in range(RANDOM):
        try:
            yield random_structure(seed).system
        except BadInput:  # not every draw is a system
            continue


def drawn(system: System, seed: int) -> tuple[Array, Array, Array, Array]:
    """Inputs (samples, inputs), parameters, constants and states near those of the file."""
    draw = np.random.default_rng(seed).normal
    t = np.arange(SAMPLES)[:, None] / SAMPLES
    u = np.sin(7.0 * t + draw(size=len(system.u))) + 0.1 * draw(size=(SAMPLES, len(system.u)))
    p = np.array(system.values) * (1.0 + 0.05 * draw(size=len(system.p)))
    return u, p, 1.0 + 0.1 * draw(size=len(system.c)), 0.3 * draw(size=len(system.x))


def in_browser(page: Page, program: Program, given: tuple[Array, ...], t: Array, how: Integration) -> Array:
    u, p, c, x0 = given
    hold = list(how.hold) if isinstance(how.hold, tuple) else [how.hold] * u.shape[1]
    numbers = [as_text(t), *(as_text(values) for values in (p, c, x0))]
    settings = {"period": how.period, "substeps": how.substeps, "hold": hold}
    columns = [as_text(column) for column in u.T]
    script = RUN.replace("t_length", str(len(t)))
    found: Any = page.evaluate(script, [as_data(program), columns, *numbers, settings])
    return np.array(found, np.float64).T


def assert_equal(page: Page, system: System, seed: int) -> None:
    """Free runs are equal to 1e-9 of the largest value, as long as they stay finite."""
    program = Program.of(system, [*system.x, *(output.expression for output in system.outputs)])
    u, p, c, x0 = drawn(system, seed)
    hold = tuple(float((seed + k) % 2) for k in range(u.shape[1]))
    how = Integration(2e-4, "rk4", 1 + seed % 3, hold)
    t, one = how.period * np.arange(SAMPLES), np.ones(1, np.int64)
    windows = Windows(u, t, 3 * one, (SAMPLES - 4) * one, 0 * one, 0 * one)
    with np.errstate(all="ignore"):
        expected = free_run(program, windows, p[None, None], c[None], x0[None, None], how)[0, 0]
        found = in_browser(page, program, (u, p, c, x0), t, how)
    assert found.shape == expected.shape
    for measured, shown in zip(expected.T, found.T, strict=True):
        assert (np.isfinite(measured) == np.isfinite(shown)).all()
        seen = np.isfinite(measured)
        scale = np.abs(measured[seen]).max(initial=1e-3)
        assert (np.abs(measured - shown)[seen] <= 1e-9 * scale).all()


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_system_file_runs_as_in_python(path: Path, page: Page) -> None:
    assert_equal(page, read_system(path), len(path.stem))


@pytest.mark.long
def test_random_systems_run_as_in_python(page: Page) -> None:
    used: set[int] = set()
    for seed, system in enumerate(random_systems()):
        assert_equal(page, system, seed)
        used |= set(Program.of(system, system.x).code[:, 0].tolist())
    assert {Op(code) for code in used} == set(Op)


def test_values_at_one_state(page: Page) -> None:
    system = read_system(ROOT / "slider_crank.yaml")
    program = Program.of(system, system.dynamics)
    u, p, c, x0 = drawn(system, 5)
    expected = program.evaluate(np.array(0.3), x0, u[0], p, c)
    found = page.evaluate(AT, [as_data(program), *map(as_text, (x0, u[0], p, c))])
    np.testing.assert_allclose(np.array(found, np.float64), expected, rtol=1e-12)


@pytest.mark.long
def test_other_instructions_are_refused(page: Page) -> None:
    system = read_system(ROOT / "pendulum.yaml")
    program = Program.of(system, system.dynamics)
    code = program.code.copy()
    code[:, 0] = len(Op)
    given = map(as_text, ([0.1, 0.0], [0.0], system.values, []))
    with pytest.raises(Exception, match=f"no instruction {len(Op)}"):
        page.evaluate(AT, [as_data(program._replace(code=code)), *given])
