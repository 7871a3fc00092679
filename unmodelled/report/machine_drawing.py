"""Draw the machine: inputs, actuators, states with ports, sensors and outputs, and what is missing where."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Any

from unmodelled.base.wording import effect_name
from unmodelled.report.headline import percent
from unmodelled.report.numbers import unit_text

#: Share of the squared gap from which a block says its share.
SHOWN_SHARE = 0.05
#: Pixels: height of a line, width of a letter, room inside a block and between blocks.
LINE, LETTER, ROOM, GAP = 18.0, 7.1, 10.0, 26.0
#: Width of a bold letter, relative to that of others.
BOLD = 1.15
#: Columns of the wide drawing: x and width of inputs, actuators, machine, sensors and outputs.
COLUMNS: Sequence[tuple[float, float]] = (
    (0.0, 134.0),
    (160.0, 166.0),
    (352.0, 286.0),
    (664.0, 166.0),
    (856.0, 138.0),
)
#: Widths of the two drawings.
WIDE, NARROW = 994.0, 340.0

Lines = list[tuple[str, str]]  # class and text


@dataclass(frozen=True)
class _Block:
    """Rectangle with lines of text and blocks below them; `kind` is its class."""

    lines: Lines
    kind: str
    title: str
    inside: tuple[_Block, ...] = ()

    def height(self, width: float) -> float:
        below = sum(block.height(width - 2 * ROOM) + ROOM for block in self.inside)
        return 2 * ROOM + LINE * len(self.wrapped(width)) + below

    def wrapped(self, width: float) -> Lines:
        """Lines that fit into the width; a word that does not is cut, and the title has it in full."""
        most = {kind: int((width - 2 * ROOM) / (LETTER * BOLD if kind else LETTER)) for kind, _ in self.lines}
        return [(kind, part) for kind, text in self.lines for part in _wrapped(text, max(4, most[kind]))]

    def drawn(self, x: float, y: float, width: float) -> str:
        height, rows = self.height(width), self.wrapped(width)
        parts = [
            f'<rect class="{self.kind}" x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="7"/>'
        ]
        for k, (kind, text) in enumerate(rows):
            base = y + ROOM + LINE * (k + 0.72)
            parts.append(f'<text class="{kind}" x="{x + ROOM:g}" y="{base:g}">{escape(text)}</text>')
        y += ROOM + LINE * len(rows)
        for block in self.inside:
            y += ROOM / 2
            parts.append(block.drawn(x + ROOM, y, width - 2 * ROOM))
            y += block.height(width - 2 * ROOM) + ROOM / 2
        return f"<g><title>{escape(self.title)}</title>{''.join(parts)}</g>"


def machine_drawing(content: Mapping[str, Any], machine: Mapping[str, Any]) -> str:
    """Return a wide and a narrow drawing as SVG elements, of which a page shows one."""
    text = escape(_in_words(content, machine))
    columns = _columns(content, machine)
    return _wide(columns, text) + _narrow(columns, text)


def _columns(content: Mapping[str, Any], machine: Mapping[str, Any]) -> list[list[_Block]]:
    ports = [
        _marked(content, port["name"], f"port {port['name']}", f"effort {_named(port, 'effort')}")
        for port in machine["ports"]
    ]
    known = {port["name"] for port in machine["ports"]}
    others = [name for name in _channels(content) if ":" not in name and name not in known]
    others += [name for name in _channels(content) if name.startswith("parameter:")]
    ports += [_marked(content, name, name.replace(":", " "), "") for name in others]
    states = ", ".join(map(_named, machine["states"]))
    title = f"States: {states}"
    body = _Block([("head", "machine"), ("", states)], "whole", title, tuple(ports))
    return [
        [_plain(item) for item in machine["inputs"]],
        [
            _marked(content, f"actuator:{i['name']}", f"actuator of {i['name']}", "")
            for i in machine["inputs"]
        ],
        [body],
        [_marked(content, f"sensor:{o['name']}", f"sensor of {o['name']}", "") for o in machine["outputs"]],
        [_plain(item) for item in machine["outputs"]],
    ]


def _channels(content: Mapping[str, Any]) -> list[str]:
    found = [row["port"] for row in content["where"]["channels"] if row["share"] >= SHOWN_SHARE]
    return list(dict.fromkeys([*(str(effect["port"]) for effect in content["effects"]), *found]))


def _marked(content: Mapping[str, Any], channel: str, name: str, more: str) -> _Block:
    """A place where something can be missing, with what is missing there."""
    shares = {row["port"]: row["share"] for row in content["where"]["channels"]}
    share = shares.get(channel) or 0.0
    found = [effect_name(effect) for effect in content["effects"] if effect["port"] == channel]
    # the place stands above: it need not be said again
    missing = [text.partition(" at ")[0] for text in found]
    lines: Lines = [("", name), *([("soft", more)] if more else [])]
    lines += [("wrong", f"✕ missing: {text}") for text in missing]
    told = f"{percent(share)} of the gap enters here" if share >= SHOWN_SHARE or (found and share) else ""
    lines += [("wrong" if found else "soft", told)] if told else []
    suspect = not content["effects"] and bool(told) and share == max(shares.values())
    return _Block(lines, "guilty" if found or suspect else "block", "; ".join(text for _, text in lines))


def _plain(item: Mapping[str, Any]) -> _Block:
    return _Block([("", _named(item))], "block", _named(item))


def _named(item: Mapping[str, Any], key: str = "name") -> str:
    unit = unit_text(item["unit"]).replace(" ", "\N{NO-BREAK SPACE}")
    return f"{item[key]} ({unit})" if unit else str(item[key])


def _wide(columns: Sequence[Sequence[_Block]], text: str) -> str:
    """From left to right: inputs beside their actuators, the machine, sensors beside their outputs."""
    tops = LINE + ROOM
    heads = ("inputs, logged", "actuators", "", "sensors", "outputs, logged")
    parts = [
        f'<text class="head" x="{x:g}" y="{LINE * 0.8:g}">{head}</text>'
        for column, (x, _), head in zip(columns, COLUMNS, heads, strict=True)
        if column
    ]
    sides = (slice(0, 2), slice(2, 3), slice(3, 5))
    heights = [_row_heights(columns[side], [width for _, width in COLUMNS[side]]) for side in sides]
    most = max(sum(rows) + ROOM * (len(rows) - 1) for rows in heights)
    centres = []
    for side, rows in zip(sides, heights, strict=True):
        y, middles = tops + (most - sum(rows) - ROOM * (len(rows) - 1)) / 2, []
        for height, row in zip(rows, zip(*columns[side], strict=True), strict=True):
            for block, (x, width) in zip(row, COLUMNS[side], strict=True):
                parts.append(block.drawn(x, y + (height - block.height(width)) / 2, width))
            middles.append(y + height / 2)
            y += height + ROOM
        centres.append(middles)
    for (left, right), ends in zip(pairwise(COLUMNS), (0, 0, 2, 2), strict=True):
        parts += [_arrow(left[0] + left[1], y, right[0], y) for y in centres[ends]]
    return _svg("wide", WIDE, tops + most + 2, text, parts)


def _row_heights(columns: Sequence[Sequence[_Block]], widths: Sequence[float]) -> list[float]:
    """Height of every row of blocks that stand side by side."""
    return [max(map(_Block.height, row, widths)) for row in zip(*columns, strict=True)]


def _narrow(columns: Sequence[Sequence[_Block]], text: str) -> str:
    """From top to bottom: every input with its actuator, the machine, every sensor with its output."""
    inputs, actuators, body, sensors, outputs = columns
    half = (NARROW - GAP) / 2
    inner = half - 2
    y, parts = 1.0, []

    def side_by_side(*pair: Sequence[_Block]) -> None:
        nonlocal y
        for height, row in zip(_row_heights(pair, (inner, inner)), zip(*pair, strict=True), strict=True):
            for block, x in zip(row, (0.0, half + GAP), strict=True):
                parts.append(block.drawn(x + 1, y + (height - block.height(inner)) / 2, inner))
            parts.append(_arrow(half - 1, y + height / 2, half + GAP + 1, y + height / 2))
            y += height + ROOM

    side_by_side(inputs, actuators)
    for block in body:
        if inputs:
            parts.append(_arrow(NARROW - half / 2, y - ROOM, NARROW - half / 2, y + GAP - ROOM))
            y += GAP - ROOM
        parts.append(block.drawn(1.0, y, NARROW - 2))
        y += block.height(NARROW - 2)
        parts.append(_arrow(half / 2, y, half / 2, y + GAP))
        y += GAP
    side_by_side(sensors, outputs)
    return _svg("narrow", NARROW, y, text, parts)


def _arrow(x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<path d="M{x1:g} {y1:g}L{x2:g} {y2:g}" marker-end="url(#arrow)"/>'


def _svg(kind: str, width: float, height: float, text: str, parts: Iterable[str]) -> str:
    marker = (
        '<defs><marker id="arrow" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" '
        'markerUnits="userSpaceOnUse" orient="auto"><path d="M0 0L8 4L0 8z"/></marker></defs>'
    )
    name = f"arrow-{kind}"
    body = f"{marker}{''.join(parts)}".replace('id="arrow"', f'id="{name}"').replace("#arrow", f"#{name}")
    return (
        f'<svg class="{kind}" role="img" aria-label="{text}" viewBox="-2 0 {width + 4:g} {height:g}" '
        f'font-size="13" xmlns="http://www.w3.org/2000/svg">{body}</svg>'
    )


def _in_words(content: Mapping[str, Any], machine: Mapping[str, Any]) -> str:
    names = {key: ", ".join(item["name"] for item in machine[key]) or "none" for key in ("inputs", "outputs")}
    missing = " and ".join(map(effect_name, content["effects"])) or "no effect"
    return (
        f"Drawing of the machine: inputs {names['inputs']}; states "
        f"{', '.join(state['name'] for state in machine['states'])}; outputs {names['outputs']}. "
        f"Missing in the model: {missing}."
    )


def _wrapped(text: str, most: int) -> list[str]:
    rows = [""]
    for word in text.split(" "):
        word = word if len(word) <= most else f"{word[: most - 1]}…"
        if rows[-1] and len(rows[-1]) + 1 + len(word) > most:
            rows.append(word)
        else:
            rows[-1] = f"{rows[-1]} {word}".strip()
    return rows
