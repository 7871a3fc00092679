"""What a diagnosis says with each threshold halved and doubled; prints tables for docs/decisions.

    python -m tests.diagnosis.sensitivity decide|faults|where [EMPS folder]

The search is run once per case, and the decision among its fits is repeated with other thresholds. So the
fits, and which candidates are fitted at all, are those of the default thresholds.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from pipeline.recordings.emps import EmpsRecording
from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.rigs.withheld.campaign import WithheldCampaign
from tests.diagnosis.benches import Bench, pendulum
from tests.diagnosis.test_log_faults import WRONG, Spoil, spoilt
from unmodelled.diagnosis.answer.diagnose_gap import diagnose_gap
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.decide.decision import decide
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.log_faults import log_faults
from unmodelled.diagnosis.search.network import fit_network
from unmodelled.diagnosis.where.where import where
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

HORIZON, FACTORS = 0.1, (0.5, 2.0)
#: Seconds of processor time after which no further case is begun.
BUDGET = 280.0
BENCH = Bench(runs=6, samples=400)
BENCHES = {
    "friction": BENCH,
    "nothing": replace(BENCH, friction=0.0),
    "missed counts": replace(BENCH, friction=0.0, missed=0.2),
    "friction and gain": replace(BENCH, samples=500, gain=1.1),
    "friction of a group": replace(
        BENCH, friction=(0.06, 0.06, 0.2, 0.06, 0.2, 0.06), groups=tuple("aababa")
    ),
    "ripple": replace(BENCH, ripple=0.08),
    "dead zone": replace(BENCH, dead_zone=0.1, friction=0.0),
    "spring with memory": replace(BENCH, memory=(0.5, 0.1)),
}
KINDS = {"single": 8, "null": 3, "pair": 4, "outside": 3, "local": 2}
DECIDING = (
    *("local_complexity", "known_parameter_complexity", "level", "material_share", "further_rest"),
    *(
        "exchanged_rest",
        "negligible_error",
        "unexplained_gap",
        "least_gain",
        "alike_errors",
        "same_complexity",
        "most_equal",
    ),
)
OF_FAULTS = (
    *("fault_share", "fault_share_some", "suspect_share", "fault_error_ratio", "material_error"),
    *("inertia_error_ratio", "equal_error_ratio", "little_input", "outstanding_error"),
    *("fewest_for_outstanding", "copied_noise"),
)
OF_WHERE = [f.name for f in fields(Thresholds)][
    [f.name for f in fields(Thresholds)].index("shown_channel_share") :
]
Known = tuple[System, Logs]


def known(folder: Path, emps: Path | None) -> Iterator[tuple[str, Known, float]]:
    """Systems and logs with a name and a horizon, s."""
    for name, bench in BENCHES.items():
        system = pendulum(folder / name)
        yield name, (system, bench.logs(folder / name / "logs", system)), HORIZON
    if emps is not None:
        EmpsRecording(str(emps)).write(folder / "emps", 0)
        for file in sorted(Path("systems/emps").glob("*_withheld.yaml")):
            system = read_system(file)
            yield f"EMPS {file.stem}", (system, read_logs(folder / "emps", system)), HORIZON
    for kind, count in KINDS.items():
        WithheldCampaign(kind, count, 0).write(folder / kind, 0)
        for case in sorted((folder / kind).glob(f"{kind}_*")):
            system = read_system(case / "system.yaml")
            yield case.name, (system, read_logs(case / "logs", system)), HORIZON


def varied(name: str) -> Iterator[tuple[float, Thresholds]]:
    """The threshold halved and doubled; a share that would exceed one is put half way to one, and of a ratio
    that is at least one the part above one is halved and doubled.
    """
    value = getattr(DEFAULT_THRESHOLDS, name)
    for factor in FACTORS:
        other = type(value)(value * factor)
        if name in ("level", "fault_share", "input_likeness", "port_likeness") and factor > 1.0:
            other = 0.5 * (1.0 + value)
        if name == "equal_error_ratio":  # a ratio of one or more
            other = 1.0 + factor * (value - 1.0)
        yield factor, replace(DEFAULT_THRESHOLDS, **{name: other})


def decider(search: EffectSearch) -> Callable[[Thresholds], dict[str, Any]]:
    """What is decided with other thresholds, without the gate of the held-out experiments."""
    networks: dict[int, LeftOut] = {}

    def decided(limits: Thresholds) -> dict[str, Any]:
        study = replace(search.study, thresholds=limits)
        found = []
        for prediction in search.found.values():
            fitted = prediction.fitted
            same = replace(fitted, hypothesis=replace(fitted.hypothesis, study=study))
            found.append(replace(prediction, fitted=same))  # the fit stays
        candidates = Candidates(tuple(found), limits)
        named = candidates.named()
        if named not in networks:
            fitted = list(search.found.values())[named].fitted
            networks[named] = search.left_out(fit_network(fitted, search.fitted, search.screened, 0))
        said = decide(candidates, named, networks[named], judged_model("", candidates.fits[named]).gap)
        return {
            "verdict": said.verdict,
            "effects": sorted(map(_where, candidates.fits[named].hypothesis.effects)),
            "equal": {k: sorted(map(_where, others)) for k, others in said.indistinguishable.items()},
        }

    return decided


def _where(effect: Any) -> tuple[str, str]:
    return effect.family, effect.place.channel


def compare(
    names: tuple[str, ...] | list[str], cases: Mapping[str, Callable[[Thresholds], dict[str, Any]]]
) -> None:
    """Print, for every threshold, in which cases which part of the answer is another one."""
    before = {case: say(DEFAULT_THRESHOLDS) for case, say in cases.items()}
    for case, said in before.items():
        print(f"# {case}: {said}")
    for name in names:
        for factor, limits in varied(name):
            changed: dict[str, list[str]] = {}
            for case, say in cases.items():
                now = say(limits)
                for part in now:
                    if now[part] != before[case][part]:
                        changed.setdefault(part, []).append(f"{case}: {before[case][part]} to {now[part]}")
            counts = ", ".join(f"{part} {len(each)}" for part, each in changed.items()) or "none"
            print(f"{name} x{factor:g} ({getattr(limits, name):g}), of {len(cases)}: {counts}")
            for part in changed:
                for each in changed[part][:4]:
                    print(f"    {part} {each}")
            sys.stdout.flush()


def deciding(folder: Path, emps: Path | None) -> None:
    cases = {}
    for name, (system, logs), horizon in known(folder, emps):
        if time.process_time() > BUDGET:
            break
        search = EffectSearch(Study.of(system, logs, horizon, 0))
        search.run()
        cases[name] = decider(search)
        print(f"# searched {name} ({time.process_time():.0f} s)", flush=True)
    compare(DECIDING, cases)


def of_faults(folder: Path, _: Path | None) -> None:
    PendulumCampaign(runs=6, duration=2.0).write(folder / "right", 0)
    PendulumCampaign(runs=6, duration=2.0, coulomb=0.0, inertia=0.03).write(folder / "heavy", 0)
    spoilt_logs = {name: ("right", spoil) for name, (spoil, *_) in WRONG.items()}
    unchanged: Spoil = lambda log, name: log  # noqa: E731
    known = {"right": ("right", unchanged), "wrong inertia": ("heavy", unchanged), **spoilt_logs}
    cases = {}
    for k, (name, (source, spoil)) in enumerate(known.items()):
        system, logs = spoilt(folder / source, folder / str(k), spoil)
        cases[name] = lambda limits, logs=logs, system=system: {
            "faults": [
                (f.channels, f.problem, f.experiments) for f in log_faults(system, logs, HORIZON, limits)
            ]
        }
    compare(OF_FAULTS, cases)


def of_where(folder: Path, _: Path | None) -> None:
    cases = {}
    for name in ("friction", "missed counts", "friction of a group"):
        system = pendulum(folder / name)
        found = diagnose_gap(system, BENCHES[name].logs(folder / name / "logs", system), HORIZON, 0, 1)

        def say(limits: Thresholds, found: Any = found) -> dict[str, Any]:
            there = where(found, limits)
            return {
                "largest channel": there.channels[0]["port"] if there.channels else None,
                "channels": [row["port"] for row in there.channels],
                "regions": len(there.regions),
                "factors": [row["level"] for row in there.factors],
            }

        cases[name] = say
    compare(OF_WHERE, cases)


if __name__ == "__main__":
    part = {"decide": deciding, "faults": of_faults, "where": of_where}[sys.argv[1]]
    with tempfile.TemporaryDirectory() as place:
        part(Path(place), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
    print(f"{time.process_time():.0f} s of processor time")
