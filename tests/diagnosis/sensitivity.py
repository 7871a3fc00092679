"""What a diagnosis says with each threshold halved and doubled; prints tables for docs/decisions.

    python -m tests.diagnosis.sensitivity decide CASES REFITS | faults | where

`decide` counts the right answers among withheld cases; CASES and REFITS are folders of campaigns as `acquire`
and `refit_withheld` write them. The search is run once per case, and the decision among its fits is repeated
with other thresholds. So the fits, and which candidates are fitted at all, are those of the default
thresholds, and the gate of the held-out experiments is left out.
"""

import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from pipeline.chapters.reported import read_refit, read_truth
from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.withheld.channels import parameter_channels
from pipeline.withheld.folders import LOGS, SYSTEM, TRUTH, campaigns_in, cases_in
from pipeline.withheld.judging import Case
from tests.diagnosis.benches import Bench
from tests.diagnosis.test_log_faults import WRONG, Spoil, spoilt
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.decide.decision import Decision, decide
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.log_faults import log_faults, without_copies
from unmodelled.diagnosis.where.where import where
from unmodelled.effects.added import Added
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

HORIZON, FACTORS = 0.1, (0.5, 2.0)
BENCH = Bench(runs=6, samples=400)
IN_GROUPS = {"friction": (0.06, 0.06, 0.2, 0.06, 0.2, 0.06), "groups": tuple("aababa")}
BENCHES = {
    "friction": BENCH,
    "missed counts": replace(BENCH, friction=0.0, missed=0.2),
    "friction of a group": replace(BENCH, **IN_GROUPS),  # type: ignore[arg-type]
}
DECIDING = (
    *("local_complexity", "known_parameter_complexity", "level", "material_share", "further_rest"),
    *("material_rest", "negligible_error", "unexplained_gap", "most_equal"),
)
OF_FAULTS = (
    *("fault_share", "suspect_share", "clock_error_ratio", "equal_error_ratio"),
    *("outstanding_error", "copied_noise"),
)
NAMES = [field.name for field in fields(Thresholds)]
OF_WHERE = NAMES[NAMES.index("shown_channel_share") :]


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


def decider(search: EffectSearch) -> Callable[[Thresholds], Decision]:
    """What is decided with other thresholds."""
    networks: dict[int, Candidates] = {}

    def decided(limits: Thresholds) -> Decision:
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
            _, networks[named] = search.beside_network(fitted)
        beside = replace(networks[named], thresholds=limits)
        gap, before = (judged_model("", candidates.fits[k]).gap for k in (named, 0))
        return decide(candidates, named, beside, gap, before)

    return decided


def judge(case: Path, refit: Path) -> Callable[[Thresholds], dict[str, Any]]:
    """What is said of a withheld case with other thresholds, and whether that is right."""
    system = read_system(case / SYSTEM)
    logs = read_logs(case / LOGS, system)
    horizon = horizon_of(logs, None)
    system, logs, _ = without_copies(system, logs, horizon, DEFAULT_THRESHOLDS)
    search = EffectSearch(Study.of(system, logs, horizon, 0))
    search.run()
    decided, truth, best = decider(search), read_truth(case / TRUTH), read_refit(refit)["oracle"]
    acts_at = parameter_channels(system)

    def say(limits: Thresholds) -> dict[str, Any]:
        said = decided(limits)
        effects = [
            {**_where(e), "indistinguishable": list(map(_where, said.indistinguishable[k]))}
            for k, e in enumerate(said.prediction.fitted.hypothesis.effects)
        ]
        content = {"verdict": said.verdict, "effects": effects, "logs": []}
        answer = Case.of(truth, content, acts_at, best["seen"], best["gap_seen"])
        return {"verdict": said.verdict, "effects": [str(e) for e in effects], "right": answer.right}

    return say


def _where(effect: Added) -> dict[str, Any]:
    place = effect.place
    return {"family": effect.family, "port": place.channel, "factor": place.factor, "level": place.level}


def compare(names: Sequence[str], cases: Mapping[str, Callable[[Thresholds], dict[str, Any]]]) -> None:
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


def deciding(cases: Path, refits: Path) -> None:
    found = {}
    for case in (case for campaign in campaigns_in(cases) for case in cases_in(campaign)):
        name = f"{case.parent.name}/{case.name}"
        found[name] = judge(case, refits / case.parent.name / f"{case.name}.json")
        print(f"# searched {name} ({time.process_time():.0f} s)", flush=True)
    compare(DECIDING, found)


def of_faults(folder: Path) -> None:
    PendulumCampaign(runs=6, duration=2.0).write(folder / "right", 0)
    PendulumCampaign(runs=6, duration=2.0, coulomb=0.0, inertia=0.03).write(folder / "heavy", 0)
    spoilt_logs = {name: ("right", spoil) for name, (spoil, *_) in WRONG.items()}
    unchanged: Spoil = lambda log, name: log  # noqa: E731
    known = {"right": ("right", unchanged), "wrong inertia": ("heavy", unchanged), **spoilt_logs}
    cases = {}
    for k, (name, (source, spoil)) in enumerate(known.items()):
        system, logs = spoilt(folder / source, folder / str(k), spoil)
        cases[name] = lambda limits, case=(system, logs): {
            "faults": [(f.channels, f.problem, f.experiments) for f in log_faults(*case, HORIZON, limits)]
        }
    compare(OF_FAULTS, cases)


def of_where(folder: Path) -> None:
    cases = {}
    for name, bench in BENCHES.items():
        found = diagnose_gap(*bench.recorded(folder / name), HORIZON, 0, 1)

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
    what, *folders = sys.argv[1:]
    if what == "decide":
        deciding(*map(Path, folders))
    else:
        with tempfile.TemporaryDirectory() as place:
            {"faults": of_faults, "where": of_where}[what](Path(place))
    print(f"{time.process_time():.0f} s of processor time")
