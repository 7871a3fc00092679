"""The judge as an entrant: `python judge.py system=FILE logs=FOLDER out=FOLDER`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from unmodelled.base.files import write_json
from unmodelled.diagnosis.data.duplicates import different
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.robot_numbers import with_robot_numbers
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.judge.chain import chain_numbers
from unmodelled.diagnosis.judge.classes import LawClass
from unmodelled.diagnosis.judge.judgement import Judgement, Look, judge
from unmodelled.diagnosis.judge.refit import Refit
from unmodelled.diagnosis.search.input_hold import begun
from unmodelled.diagnosis.search.log_faults import without_copies
from unmodelled.logs.inputs import read_inputs
from unmodelled.logs.preparation import several


def main(words: Mapping[str, str]) -> None:
    """Answer a case."""
    out = Path(words["out"])
    out.mkdir(parents=True, exist_ok=True)
    system, logs = read_inputs(words["system"], words["logs"])
    logs = several(system, logs)
    horizon = horizon_of(logs, None)
    system, logs, faults = without_copies(system, logs, horizon)
    if any(fault.decides for fault in faults):
        channels = [{"channel": name} for fault in faults if fault.decides for name in fault.channels]
        answer = {"verdict": "check_logs", "confidence": 0.5, "effects": [], "logs": channels}
        return write_json(out / "answer.json", answer)
    study = Study.of(with_robot_numbers(system), different(logs), horizon, 0)
    first = begun(study, 1, lambda _: None)
    found = judge(first.study, first.base, lambda text: print(text, file=sys.stderr, flush=True))
    write_json(out / "answer.json", {"verdict": found.verdict, "confidence": 0.5} | content(found))
    return None


def content(found: Judgement) -> dict[str, Any]:
    """What was found, as JSON."""
    base = found.look.parent.base
    return {
        "effects": [_law(one) for one in found.laws],
        "logs": [],
        "looks": [_look(look) for look in found.looks],
        "left": np.sqrt(found.final.residual.square).tolist(),
        "tau": found.final.residual.tau.tolist(),
        "horizon": base.horizon,
        "chain": chain_numbers(base.fitted.hypothesis, base.fitted.fit.values),
    }


def _law(found: LawClass) -> dict[str, Any]:
    own = [
        _refit(one) | {"probability": p} for one, p in zip(found.members, found.probabilities, strict=True)
    ]
    return {**own[0], "kind": found.kind, "indistinguishable": own[1:]}


def _refit(one: Refit) -> dict[str, Any]:
    place = one.row.atom.place
    return {
        "family": one.row.atom.effect.family,
        "variant": one.row.atom.effect.variant,
        "port": place.channel,
        "nats": max(one.nats, -1e9),
        "removed": one.removed,
        "left": np.sqrt(one.residual.square).tolist(),
        "numbers": {n: [v, sd if np.isfinite(sd) else None] for n, (v, sd) in one.numbers.items()},
        "scores": float(one.score.log_scores.sum()),
    }


def _look(look: Look) -> dict[str, Any]:
    base = look.parent.base
    return {
        "horizon": base.horizon,
        "windows": len(base.recording.start),
        "samples": look.parent.weights.samples,
        "matters": look.matters,
        "noises": np.sqrt(base.residual.square).tolist(),
        "deviations": base.in_deviations(base.residual).tolist(),
        "tau": base.residual.tau.tolist(),
        "refits": [_refit(one) for one in sorted(look.refits, key=lambda one: -one.nats)],
    }


if __name__ == "__main__":
    main(dict(word.partition("=")[::2] for word in sys.argv[1:] if "=" in word))
