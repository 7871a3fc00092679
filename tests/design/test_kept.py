"""No machine that an answer allows leaves its travel under a proposed experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tests.machines.folders import Array, changed, logs_of, motion, system_of, text_of
from unmodelled.design.criterion import Criterion
from unmodelled.design.design import best_experiment
from unmodelled.design.limits import read_limits
from unmodelled.design.rivals import Known, Rival
from unmodelled.design.written import write_experiment
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.effects.coulomb_friction import CoulombFriction
from unmodelled.effects.place import Place

Numbers = Mapping[str, Any]
PENDULUM = text_of("pendulum.yaml")
AXIS = changed(PENDULUM, ("bounds: [0.2, 5]", "bounds: [0, 5]"), ("mgl: {value: 0.9", "mgl: {value: 0.0"))
GEAR = changed(
    AXIS, ("theta: {unit: rad}\nparameters", "theta: {unit: deg, expression: 2*theta}\nparameters")
)
SPRING = changed(PENDULUM, ("mgl*sin(theta)", "mgl*theta"))
HEATER = changed(
    text_of("heater.yaml"),
    ("outputs: {T: {unit: K}}", "outputs: {T: {unit: degC}}"),
    ("(power - G*T)", "(power - G*(T - 290))"),
)


def turned(x: Array, torque: float, n: Numbers, pull: Callable[[Array], Array]) -> list[Array]:
    friction = n["F_c"] * np.tanh(x[1] / 1e-3)
    return [x[1], (torque - n["b"] * x[1] - n["mgl"] * pull(x[0]) - friction) / 0.02]


@dataclass(frozen=True)
class Kind:
    """A kind of machine: what its file says, what it does, and how its numbers are drawn."""

    text: str
    port: str  # "" without friction
    limits: str
    rates: Callable[[Array, Any, Numbers], Sequence[Array]]
    values: Callable[[np.random.Generator], dict[str, float]]
    shown: Callable[[Array], Array]  # first output, in the unit of its column
    start: tuple[float, ...] = (0.0, 0.0)
    period: float = 0.01
    force: float = 1.0


def of_axis(rng: np.random.Generator) -> dict[str, float]:
    return {"b": rng.uniform(0.01, 0.05), "mgl": 0.0, "F_c": rng.uniform(0.1, 0.2)}


def of_pendulum(rng: np.random.Generator) -> dict[str, float]:
    return of_axis(rng) | {"mgl": rng.uniform(0.5, 1.5)}


ROTARY = (
    "duration: 3\ninputs: {torque: {low: -0.8, high: 0.8, rate: 5}}\ntravel: {theta: {low: %g, high: %g}}\n"
)
KINDS = {
    "axis": Kind(
        *(AXIS, "joint", ROTARY % (-1.5, 1.5), lambda x, u, n: turned(x, u, n, np.zeros_like)),
        *(of_axis, lambda x: x),
    ),
    "gear": Kind(
        *(GEAR, "joint", ROTARY % (-40, 40), lambda x, u, n: turned(x, u, n, np.zeros_like)),
        *(of_axis, lambda x: np.rad2deg(2.0 * x)),
    ),
    "pendulum": Kind(
        *(PENDULUM, "joint", ROTARY % (-0.6, 0.8), lambda x, u, n: turned(x, u, n, np.sin)),
        *(of_pendulum, lambda x: x),
    ),
    "spring": Kind(
        *(SPRING, "joint", ROTARY % (-0.5, 0.5), lambda x, u, n: turned(x, u, n, np.array)),
        *(of_pendulum, lambda x: x),
    ),
    "heater": Kind(
        HEATER,
        "",
        "duration: 60\ninputs: {power: {low: 0, high: 200, rate: 50}}\n"
        "travel: {T: {high: 60}}\nstart: {T: 20}\n",
        lambda x, u, n: [(u - n["G"] * (x[0] - 290.0)) / n["C"]],
        lambda rng: {"C": rng.uniform(15.0, 30.0), "G": rng.uniform(1.0, 4.0)},
        lambda x: x - 273.15,
        start=(293.15,),
        period=0.5,
        force=100.0,
    ),
}


def planted(kind: Kind, folder: Path, rng: np.random.Generator) -> tuple[Criterion, dict[str, Known]]:
    """Models of a machine, with intervals of its numbers as an answer has them."""
    values = kind.values(rng)
    system = system_of(
        changed(kind.text, ("C: {value: 20.0, unit: J/K}", "C: {value: 20.0, unit: J/K, identify: true}"))
        if not kind.port
        else kind.text,
        folder,
    )
    (folder / "limits.yaml").write_text(kind.limits)
    t, tables = kind.period * np.arange(80), []
    item, output = system.inputs[0], system.outputs[0]
    for k in range(4):
        u = kind.force * np.sin((1.0 + k) * t / t[-1] * 6.0)
        y = motion(lambda x, u: kind.rates(x, u, values), kind.start, u, kind.period)
        shown = kind.shown(y[:, 0])
        tables.append({"t": t, item.column: u, output.column: shown + 1e-4 * rng.standard_normal(80)})
    logs = logs_of(system, folder / "logs", tables)
    hypothesis = Hypothesis.known(Study.of(system, logs, 20 * kind.period, 0))
    if kind.port:
        hypothesis = hypothesis.plus(CoulombFriction(), Place("port", kind.port))
    share = rng.uniform(0.02, 0.1)
    known = {n: Known(v, v * (1.0 - share), v * (1.0 + share)) for n, v in values.items()}
    names = [unknown.name for unknown in hypothesis.unknowns]
    values |= {name: grid[0] for effect in hypothesis.effects for name, grid in effect.shapes.items()}
    doubts = [known[n].doubt if n in known else 1e-5 for n in names]
    fit = SimpleNamespace(
        values={n: values.get(n, 0.0) for n in names},
        own={},
        names=tuple(names),
        covariance=np.diag(np.square(doubts)),
        substeps=4,
    )
    fitted = FittedHypothesis(hypothesis, cast(Any, None), cast(Any, fit))
    limits = read_limits(folder / "limits.yaml", system, logs)
    rival = Rival("named", fitted, known)
    counted = [n for n in names if n in known and values[n]]
    noise, spread = np.array([1e-4 * output.as_written.factor]), np.zeros(1)
    return Criterion([rival], limits, noise, spread, counted), known


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.long) for k in range(1, 4))])
@pytest.mark.parametrize("name", KINDS)
def test_no_machine_that_the_answer_allows_leaves_its_travel(
    name: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for budget, small in {"GENERATIONS": 3, "REFINED": 3, "POPULATION": 16}.items():
        monkeypatch.setattr(f"unmodelled.design.design.{budget}", small)
    kind, rng = KINDS[name], np.random.default_rng([seed, *name.encode()])
    criterion, known = planted(kind, tmp_path, rng)
    found = best_experiment(criterion, seed, lambda _: None)
    assert found.score > 0.0
    u, limits = found.u, criterion.limits
    own = limits.moves["T" if name == "heater" else "theta"]
    assert u[0, 0] == u[-1, 0] == limits.inputs[0].rest and np.ptp(u) > 0.0
    share = np.concatenate([rng.random((len(known), 30)), [[0.0, 1.0]] * len(known)], axis=1)
    ends = np.array([[each.low, each.high] for each in known.values()])
    drawn = ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])
    numbers = dict(zip(known, drawn, strict=True))
    start = np.tile(np.array(kind.start)[:, None], drawn.shape[1])
    y = kind.shown(motion(lambda x, f: kind.rates(x, f, numbers), start, u[:, 0], limits.period, 20)[:, 0])
    assert own.low <= y.min() and y.max() <= own.high, (y.min(), y.max())
    system = criterion.rivals[0].fitted.hypothesis.study.system
    write_experiment(u, system, limits, tmp_path / "experiment.csv", criterion.runs)


def test_a_torque_just_above_breakaway_is_judged_by_the_ends_of_the_interval(tmp_path: Path) -> None:
    """The fitted friction keeps the travel, the lower end of its interval leaves it, the upper end creeps."""
    kind = replace(
        KINDS["axis"],
        limits=ROTARY % (-0.58, 0.58),
        values=lambda _: {"b": 0.03, "mgl": 0.0, "F_c": 0.15},
    )
    criterion, _ = planted(kind, tmp_path, np.random.default_rng(0))
    (named,), limits = criterion.rivals, criterion.limits
    u = np.full((limits.samples, 1), 0.153)
    u[[0, -1]] = 0.0
    fitted = named.runs(u[None], limits, named.sets[0][:1])
    assert limits.excess(fitted.watched[:, 0], fitted.step) == 0.0
    found, row = criterion.promise(u), list(named.values).index("F_c")
    assert criterion(u[None]).excess > 0.0 and found.excess.max() > 0.0 and criterion.worth(u) < -1.0
    assert found.after[:, row].max() > 10.0 * found.after[:, row].min()


def test_an_end_that_the_answer_leaves_open_is_as_far_as_the_bounds(tmp_path: Path) -> None:
    criterion, known = planted(KINDS["pendulum"], tmp_path, np.random.default_rng(0))
    (named,) = criterion.rivals
    for ends in ((np.nan, 0.09), (0.001, np.nan)):
        one = replace(named, known={**known, "b": Known(0.03, *ends)})
        low, high = one.intervals[[*one.values].index("b")]
        assert (low, high) == tuple(np.where(np.isfinite(ends), ends, (0.0, 0.1)))
