"""Joint parameters of robot simulators, as effects of the library that are fitted and never chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from benchmarks.head_to_head.method import Model, uncertain, with_values
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.deviation import substeps_needed
from unmodelled.diagnosis.fitting.hypothesis import AT_BOUND_SHARE, Hypothesis
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown, Unknowns
from unmodelled.effects.added import Added
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.systems.model import System

#: Quantities of a joint in MuJoCo, with the family of the library that is the same law.
QUANTITIES = {
    "damping": "viscous_friction",
    "frictionloss": "coulomb_friction",
    "armature": "inertia_error",
    "stiffness": "linear_spring",
}
#: The other parameters that PACE fits.
BIAS, DELAY = "sensor_offset", "input_delay"
WORDS = {
    "viscous_friction": "viscous friction",
    "coulomb_friction": "dry friction",
    "inertia_error": "armature",
    "linear_spring": "stiffness",
    BIAS: "bias",
    DELAY: "delay",
}
#: Redundant parameters are looked for on so many windows, with slopes over this step in plausible sizes. A
#: parameter is redundant if others explain its slope up to this share.
WINDOWS, STEP, SAME = 60, 1e-3, 0.05


@dataclass(frozen=True, eq=False)
class JointFit:
    """Free runs as a function of the vector of all parameters that a method fits."""

    hypothesis: Hypothesis  # the known physics with the joint parameters, all zero

    @classmethod
    def of(cls, study: Study, families: Sequence[str]) -> JointFit:
        """Add joint parameters of families in this order at mechanical ports, inputs and measured positions.

        A joint parameter that acts like parameters of the system file or earlier ones is left out, because no
        log could tell the two from each other.
        """
        found = Hypothesis.known(study)
        for family in families:
            for effect in (e for e in effects() if e.family == family and not e.variant):
                for place in effect.places(study.system):
                    if _is_joint(study.system, place):
                        larger = found.plus(effect, place)
                        if _adds(larger):
                            found = larger
        return cls(found)

    @property
    def study(self) -> Study:
        """Return the known physics with the logs."""
        return self.hypothesis.study

    @cached_property
    def unknowns(self) -> Unknowns:
        """Return all fitted numbers: uncertain parameters of the file and joint parameters, no timing."""
        simulation = self.hypothesis.simulation(self.study.recording)
        return Unknowns(simulation, _unknowns(self.hypothesis))

    @cached_property
    def start(self) -> Array:
        """Return the vector of the system as given, without joint parameters, shape (entries,)."""
        return self.unknowns.vector({})

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Return the lowest and highest values, shape (entries,), of the vector."""
        return self.unknowns.bounds

    @cached_property
    def substeps(self) -> int:
        """Return the integration steps per sample that the start needs."""
        return substeps_needed(self.unknowns.simulation, self.unknowns.numbers(self.start[None]))[0]

    def errors(self, z: Array) -> Array:
        """Return errors (errors, sets) of free runs of vectors (sets, entries) over the training experiments.

        They are in standard deviations, and cut as in the gap.
        """
        return _errors(self.unknowns, z, self.substeps)

    def model(self, z: Array, budget: str) -> Model:
        """Return the model of a vector (entries,); `budget` tells simulations and the reason to stop."""
        each, values = self.unknowns.each, z * self.unknowns.scale
        parts = [values[self.unknowns.unknown == k] for k in range(len(each))]
        found = list(zip(each, parts, strict=True))
        shared = {u.name: float(part[0]) for u, part in found if not u.own}
        ids = [self.study.logs.ids[i] for i in sorted(self.study.learned)]
        own = {u.name: dict(zip(ids, part.tolist(), strict=True)) for u, part in found if u.own}
        system, logs = with_values(self.hypothesis, shared, own, self.substeps)
        known = uncertain(self.study.system)
        joints: dict[str, dict[str, float]] = {}
        said = []
        quantities = {family: quantity for quantity, family in QUANTITIES.items()}
        for effect in self.hypothesis.effects:
            name, unit = _amplitude(effect), effect.units[_amplitude(effect)]
            unit = "" if unit in ("1", "-") else f" {unit}"
            said.append(f"{WORDS[effect.family]} {shared[name]:.3g}{unit} at {effect.place.name}")
            if effect.family in quantities:
                joints.setdefault(effect.place.name, {})[quantities[effect.family]] = shared[name]
        moved = [f"{n} {known[n]:.3g} -> {shared[n]:.3g}" for n in known]
        limits = AT_BOUND_SHARE
        of_file = [u for u in each if not u.own and u.name in known]
        far = tuple(u.name for u in of_file if u.bound(shared[u.name], limits) is not None)
        says = f"parameters: {'; '.join([*said, *moved])}"
        numbers = {name: shared[name] for name in known}
        named = tuple((e.family, e.place.channel) for e in self.hypothesis.effects)
        return Model(system, logs, says, numbers, far, budget, joints=joints, named=named)


def _is_joint(system: System, place: Place) -> bool:
    """Whether a place is a mechanical port with a speed, an input, or the sensor of a port's position."""
    if place.factor is not None:
        return False
    ports = [p for p in system.ports if p.domain == "power" and p.velocity is not None]
    if place.kind == "port":
        return place.name in {p.name for p in ports}
    if place.kind == "sensor":
        shown = {o.name: str(o.expression) for o in system.outputs}
        return shown[place.name] in {p.position for p in ports}
    return place.kind == "actuator"


def _amplitude(effect: Added) -> str:
    return next(iter([*effect.amplitudes, *effect.delays]))


def _unknowns(hypothesis: Hypothesis) -> tuple[Unknown, ...]:
    armature = {_amplitude(e) for e in hypothesis.effects if e.family == "inertia_error"}
    every = [u for u in hypothesis.unknowns if u.name not in hypothesis.timing]
    return tuple(replace(u, low=0.0) if u.name in armature else u for u in every)


def _errors(unknowns: Unknowns, z: Array, substeps: int) -> Array:
    simulation = unknowns.simulation
    recording = simulation.recording
    found = simulation(unknowns.numbers(z), substeps=substeps)
    with np.errstate(all="ignore"):
        off = (found.y - found.measured) / recording.scale
    off = np.where(np.isfinite(off).all(axis=-1, keepdims=True), off, LARGEST_ERROR)
    off = np.clip(off, -LARGEST_ERROR, LARGEST_ERROR).swapaxes(0, 1)
    return off[:, recording.counted].reshape(len(z), -1).T


def _adds(hypothesis: Hypothesis) -> bool:
    """Whether the last effect changes the free runs in a way in which no other parameter does."""
    recording = hypothesis.study.recording.thinned(WINDOWS)
    simulation: Simulation = hypothesis.simulation(recording)
    each = Unknowns(simulation, _unknowns(hypothesis))
    z = each.vector({})
    _, high = each.bounds
    signs = np.where(z + STEP <= high, 1.0, -1.0)
    points = np.vstack([z, z + STEP * np.diag(signs)])
    r = _errors(each, points, 1)
    slopes = (r[:, 1:] - r[:, :1]) / (STEP * signs)
    names = [each.each[k].name for k in each.unknown]
    column = names.index(_amplitude(hypothesis.effects[-1]))
    mine, others = slopes[:, column], np.delete(slopes, column, axis=1)
    size = float(np.linalg.norm(mine))
    if not size > 1e-9:
        return False
    norms = np.linalg.norm(others, axis=0)
    others = others[:, norms > 0.0] / norms[norms > 0.0]
    left = mine - others @ np.linalg.lstsq(others, mine, rcond=1e-8)[0] if others.size else mine
    return bool(np.linalg.norm(left) > SAME * size)
