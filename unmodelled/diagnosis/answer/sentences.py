"""An answer in a few lines of text, each of which stands on its own, from the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from unmodelled.base.kind_words import kind_name, kind_sentence, ranking_sentence, strangers_sentence
from unmodelled.base.next_step import next_step
from unmodelled.base.sure_numbers import as_said, doubt, interval_of, remark
from unmodelled.base.wording import effect_name, number, place_name, quantity
from unmodelled.diagnosis.data.gap import Off
from unmodelled.diagnosis.gates.refusal import Refusal

Entry = Mapping[str, Any]

#: The verdicts in words.
VERDICTS = {
    "effect": "an effect that the model omits explains the gap",
    "main_effect": "an effect that the model omits explains a part of the gap, more is missing",
    "no_gap": "no gap that matters, what the re-identified model leaves names no law",
    "unknown": "there is a gap that no effect of the library explains",
    "check_logs": "check the logs first, a fault of the logs explains most of the gap",
}
#: What only the law of another value of a parameter has.
OTHER_VALUE = " = "
#: Changed numbers of a robot file that are listed.
MOST_CHANGES = 6


def sentences(content: Entry) -> list[str]:
    """Return an answer in lines: verdict, faults, effects, chain, parameters, gap, notes, files, next."""
    notes = [f"note: {note}" for note in content["notes"]]
    told = [*_verdict(content), *_chain(content), *_parameters(content["parameters"]), *_gap(content)]
    told += notes
    robot, refused = content.get("robot"), content.get("refused", ())
    told += [] if robot is None else robot_sentences(robot)
    told += [str(Refusal(each["file"], each["reason"], each["keep"])) for each in refused]
    return [*told, f"next: {next_step(content)}"]


def _verdict(content: Entry) -> Iterator[str]:
    faults = dict.fromkeys(row["sentence"] for row in content["logs"])  # a fault has a row for each channel
    checked = content["verdict"] == "check_logs"
    yield from () if checked else faults  # a warning that comes before all else
    yield f"verdict: {VERDICTS[content['verdict']]} (confidence {content['confidence']:.2f})"
    yield from faults if checked else ()
    if content.get("alike"):
        alike = content["alike"]
        yield f"most alike: {kind_name(alike)}, such as {effect_name(alike)}"
    for effect in content["effects"]:
        size = f" ({unsure})" if (unsure := doubt(effect)) else ""
        sure = f"confidence {effect['confidence']:.2f}"
        start = "- "
        if effect.get("kind"):
            yield f"- {ranking_sentence(content, effect)}. {kind_sentence(effect)}"
            start = "    "
        law, text = effect["law"], effect.get("text")
        if text and OTHER_VALUE in law:
            law, text = text, None
        yield f"{start}{_capital(effect_name(effect))}{size}: {law} ({_explains(effect)}, {sure})"
        if text:
            yield f"    {text}"
        yield from (f"    {line}" for line in numbers_of(effect))
        if table := effect.get("compensation"):
            yield f"    {table}: what to add to {place_name(effect['port'])}, by the value that is shown"
        if effect["indistinguishable"]:
            others = ", ".join(map(effect_name, effect["indistinguishable"]))
            yield f"    these logs cannot distinguish it from {others}: log motions in which they differ"
    if content.get("strangers"):
        yield strangers_sentence(content["strangers"])
    if content.get("chance") is not None and content["verdict"] != "no_gap":
        said = "probability that the best of all laws lowers the error as much if nothing is missing"
        yield f"chance: {content['chance']:.2g}, the {said}"
    if content["remainder"] is not None:
        yield _remainder(content["remainder"], content["gap"])


def _explains(effect: Entry) -> str:
    share = 100.0 * effect["shrink"]
    digits = 1 if 0.05 <= share < 0.95 else 0  # a small effect beside a large one
    text = f"explains {share:.{digits}f} % of the squared gap above the noise floor"
    others = " and ".join(map(effect_name, effect.get("only_with", ())))
    return f"{text} by itself, and pays only together with {others}" if others else text


def _remainder(left: Entry, gap: Entry) -> str:
    at = f"; the further effect that predicts best is at {left['channel']}" if left["channel"] else ""
    predicts = f"{_percent(left['predictable'])} of the whole" if left["predictable"] else "no part of it"
    part = gap["augmented"] / gap["persistence"] if gap["persistence"] else None
    against = f"the gap is {_percent(part)} of that of persistence; " if part is not None else ""
    return (
        f"remainder: {_percent(left['share'])} of the squared error in experiments that were left out of the "
        f"fit; {against}"
        f"a network in every port predicts {predicts}{at}"
    )


def _percent(share: float) -> str:
    """In percent; a small share with one digit instead of none."""
    return f"{100.0 * share:.0f} %" if share >= 0.005 else f"{100.0 * share:.1g} %"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def numbers_of(effect: Entry) -> Iterator[str]:
    """Yield the numbers of an effect as a person says them, a line each."""
    for name, given in effect["parameters"].items():
        entry = {"symbol": name, "words": "", **as_said(given)}
        if "values" in given:
            spread = " to ".join(map(_number, entry["interval"]))
            yield f"{entry['symbol']} = {spread}{_unit(entry['unit'])}, fitted per experiment"
            continue
        whole = f" of {_number(entry['whole'])}" if "whole" in entry else ""
        words = "".join(f", {part}" for part in (entry["words"], remark(given)) if part)
        yield f"{entry['symbol']} = {_told(entry, entry['value'], whole)}{words}"


def _chain(content: Entry) -> Iterator[str]:
    """How the logs were made, where that pays."""
    if parts := content.get("chain"):
        yield "how these logs were made:"
        yield from (f"- {part['sentence']}" for part in parts)


def _parameters(each: Mapping[str, Entry]) -> Iterator[str]:
    for name, e in each.items():
        found = _told(e, e["identified"])
        unsure = f", {doubts}" if (doubts := remark(e)) else ""
        yield f"{name} = {found}, {_number(e['known'])}{_unit(e['unit'])} in the system file{unsure}"


def _gap(content: Entry) -> Iterator[str]:
    gap, checked = content["gap"], content["verdict"] == "check_logs"
    label = "with the effects found" if content["effects"] else "re-identified"
    for name, entry in gap.get("units", {}).items():
        before, after = (_off(entry, model).says(gap["horizon"]) for model in ("known", "augmented"))
        yield f"{name}: {before}" + ("" if checked else f"; {label}: {after}")
    if checked:
        yield f"gap of the known model: {gap['known']:.3g} standard deviations of the outputs"
    else:
        values = ", ".join(f"{m} {gap[m]:.3g}" for m in ("known", "reidentified", "augmented", "neural"))
        where = "experiments that are left out of the fit, each once"
        floor = f"noise floor {gap['floor']:.3g}"
        yield f"gap: {values}, {floor} (in standard deviations of the outputs, on {where})"
    yield f"persistence: {gap['persistence']:.3g}, the error if every output kept its value or its speed"
    if content["effects"] or gap["shrink"]:  # nothing shrinks where nothing is named
        low, high = (100.0 * end for end in gap["interval"])
        yield (
            f"shrink: {100.0 * gap['shrink']:.0f} % of the squared gap above the noise floor "
            f"(95 % interval {low:.0f} to {high:.0f} %)"
        )


def robot_sentences(robot: Entry) -> Iterator[str]:
    """Yield what the patched robot file holds, and how well it follows the machine."""
    file, changes, replay = robot["file"], robot["changes"], robot["replay"]
    more = f" and {len(changes) - MOST_CHANGES} more" if len(changes) > MOST_CHANGES else ""
    listed = ", ".join(map(_change, changes[:MOST_CHANGES])) + more
    yield f"{file} is the robot file, patched: {listed or 'no number differs'}"
    for part in robot["missing"]:
        held = f" ({robot['supplement']} holds it)" if part["supplemented"] else ""
        yield f"{file} does not hold {part['what']}: {part['reason']}{held}"
    gaps = f"as given {replay['given']['gap']:.3g}, patched {replay['patched']['gap']:.3g}"
    final = replay.get("supplemented", replay["patched"])
    if "supplemented" in replay:
        gaps += f", with its supplement {final['gap']:.3g}"
    diverged = [name for name, off in final["units"].items() if off["whole_run"] is None]
    lost = f"; {', '.join(diverged)} diverges in whole runs" if diverged else ""
    yield f"gap of the robot file in MuJoCo, on the same experiments: {gaps}{lost}"
    if replay["patched"]["gap"] >= replay["given"]["gap"]:
        yield f"{file} alone is no improvement: load it with {robot['supplement']}"


def _change(change: Entry) -> str:
    """A changed number; a limit that the given file does not have is null."""
    given = "none" if change["given"] is None else f"{change['given']:.4g}"
    return (
        f"{change['element']}.{change['quantity']} {given} -> {change['patched']:.4g}{_unit(change['unit'])}"
    )


def _off(entry: Entry, model: str) -> Off:
    """Errors of a model in the unit of the output's column."""
    shown = {**entry, **entry.get("shown", {})}
    return Off(shown["unit"], shown[model], shown[f"{model}_whole_run"])


def _unit(unit: str) -> str:
    return "" if unit in ("", "1", "-") else f" {unit}"


def _told(entry: Entry, value: float | None, more: str = "") -> str:
    """A number with the digits of its interval, such as 0.06 N m (95 % interval 0.05996 to 0.06003)."""
    ends, unit = interval_of(entry), _unit(entry["unit"])
    shown, span = quantity(value, ends)
    sure = "" if ends is None and None not in entry["interval"] else f" (95 % interval {span or 'undefined'})"
    return f"{shown}{more}{unit}{sure}".replace("−", "-")


def _number(value: float | None) -> str:
    return number(value).replace("−", "-")
