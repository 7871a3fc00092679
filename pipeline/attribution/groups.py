"""Group inputs that belong together, such as the sine and cosine of one angle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from unmodelled.base.errors import BadInput


def positions(names: Sequence[str], groups: Mapping[str, Sequence[str]]) -> dict[str, list[int]]:
    """Return the positions of the members of every group."""
    found: dict[str, list[int]] = {}
    owner: dict[str, str] = {}
    for group, members in groups.items():
        if not members:
            raise BadInput(f"groups: {group} is empty")
        for name in members:
            if name not in names:
                raise BadInput(f"groups: {group} names {name}, the network reads {', '.join(names)}")
            if name in owner:
                raise BadInput(f"groups: {name} is in {owner[name]} and in {group}")
            owner[name] = group
        found[group] = [names.index(name) for name in members]
    left = [name for name in names if name not in owner]
    if left:
        raise BadInput(f"groups: {left[0]} is in no group")
    return found


def players(names: Sequence[str], groups: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the groups that are complete, and every other name as a group of its own."""
    whole = {group: list(members) for group, members in groups.items() if set(members) <= set(names)}
    grouped = {member for members in whole.values() for member in members}
    return whole | {name: [name] for name in names if name not in grouped}
