"""Design of the next experiment from the answer of a diagnosis: a search over families of signals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.wording import effect_names
from unmodelled.design.checked import check_answer
from unmodelled.design.criterion import BestSensor, Criterion, Value, best_sensor
from unmodelled.design.limits import MARGIN, far_from_logs, read_limits
from unmodelled.design.rivals import Entry, Known, Rival, fitted_rival
from unmodelled.design.runs import Simulated
from unmodelled.design.signals import CHIRP, FAMILIES, Family, reference_points, references
from unmodelled.design.written import rest_notes
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.faults.duplicates import different
from unmodelled.diagnosis.faults.look import without_copies
from unmodelled.diagnosis.judge.known_physics import known_physics
from unmodelled.effects.ports_between import with_named_ports
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import several
from unmodelled.systems.model import System

#: Members of a population, generations in every family, and further ones around the best experiment, which
#: are first drawn within `NEAR` of it: a budget of time.
POPULATION, GENERATIONS, REFINED, NEAR = 32, 16, 30, 0.05


@dataclass(frozen=True, eq=False)
class Design:
    """The next experiment, with what every model predicts for it."""

    system: System
    criterion: Criterion
    found: Found
    seed: int
    #: The chirp and the random experiment of the same length, with the largest amplitude at which all models
    #: stay within the limits, at all draws of their numbers; None where none does.
    references: Mapping[str, Array | None]  # (samples, inputs), SI
    alternatives: tuple[Entry, ...]  # of the named effects, as diagnosis.json names them
    notes: tuple[str, ...] = ()

    @cached_property
    def value(self) -> Value:
        """Return the promise of the proposed experiment, draw by draw."""
        return self.criterion.promise(self.found.u)

    @cached_property
    def compared(self) -> Mapping[str, Value | None]:
        """Return the promises of `references`."""
        return {n: None if u is None else self.criterion.promise(u) for n, u in self.references.items()}

    @cached_property
    def sensor(self) -> BestSensor | None:
        """Return the further sensor that would separate the alternatives best in the proposed experiment."""
        return best_sensor(self.criterion, self.system, self.found.u)

    @property
    def predictions(self) -> Mapping[str, Array]:
        """Return the outputs, shape (samples, outputs), SI, that every model predicts, by its label."""
        return {label: y[0] for label, y in self.predicted.items()}

    @property
    def predicted(self) -> Mapping[str, Array]:
        """Return `predictions` and those of all draws behind them, shape (sets, samples, outputs), SI."""
        return {r.label: run.y for r, run in zip(self.criterion.rivals, self._runs, strict=True)}

    @property
    def watched(self) -> list[Array]:
        """Return what the travel limits hold for by model, shape (sets, times, quantities), SI."""
        return [run.watched for run in self._runs]

    @cached_property
    def _runs(self) -> list[Simulated]:
        return [*self.criterion.runs(self.found.u)]


def design(
    system: System,
    logs: Logs,
    answer: Mapping[str, Any],
    limits: Path,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> Design:
    """Design the experiment that tells the named effects from their alternatives best.

    If the answer lists no alternatives, the experiment makes the relative intervals of the effects' numbers
    small; without effects, those of the refitted parameters.
    """
    logs = several(system, logs)
    laws = check_answer(system, logs, answer)
    bounds = read_limits(limits, system, logs)
    notes = (*far_from_logs(bounds, system, logs), *rest_notes(system, bounds))
    horizon, study_seed = float(answer["gap"]["horizon"]), int(answer["seed"])
    system, logs, _ = without_copies(system, logs, horizon)
    named: list[Entry] = answer["effects"]
    said = {e["port"] for entry in named for e in (entry, *entry["indistinguishable"])}
    study = Study(with_named_ports(system, said), different(logs), horizon, (), seed=study_seed, laws=laws)
    physics = known_physics(study, progress)
    known = _known(answer)
    swaps = [(k, other) for k, entry in enumerate(named) for other in entry["indistinguishable"]]
    progress("fit the named effects and their alternatives")
    rivals = [fitted_rival(physics, named, known, _label(named))]
    for k, other in swaps:
        exchanged = [*named[:k], other, *named[k + 1 :]]
        kept = {n: v for n, v in known.items() if n not in named[k]["parameters"]}
        rivals.append(fitted_rival(physics, exchanged, kept, _label(exchanged)))
    numbers = _numbers(rivals[0], answer, bool(swaps))
    noise, spread = _uncertainty(study, answer)
    criterion = Criterion(rivals, bounds, noise, spread, numbers)
    found = best_experiment(criterion, seed, progress)
    if found.score < 0.0:
        raise BadInput(
            f"{limits}: travel: no experiment of {bounds.duration:g} s was found in which all models stay "
            f"within the limits, with {100.0 * MARGIN:g} % to spare, for all numbers within the intervals of "
            "the answer: widen the limits, shorten `duration`, change `start`, or narrow the intervals with "
            "more logs"
        )
    beside = _references(criterion, seed)
    found = _chirp_if_as_good(criterion, found, beside["chirp"])
    return Design(study.system, criterion, found, seed, beside, tuple(other for _, other in swaps), notes)


def _known(answer: Mapping[str, Any]) -> dict[str, Known]:
    """Identified numbers by name."""
    found = {}
    for numbers in (*(entry["parameters"] for entry in answer["effects"]), answer["parameters"]):
        for name, each in numbers.items():
            value = each.get("value", each.get("identified"))
            low, high = (np.nan if end is None else float(end) for end in each["interval"])
            if value is not None:
                found[name] = Known(float(value), low, high)
    return found


def _label(entries: list[Entry]) -> str:
    """Name of a model: its effects in words of the answer."""
    return effect_names(entries) if entries else "the known physics"


def _numbers(named: Rival, answer: Mapping[str, Any], rivals: bool) -> list[str]:
    """The numbers whose intervals count: those of the effects, or the refitted parameters without effects."""
    wanted = [n for entry in answer["effects"] for n in entry["parameters"]] or list(answer["parameters"])
    found = [name for name in wanted if name in named.values]
    if not found and not rivals:
        raise BadInput(
            "answer: names no effect and no refitted parameter, so there is nothing to tell apart or to "
            "measure: mark uncertain parameters with `identify: true` in the system file and diagnose again"
        )
    return found


def _uncertainty(study: Study, answer: Mapping[str, Any]) -> tuple[Array, Array]:
    """Sensor noise, and the error of the named model over whole runs beyond it, in units of the outputs."""
    noise, units = study.sensors.noise, answer["gap"]["units"]
    found = []
    for k, name in enumerate(study.logs.outputs):
        errors = (units[name]["augmented_whole_run"], units[name]["augmented"])
        error = next((e for e in errors if e is not None), float(study.sensors.scale[k]))
        found.append(np.sqrt(max(error**2 - noise[k] ** 2, 0.0)))
    return noise, np.array(found)


@dataclass(frozen=True, eq=False)
class Found:
    """The experiment of highest value."""

    family: Family
    u: Array  # (samples, inputs), SI
    score: float  # see `Criterion.worth`; below 0 if no experiment keeps the limits


def best_experiment(criterion: Criterion, seed: int, progress: Callable[[str], None]) -> Found:
    """Return the experiment of highest worth over all families of signals and the references."""
    limits = criterion.limits
    found: list[tuple[float, Family, Array]] = []

    def keep(family: Family, z: Array) -> None:
        found.append((criterion.worth(family.inputs(z[None], limits)[0]), family, z))

    for family in FAMILIES:
        progress(f"search {family.name}")
        size = family.size * len(limits.inputs)
        first = np.asarray(qmc.Halton(size, seed=seed).random(POPULATION))
        keep(family, _evolved(criterion, family, first, seed, GENERATIONS))
    # a proposal is worth no less than the chirp and the random levels that it is compared with
    for family, points in reference_points(len(limits.inputs), seed).values():
        scores = criterion.scores(criterion(family.inputs(points, limits)))
        keep(family, points[scores.argmax()])
    _, family, z = max(found, key=lambda one: one[0])
    progress(f"refine {family.name}")
    near = z + NEAR * np.random.default_rng([seed, 2]).standard_normal((POPULATION, len(z)))
    near[0] = z
    keep(family, _evolved(criterion, family, np.clip(near, 0.0, 1.0), seed, REFINED))
    score, family, z = max(found, key=lambda one: one[0])
    return Found(family, family.inputs(z[None], limits)[0], score)


def _chirp_if_as_good(criterion: Criterion, found: Found, chirp: Array | None) -> Found:
    """The chirp (samples, inputs) where the found experiment promises no more: everybody knows it."""
    if chirp is None:
        return found
    if criterion.gains(criterion.promise(found.u), criterion.promise(chirp)):
        return found
    return Found(CHIRP, chirp, criterion.worth(chirp))


def _references(criterion: Criterion, seed: int) -> dict[str, Array | None]:
    given = references(criterion.limits, seed)
    inside = {name: np.flatnonzero(criterion(u).excess == 0.0)[:1] for name, u in given.items()}
    return {name: u[inside[name][0]] if len(inside[name]) else None for name, u in given.items()}


def _evolved(criterion: Criterion, family: Family, first: Array, seed: int, generations: int) -> Array:
    """Point of the experiment of highest score that a population, shape (members, size), evolves to."""

    def cost(z: Array) -> Array:
        found = criterion(family.inputs(z.reshape(len(z), -1).T, criterion.limits))
        return np.asarray(-criterion.scores(found))

    result = differential_evolution(
        *(cost, [(0.0, 1.0)] * first.shape[1]),
        init=first,
        maxiter=generations,
        tol=0.0,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=np.random.default_rng([seed, 3]),
    )
    return np.asarray(result.x)
