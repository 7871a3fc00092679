"""Diagnoses of a pendulum, their models fitted without the search: what they should say is known."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import HORIZON, JOINT, effect, judged, scales_of
from unmodelled.diagnosis.data import result
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import Compared, DiagnosedEffect, Diagnosis, Estimate, JudgedModel
from unmodelled.diagnosis.fitting.fit import Fit, fit_parameters
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System

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


def _fitted(label: str, system: System, logs: Logs, held: Sequence[int]) -> tuple[JudgedModel, Fit]:
    runs = [i for i in range(len(logs)) if i not in held]
    found = fit_parameters(Simulation(system, Recording.of(logs, HORIZON, runs)))
    known = system.with_values(found.values)
    seen = prepare(known, logs)
    return judged(label, known, seen, held), found
