"""The text of a drafted mapping."""

from __future__ import annotations

from itertools import product

from unmodelled.drafting.chains import SLACK, chained, copied, geared
from unmodelled.drafting.channels import Channel
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.draft import Draft
from unmodelled.drafting.joints import Joint
from unmodelled.drafting.lines import one_line, quoted, word
from unmodelled.drafting.names import Role

#: Files that are left out, and constants, that are named in a comment.
NAMES = 5


def mapping_text(draft: Draft, folder: str) -> str:
    """Return the text of a mapping."""
    patterns = [_seen_from(folder, pattern) for pattern in draft.survey.patterns]
    lines = ["schema: mapping/1", "files:" if len(patterns) > 1 else f"files: {quoted(patterns[0])}"]
    lines += [f"  - {quoted(pattern)}" for pattern in patterns] if len(patterns) > 1 else []
    groups = [quoted(pattern) for pattern in draft.survey.groups]
    lines += (
        [f"groups: [{', '.join(groups)}]" if len(groups) > 1 else f"groups: {groups[0]}"] if groups else []
    )
    left = [f"{path.name} ({reason})" for path, reason in draft.survey.left_out.items()]
    lines += [f"# left out: {one_line(each)}" for each in left[:NAMES]]
    lines += [f"# and {len(left) - NAMES} more files"] if len(left) > NAMES else []
    lines += _time(draft)
    lines.append("signals:")
    lines += [_signal(used.symbol, used.channel, used.against) for used in draft.used]
    lines += [line for joint in draft.joints for line in _copies(draft, joint)]
    lines += _second_sensors(draft)
    if draft.split_by is not None:
        lines.append(
            f"split_by: {quoted(draft.split_by)}  # Question: does every value of it begin an experiment?"
        )
    if draft.cut is not None:
        asked = "one record was found, and is cut into experiments. Are there more records?"
        lines.append(f"cut: {draft.cut:g} s  # Question: {asked}")
    if draft.constants:
        example = draft.constants[0]
        known = ", ".join(draft.constants[:NAMES])
        lines.append(
            f"# the files hold constants: {one_line(known)}; for the operating point of the system file:"
        )
        lines.append(f"# constants: {{{word(example)}: {{column: {quoted(example)}}}}}")
    return "\n".join(lines) + "\n"


def _time(draft: Draft) -> list[str]:
    timing = draft.timing
    if timing.rate is not None:
        asked = "no clock was found. At which rate was it recorded?"
        return [f"time: {{rate: {timing.rate:g} Hz}}  # Question: {asked}"]
    if timing.column is None:
        return []
    rate = draft.used[0].channel.signal.rate
    asked = "" if timing.certain else f"  # Question: is it in {timing.unit} ({rate:.4g} samples a second)?"
    return [f"time: {{column: {quoted(timing.column)}, unit: {quoted(timing.unit)}}}{asked}"]


def _signal(name: str, channel: Channel, against: bool = False) -> str:
    sign = (", sign: -1" if against else "") + (", hold: true" if channel.signal.held else "")
    factor = channel.scale * channel.signal.factor
    scale = f", scale: {_factor(factor)}" if factor != 1.0 or channel.question else ""
    unsure = channel.question or ("" if channel.certain else _unsure(channel.unit))
    asked = f"is one {_factor(factor)} {channel.unit}, as it is called?"
    questions = [each for each in (asked if channel.signal.factor != 1.0 else "", unsure) if each]
    questions += ["is it logged with the other sign? The position accelerates against it."] if against else []
    asked = f"  # Question: {' '.join(questions)}" if questions else ""
    column, unit = quoted(channel.signal.address), quoted(channel.unit)
    return f"  {name}: {{column: {column}, unit: {unit}{scale}{sign}}}{asked}"


def _unsure(unit: str) -> str:
    return "in which unit is it? None is given." if unit == "1" else f"is it in {unit}?"


def _factor(scale: float) -> str:
    """A factor as one answers the question of it: counts are a number below 1."""
    return f"1/{1.0 / scale:.{1 if scale > 1e-3 else 0}f}" if scale < 0.01 else f"{scale:.6g}"


def _copies(draft: Draft, joint: Joint) -> list[str]:
    """Questions on positions and speeds that are left out because they are of the same chain."""
    position, used = joint.position.signal, {each.position.signal.address for each in draft.joints}
    found = dict[str, str]()
    for signals in draft.experiments:
        for mine in (s for s in signals if s.address == position.address):
            for signal in signals:
                if signal.role is Role.POSITION and signal.address not in used:
                    ratio = chained(signal, mine, signals)
                    found |= {signal.address: _asked(signal, position, ratio)} if ratio else {}
                if signal.role is Role.VELOCITY and (ratio := geared(mine, signal)):
                    slope = (
                        f"is {ratio:.4g} times the slope of {one_line(position.address)}, and is left out."
                    )
                    found[signal.address] = f"{slope} Is it of another shaft, or an electric speed?"
    return [f"  # Question: {one_line(address)} {asked}" for address, asked in found.items()]


def _second_sensors(draft: Draft) -> list[str]:
    """Questions on levels that are left out because another sensor shows them."""
    used, found = {each.channel.signal.address for each in draft.used}, dict[str, str]()
    for signals in draft.experiments:
        levels = [(b, s) for b in draft.balances for s in signals if s.address == b.level.signal.address]
        others = [signal for signal in signals if signal.address not in used]
        for (balance, level), signal in product(levels, others):
            ratio = copied(signal, level) if signal.role is balance.kind.level else 0.0
            if ratio:
                times = "" if abs(ratio - 1.0) < SLACK else f"{ratio:.4g} times "
                found[signal.address] = f"is {times}{one_line(level.address)} with an offset and noise"
    return [
        f"  # Question: {one_line(address)} {said}, and is left out. Is it the same level?"
        for address, said in found.items()
    ]


def _asked(signal: Signal, position: Signal, ratio: float) -> str:
    """Question on a second encoder of a chain."""
    name = one_line(position.address)
    if abs(ratio - 1.0) < SLACK and signal.unit == position.unit:
        return f"is nearly {name}. Is it a second body, behind a spring or a play? Then add it to both files."
    inverse = "" if abs(ratio) > 1.0 else f" = 1/{1.0 / ratio:.4g}"
    return (
        f"is {ratio:.4g}{inverse} times {name} all the time: two encoders of one gear? "
        "Use the one on whose side inertia and torque are meant, or add the other as a second body."
    )


def _seen_from(folder: str, pattern: str) -> str:
    if folder == ".":
        return pattern
    return folder if pattern == "." else f"{folder}/{pattern}"
