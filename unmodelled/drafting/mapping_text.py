"""The text of a drafted mapping."""

from __future__ import annotations

import json
import re

from unmodelled.drafting.channels import Channel
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.comments import numbered, one_line, word
from unmodelled.drafting.draft import Draft
from unmodelled.drafting.joints import Joint, alike
from unmodelled.drafting.names import Role

#: Files that are left out, and constants, that are named in a comment.
NAMES = 5
_PLAIN = re.compile(r"[A-Za-z][\w./]*")


def mapping_text(draft: Draft, folder: str) -> str:
    """Return the text of a mapping.

    Args:
        draft: findings in the logs.
        folder: folder of the logs, seen from that of the mapping, "." if both are the same.
    """
    patterns = [_seen_from(folder, pattern) for pattern in draft.survey.patterns]
    lines = ["schema: mapping/1", "files:" if len(patterns) > 1 else f"files: {_quoted(patterns[0])}"]
    lines += [f"  - {_quoted(pattern)}" for pattern in patterns] if len(patterns) > 1 else []
    groups = [_quoted(pattern) for pattern in draft.survey.groups]
    lines += (
        [f"groups: [{', '.join(groups)}]" if len(groups) > 1 else f"groups: {groups[0]}"] if groups else []
    )
    left = [f"{path.name} ({reason})" for path, reason in draft.survey.left_out.items()]
    lines += [f"# left out: {one_line(each)}" for each in left[:NAMES]]
    lines += [f"# and {len(left) - NAMES} more files"] if len(left) > NAMES else []
    lines += _time(draft)
    lines.append("signals:")
    for k, joint in numbered(draft.joints):
        lines.append(_signal(f"q{k}", joint.position))
        lines += [_signal(f"w{k}", joint.velocity)] if joint.velocity else []
        lines += [_signal(f"u{k}", joint.drive, _is_against(joint))] if joint.drive else []
        lines += _copies(draft, joint.position.signal)
    if draft.split_by is not None:
        lines.append(
            f"split_by: {_quoted(draft.split_by)}  # Question: does every value of it begin an experiment?"
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
        lines.append(f"# constants: {{{word(example)}: {{column: {_quoted(example)}}}}}")
    return "\n".join(lines) + "\n"


def _time(draft: Draft) -> list[str]:
    timing = draft.timing
    if timing.rate is not None:
        asked = "no clock was found. At which rate was it recorded?"
        return [f"time: {{rate: {timing.rate:g} Hz}}  # Question: {asked}"]
    if timing.column is None:
        return []
    rate = draft.joints[0].position.signal.rate
    asked = "" if timing.certain else f"  # Question: is it in {timing.unit} ({rate:.4g} samples a second)?"
    return [f"time: {{column: {_quoted(timing.column)}, unit: {timing.unit}}}{asked}"]


def _signal(name: str, channel: Channel, against: bool = False) -> str:
    sign = ", sign: -1" if against else ""
    questions = [] if channel.certain else [f"is it in {channel.unit}?"]
    questions += ["is it logged with the other sign? The position accelerates against it."] if against else []
    asked = f"  # Question: {' '.join(questions)}" if questions else ""
    return f"  {name}: {{column: {_quoted(channel.signal.address)}, unit: {channel.unit}{sign}}}{asked}"


def _copies(draft: Draft, position: Signal) -> list[str]:
    """Questions on positions that are left out because they are nearly this one."""
    used = {joint.position.signal.address for joint in draft.joints}
    found = dict[str, None]()
    for signals in draft.experiments:
        own = [s for s in signals if s.address == position.address]
        others = [s for s in signals if s.role is Role.POSITION and s.address not in used]
        found |= {s.address: None for s in others for mine in own if alike(s, mine)}
    like = f"is nearly {one_line(position.address)}. Is it a second body, behind a spring or a play?"
    return [f"  # Question: {one_line(address)} {like} Then add it to both files." for address in found]


def _is_against(joint: Joint) -> bool:
    return joint.trusted and joint.fit.gain < 0.0 and not joint.servo


def _seen_from(folder: str, pattern: str) -> str:
    if folder == ".":
        return pattern
    return folder if pattern == "." else f"{folder}/{pattern}"


def _quoted(text: str) -> str:
    return text if _PLAIN.fullmatch(text) else json.dumps(text, ensure_ascii=False)
