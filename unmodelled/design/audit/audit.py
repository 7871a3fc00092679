"""The story of an audit, from top to bottom."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from unmodelled.base.errors import BadInput, closest
from unmodelled.base.progress import say
from unmodelled.design.audit.fits import AuditFits, audit_fits
from unmodelled.design.audit.number_sets import FILE, NumberSet, SetsGiven, file_numbers, number_sets
from unmodelled.design.audit.predictions import Errors, Prediction, errors_of, predictions
from unmodelled.design.audit.rows import AuditedNumber, NumberAudit
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS, Options
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.data.robot_numbers import with_robot_numbers
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.faults.duplicates import different
from unmodelled.diagnosis.faults.look import without_copies
from unmodelled.diagnosis.fitting.checks import check, check_seed, check_windows
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import several
from unmodelled.systems.model import System


@dataclass(frozen=True, eq=False)
class AuditFound:
    """Findings of logs about every number of a system and about sets of them."""

    system: System  # as given, with the numbers of a robot file
    logs: Logs
    horizon: float  # length of the free-run windows, s
    verdict: Verdict  # of the diagnosis with open numbers
    laws: tuple[str, ...]  # that are missing, in words
    numbers: tuple[AuditedNumber, ...]
    predictions: tuple[Prediction, ...]  # of the sets, the best first
    refitted: Errors  # of numbers that are fitted to the other experiments
    refitted_with_laws: Errors | None  # the same with the missing laws
    notes: tuple[str, ...]


def audit_numbers(
    system: System,
    logs: Logs,
    given: SetsGiven,
    parameters: Sequence[str] | None = None,
    horizon: float | None = None,
    seed: int = 0,
    workers: int | None = None,
    options: Options = DEFAULT_OPTIONS,
    close: float = 0.02,
) -> AuditFound:
    """Say what logs tell about the numbers of a system, and which set of numbers predicts best."""
    # 1. What cannot be audited is refused before anything is computed.
    check_seed(seed)
    if isinstance(close, bool) or not isinstance(close, int | float) or not 0.0 < close < 1.0:
        raise BadInput(f"close: must be a share between 0 and 1, such as 0.02, got {close!r}")
    system = with_robot_numbers(system)
    sets, chosen = number_sets(given, system), _chosen(system, parameters)
    logs = several(system, logs)
    horizon = horizon_of(logs, horizon)
    check(system, logs, horizon)

    # 2. Numbers would make up for a unit or a sign that is wrong.
    system, logs, faults = without_copies(system, logs, horizon, options)
    for fault in faults:
        if fault.decides:
            raise BadInput(f"{logs.source or 'logs'}: {fault.sentence}")
    check_windows(system, logs, horizon)

    # 3. Which laws are missing where all doubted numbers are open, and how do they move the numbers?
    study = Study(system, different(logs), horizon, (), options, seed)
    fits = audit_fits(study, sets, chosen, workers or os.cpu_count() or 1, say)

    # 4. Every set predicts experiments that were left out; what it does not say is fitted to the others.
    say("predict the experiments with every set")
    found, laws = predictions(fits, sets), tuple(law.title for law in fits.judged.laws)
    return AuditFound(
        *(system, logs, horizon, fits.judged.found.verdict, laws),
        NumberAudit(fits, close).rows(sets),
        found,
        refitted=errors_of(fits.plain),
        refitted_with_laws=errors_of(fits.whole) if laws else None,
        notes=(*logs.notes, *(fault.sentence for fault in faults), *_notes(fits, sets)),
    )


def _chosen(system: System, parameters: Sequence[str] | None) -> tuple[str, ...]:
    known = file_numbers(system).values
    for name in parameters or ():
        if name not in known:
            raise BadInput(f"parameters: {system.place} has no parameter {name!r}{closest(name, known)}")
    return tuple(parameters or ())


def _notes(fits: AuditFits, sets: Sequence[NumberSet]) -> list[str]:
    """What an audit rests on."""
    found = []
    if not fits.judged.names_all:
        found.append(
            "something is missing that no law of the library names: a number that a network in every port "
            "moves is not called determined; diagnose says where the gap enters"
        )
    held = [p.name for p in fits.system.parameters if not p.identify and not p.per_experiment]
    if held:
        found.append(
            f"held at the values of the {FILE}, since it does not mark them and no set doubts them: "
            f"{', '.join(held)}; parameters=[...] audits other numbers"
        )
    if len(sets) == 1:
        found.append(f"no set was given: the numbers of the {FILE} alone were audited")
    return found
