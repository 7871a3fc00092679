"""A robot file as a tree of XML elements, with its comments, and its elements by name."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from unmodelled.systems.robot.compile import plain_name


class _Kept(ET.TreeBuilder):
    """Builder of a tree with the comments in it, and those before its root."""

    def __init__(self) -> None:
        super().__init__(insert_comments=True, insert_pis=True)
        self.before: list[str] = []
        self._begun = False

    def start(self, tag: str, attrs: dict[str, str], /) -> ET.Element:
        self._begun = True
        return super().start(tag, attrs)

    def comment(self, text: str | None, /) -> ET.Element[Any]:
        if self._begun:
            return super().comment(text)
        self.before.append(f"<!--{text}-->")
        return ET.Comment(text)


@dataclass(frozen=True)
class RobotTree:
    """Elements of an MJCF or URDF file."""

    root: ET.Element
    before: tuple[str, ...]  # declaration of the file and comments before the root
    elements: dict[str, dict[str, ET.Element]]  # by kind (body, joint, actuator) and by name as in `compiled`

    @classmethod
    def of(cls, text: str) -> RobotTree:
        """Return the tree of a robot file that `compiled` accepts."""
        builder = _Kept()
        root = ET.fromstring(text, ET.XMLParser(target=builder))
        if root.tag == "robot":
            found = {"body": root.findall("link"), "joint": root.findall("joint"), "actuator": []}
        else:
            bodies = [body for world in root.findall("worldbody") for body in _bodies(world)]
            joints = [joint for body in bodies for joint in _inside(body, "joint")]
            actuators = [e for e in root.findall("actuator/*") if isinstance(e.tag, str)]  # no comments
            found = {"body": bodies, "joint": joints, "actuator": actuators}
        named = {
            # MuJoCo's first body is the world
            kind: {plain_name(e.get("name") or f"{kind}{k}"): e for k, e in enumerate(elements, start=1)}
            for kind, elements in found.items()
        }
        declared = ['<?xml version="1.0" encoding="utf-8"?>'] if text.startswith("<?xml") else []
        return cls(root, (*declared, *builder.before), named)

    @property
    def urdf(self) -> bool:
        """Whether it is a URDF file."""
        return self.root.tag == "robot"

    @property
    def degrees(self) -> bool:
        """Whether angles are in degrees, as they are in MJCF unless it says otherwise."""
        given = [c.get("angle") for c in self.root.findall("compiler") if c.get("angle")]
        return not self.urdf and (not given or given[-1] == "degree")

    def __str__(self) -> str:
        return "\n".join([*self.before, ET.tostring(self.root, encoding="unicode"), ""])


def _bodies(holder: ET.Element) -> Iterator[ET.Element]:
    """Bodies in the order in which MuJoCo numbers them; a frame is no body."""
    for element in holder:
        if element.tag == "body":
            yield element
        if element.tag in ("body", "frame"):
            yield from _bodies(element)


def _inside(body: ET.Element, tag: str) -> Iterator[ET.Element]:
    for element in body:
        if element.tag == tag:
            yield element
        elif element.tag == "frame":
            yield from _inside(element, tag)


def row(*numbers: float) -> str:
    """Return numbers as an attribute holds them, with ten digits."""
    return " ".join(f"{number + 0.0:.10g}" for number in numbers)
