"""Diagnoses that no search computed: of effects whose numbers are simply said, and of fits that are known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import HORIZON, JOINT, effect, judged, scales_of
from unmodelled.diagnosis.data import result
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import Compared, DiagnosedEffect, Diagnosis, Estimate, JudgedModel
from unmodelled.diagnosis.fitting.fit import ParameterFit, fit_parameters
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.columns import extended, in_columns
from unmodelled.effects.place import Place
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import Constant, Parameter, System

HELD_OUT = (1, 3)


@dataclass(frozen=True)
class Said:
    """An effect and its numbers; `own` by name in the order of the experiments."""

    family: str
    place: Place
    numbers: Mapping[str, float]
    variant: str = ""
    own: Mapping[str, Sequence[float]] = field(default_factory=dict)


#: Of the pendulum, near what it has.
FRICTION = Said("coulomb_friction", JOINT, {"F_c": 0.06, "v_c": 0.05})


def known(folder: Path, *changes: tuple[str, str]) -> tuple[System, Logs]:
    """`folder`/system.yaml and `folder`/logs: four short experiments in two groups."""
    return Bench(samples=150, groups=("new", "old", "old", "new")).recorded(folder, *changes)


def added_to(system: System, logs: Logs, said: Sequence[Said]) -> list[Added]:
    scales = scales_of(system, logs)
    found: list[Added] = []
    for s in said:
        found.append(effect(s.family, s.variant).add(system, s.place, scales))
        system = found[-1].system
    return found


def augmented(system: System, logs: Logs, said: Sequence[Said], timing: float = 0.0) -> JudgedModel:
    """The model with all effects; the torque acts `timing` later."""
    found = added_to(system, logs, said)
    for a, s in zip(found, said, strict=True):
        assert {*s.numbers, *s.own} <= {*a.amplitudes, *a.shapes}
    numbers = {k: v for s in said for k, v in s.numbers.items()}
    grown = with_numbers(found[-1].system if found else system, found, numbers)
    late = replace(grown, inputs=tuple(replace(i, delay=i.delay + timing) for i in grown.inputs))
    own = {name: values for s in said for name, values in s.own.items()}
    columns = {name: column for a in found for name, column in a.columns.items()}
    spread = in_columns(late, [_constant(p, logs, own[p.name]) for p in late.parameters if p.name in own])
    seen = prepare(spread, extended(logs, {**columns, **own}))  # type: ignore[dict-item]
    return judged("augmented", spread, seen, HELD_OUT)


def _constant(parameter: Parameter, logs: Logs, own: Sequence[float]) -> Constant:
    values = dict(zip(logs.ids, own, strict=True))
    return Constant(parameter.name, parameter.unit, values, float(np.mean(own)), identify=True)


def diagnosis(folder: Path, *said: Said, timing: float = 0.0) -> Diagnosis:
    """What a diagnosis of the pendulum would say if the effects were `said`."""
    estimates = {"b": Estimate("N m s/rad", 0.03, 0.0151, (0.0149, 0.0153))}
    found = told(*known(folder), *said, timing=timing)
    return replace(found, parameters=estimates, notes=("theta was unwrapped",))


def told(system: System, logs: Logs, *said: Said, timing: float = 0.0) -> Diagnosis:
    """What a diagnosis of any system would say if the effects were `said`; four or more experiments."""
    before = judged("known", system, logs, HELD_OUT)
    after, found = augmented(system, logs, said, timing), added_to(system, logs, said)
    results = tuple(_found(logs, a, s) for a, s in zip(found, said, strict=True))
    return Diagnosis(
        system=system,
        logs=logs,
        horizon=HORIZON,
        seed=3,
        verdict="effect" if said else "no_gap",
        confidence=0.94,
        chance=0.0156,
        effects=results,
        remainder=None,
        known=before,
        reidentified=before,
        augmented=after,
        neural=after,
        steps=(before, *([after] * max(1, len(results)))),
        floor=after.gap.floor,
        shrink=0.99,
        interval=(0.97, 1.0),
        held_out=HELD_OUT,
        parameters={},
        comparison=(
            Compared(tuple(found), 0.9, 0.0, 0.0, bool(said)),
            Compared(tuple(found[:1]), 2.4, 1.5, 0.3, False),
            Compared((), 5.0, 4.1, 0.6, not said),
        ),
        notes=(),
    )


def _found(logs: Logs, added: Added, said: Said) -> DiagnosedEffect:
    estimates = {
        name: Estimate(added.units[name], float("nan"), value, (0.9 * value, 1.1 * value))
        for name, value in said.numbers.items()
        if name in added.reported
    }
    own = {name: dict(zip(logs.ids, values, strict=True)) for name, values in said.own.items()}
    others = (replace(added, family="stribeck_friction"),)
    return DiagnosedEffect(added, estimates, own, 0.97, 0.81, (0.7, 0.88), others)


BENCH = Bench(runs=6, samples=600)


def friction(folder: Path, bench: Bench = BENCH, verdict: result.Verdict = "effect") -> Diagnosis:
    """Of the pendulum with dry friction that its file does not have; named where the verdict is an effect."""
    system, logs = bench.recorded(folder)
    held = tuple(range(0, len(logs), 3))
    scales = scales_of(system, logs)
    added, other = (effect(f).add(system, JOINT, scales) for f in ("coulomb_friction", "viscous_friction"))
    before, base = _fitted("re-identified", system, logs, held)
    after, best = _fitted("with coulomb_friction at joint", added.system, logs, held)
    named, chance = verdict == "effect", (0.9, 1.0)
    last = after if named else before
    noise = last.gap.floor
    square = before.gap.value**2 - noise**2
    shrink = (before.gap.value**2 - last.gap.value**2) / square if named else 0.0
    F_c = best.values["F_c"]
    estimates = {"F_c": Estimate("N m", float("nan"), F_c, (0.98 * F_c, 1.02 * F_c))}
    return Diagnosis(
        *(system, logs, HORIZON, 0, verdict, 0.94, 0.0156),
        effects=(DiagnosedEffect(added, estimates, {}, 0.97, shrink, chance, (other,)),) if named else (),
        remainder=None,
        known=judged("known", system, logs, held),
        reidentified=before,
        augmented=last,
        neural=replace(after, label="neural"),
        steps=(before, after) if named else (before,),
        floor=noise,
        shrink=min(shrink, 1.0),
        interval=(0.9 * min(shrink, 1.0), min(shrink, 1.0)),
        held_out=held,
        parameters={
            p.name: Estimate(p.unit, p.value, base.values[p.name], (p.limits[0], p.limits[1]))
            for p in system.parameters
            if p.identify
        },
        comparison=(
            Compared((added,), 0.9, 0.0, 0.0, named),
            Compared((other,), 3.1, 2.2, 0.4, False),
            Compared((), 3.2, 2.3, 0.4, not named),
        ),
        notes=("omega was estimated from theta",),
    )


def _fitted(label: str, system: System, logs: Logs, held: Sequence[int]) -> tuple[JudgedModel, ParameterFit]:
    runs = [i for i in range(len(logs)) if i not in held]
    found = fit_parameters(Simulation(system, Recording.of(logs, HORIZON, runs)))
    known = system.with_values(found.values)
    seen = prepare(known, logs)
    return judged(label, known, seen, held), found
