"""Numbers that every experiment has for itself, of experiments that no fit has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.fit import fit_parameters
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.logs.constants import is_given
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare, with_delays
from unmodelled.systems.model import Constant, Parameter, System

#: Share of an experiment to which its own numbers are fitted.
SEEN = 0.5
#: Fewest experiments whose numbers say how far that of another one may be from their mean.
FEWEST = 3


def with_own_numbers(
    system: System,
    logs: Logs,
    horizon: float,
    runs: Sequence[int] | None = None,
    sensors: Sensors | None = None,
) -> Logs:
    """Return logs in which experiments have numbers of their own where the system asks for them.

    A constant of the operating point with `identify` has a value for the experiments that it lists. That of
    every other one is fitted to the first half of the experiment, with all other numbers fixed: nothing else
    determines it, and the second half stays unseen. The numbers of the listed experiments are its prior.
    """
    constants = [c for c in system.operating_point if c.identify]
    every = range(len(logs)) if runs is None else runs
    lacking = [i for i in every if not all(is_given(c, logs.ids[i]) for c in constants)]
    if not lacking:
        return logs
    as_parameters, rest = _as_parameters(system, constants), _without(logs, constants)
    latest = max((output.delay for output in system.outputs), default=0.0)
    recording = Recording.of(with_delays(system, rest), horizon, lacking, latest, sensors).begun(SEEN)
    found = fit_parameters(Simulation(as_parameters, recording), [_unknown(c) for c in constants]).own
    c = logs.c.copy()
    for constant in constants:
        new = {i: found[constant.name][logs.ids[i]] for i in lacking if not is_given(constant, logs.ids[i])}
        c[list(new), logs.constants.index(constant.name)] = list(new.values())
    experiments = logs.experiments.assign(**dict(zip(logs.constants, c.T, strict=True)))
    note = (
        f"{', '.join(c.name for c in constants)}: fitted to the first half of {len(lacking)} experiments "
        f"that the system file does not list, {logs.ids[lacking[0]]} among them"
    )
    # instead of the note that they have the value for others
    said = tuple(n for n in logs.notes if not n.startswith(tuple(f"{c.name}: " for c in constants)))
    return prepare(system, replace(logs, experiments=experiments, c=c, notes=(*said, note)))


def _unknown(constant: Constant) -> Unknown:
    """The number of an experiment; that of others differs from its mean by a standard deviation."""
    others = list((constant.values or {}).values())
    spread = float(np.std(others, ddof=1)) if len(others) >= FEWEST else 0.0
    found = replace(Unknown.of(_parameter(constant)), middle=constant.other or 0.0)
    return replace(found, scale=spread, prior=spread) if spread else found


def _parameter(constant: Constant) -> Parameter:
    return Parameter(
        *(constant.name, constant.unit, constant.other or 0.0),
        identify=True,
        bounds=constant.bounds,
        per_experiment=True,
    )


def _as_parameters(system: System, constants: Sequence[Constant]) -> System:
    rest = tuple(c for c in system.operating_point if c not in constants)
    return replace(system, parameters=(*system.parameters, *map(_parameter, constants)), operating_point=rest)


def _without(logs: Logs, constants: Sequence[Constant]) -> Logs:
    gone = [logs.constants.index(c.name) for c in constants]
    kept = tuple(name for k, name in enumerate(logs.constants) if k not in gone)
    return replace(logs, constants=kept, c=np.delete(logs.c, gone, axis=1))
