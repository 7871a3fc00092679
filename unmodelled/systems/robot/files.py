"""Reader of robot files: MJCF (MuJoCo) and URDF, compiled by MuJoCo.

MuJoCo gets what the equations of motion need and no more: nothing outside the file is read, and no mesh.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from unmodelled.base.errors import BadInput, first_few
from unmodelled.base.limits import check_file
from unmodelled.systems.robot.inertials import Inertial, inertials, value_of

#: Largest robot file, bytes.
LARGEST = 10_000_000
#: Parts of an MJCF file that its dynamics do not need.
_UNNEEDED = frozenset(
    {"asset", "visual", "statistic", "sensor", "keyframe", "contact", "custom", "size", "site", "camera"}
    | {"light", "material", "mesh", "texture", "pair", "hfield", "skin", "numeric", "text"}
    | {"tendon"}
)
#: Parts of an MJCF file that change its dynamics in ways that the equations here cannot follow.
_REFUSED = {
    "include": "copy what the file includes into it",
    "extension": "remove the plugin",
    "plugin": "remove the plugin",
    "attach": "write the attached bodies out",
    "composite": "write its bodies out",
    "flexcomp": "remove the deformable body",
    "deformable": "remove the deformable body",
    "replicate": "write the repeated bodies out",
}
_REFUSED_TYPES = {"floating", "planar", "ball", "spherical"}
#: Elements that hold each other, how many of them are read, and how many inside each other.
_NESTED, MOST_BODIES, DEEPEST = frozenset({"body", "link", "frame", "default"}), 1000, 200
_PLACES = ("meshdir", "texturedir", "assetdir", "fusestatic")


def robot_text(path: Path) -> str:
    """Read a robot file as text."""
    check_file(path)
    try:
        if path.stat().st_size > LARGEST:
            raise BadInput(
                f"{path}: has more than {LARGEST} bytes: remove what moves nothing, such as meshes"
            )
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput(f"{path}: not UTF-8 text: save the file in UTF-8") from None
    except OSError as error:
        raise BadInput(
            f"{path}: cannot be read: {error.strerror}: check the path and its permissions"
        ) from None


@dataclass(frozen=True)
class Needed:
    """Part of a robot file that its dynamics need."""

    #: MJCF or URDF without meshes, references to other files and `mimic`; inertias of a URDF are replaced
    text: str
    urdf: bool
    inertials: Mapping[str, Inertial]  # mass properties of the links of a URDF, by name
    #: joint that each joint of a URDF follows (None: it does not move), ratio and offset
    mimics: Mapping[str, tuple[str | None, float, float]]
    notes: tuple[str, ...] = ()  # sentences on what was not used

    @classmethod
    def of(cls, text: str, where: str) -> Needed:
        """Return what the dynamics need of a robot file."""
        root = _root(text, where)
        if root.tag != "robot":
            _strip_mjcf(root, where)
            return cls(ET.tostring(root, encoding="unicode"), False, {}, {})
        masses = inertials(root, where)
        mimics, notes = _mimics(root, where)
        _strip_urdf(root, where)
        return cls(ET.tostring(root, encoding="unicode"), True, masses, mimics, tuple(notes))


def _root(text: str, where: str) -> ET.Element:
    """The checked tree of a robot file."""
    if re.search(r"<!(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise BadInput(f"{where}: a robot file has no DOCTYPE and no entities: remove them")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise BadInput(f"{where}: line {error.position[0]}: not an XML file: {error}") from None
    for element in root.iter():
        if "xacro" in element.tag:
            raise BadInput(f"{where}: {element.tag.split('}')[-1]}: a xacro file: expand it with xacro first")
    if root.tag not in ("mujoco", "robot"):
        raise BadInput(f"{where}: must begin with <mujoco> (MJCF) or <robot> (URDF), got <{root.tag[:40]}>")
    # what ROS and simulators add to a URDF, plugins for instance, is not read
    refused = _REFUSED if root.tag == "mujoco" else {"include"}
    for element in root.iter():
        if element.tag.lower() in refused:  # MuJoCo includes files whatever the case of the letters
            raise BadInput(f"{where}: {named(element)}: cannot be followed: {_REFUSED[element.tag.lower()]}")
    nested = sum(element.tag in _NESTED for element in root.iter())
    if nested > MOST_BODIES:
        raise BadInput(
            f"{where}: has {nested} bodies, at most {MOST_BODIES} are read: remove what moves nothing"
        )
    level = [root]
    for _ in range(DEEPEST):
        level = [element for parent in level for element in parent]
    if level:
        words = f"at most {DEEPEST} elements inside each other are read: remove frames around bodies"
        raise BadInput(f"{where}: {named(level[0])}: {words}")
    return root


def named(element: ET.Element) -> str:
    """Return an element with its name, for a message."""
    name = element.get("name") or element.get("joint") or element.get("class")
    return f"{element.tag} {name!r}" if name else element.tag


def _strip_urdf(root: ET.Element, where: str) -> None:
    for joint in root.iter("joint"):
        kind = joint.get("type", "")
        if kind in _REFUSED_TYPES:
            words = (
                "has no equations here: write type fixed (the base then stands still), or hinges and slides"
            )
            raise BadInput(f"{where}: {named(joint)}: of type {kind}: {words}")
    links = {link.get("name", "") for link in root.findall("link")}
    for joint in root.findall("joint"):
        ends = [end.get("link") for end in (joint.find("parent"), joint.find("child")) if end is not None]
        if len(ends) < 2 or None in ends:
            words = "has no parent or no child: name both links, or remove it"
            raise BadInput(f"{where}: {named(joint)}: {words}")
        if ends[1] not in links:
            words = f"the file has no link {str(ends[1])[:40]!r}, its child: correct the name"
            raise BadInput(f"{where}: {named(joint)}: {words}")
    for element in [*root]:
        if element.tag not in ("link", "joint"):
            root.remove(element)
    for name in (parent.get("link", "") for parent in root.findall("joint/parent")):
        if name not in links:  # often that of the world
            links.add(name)
            ET.SubElement(root, "link", name=name)
    for link in root.iter("link"):
        for element in [*link]:
            if element.tag != "inertial":
                link.remove(element)
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", fusestatic="false")


def _mimics(root: ET.Element, where: str) -> tuple[dict[str, tuple[str | None, float, float]], list[str]]:
    """Joints that follow another one, and notes on those that are fixed and follow none."""
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    fixed = [name for name, joint in joints.items() if joint.get("type") == "fixed"]
    found: dict[str, tuple[str | None, float, float]] = {}
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is None or name in fixed:
            continue
        leader = mimic.get("joint", "")
        if leader not in joints:
            words = "correct the name of the joint that it follows, or remove mimic"
            raise BadInput(f"{where}: {named(joint)}: mimic: the file has no joint {leader[:40]!r}: {words}")
        own = f"{where}: {named(joint)}: mimic"
        ratio, offset = (value_of(mimic.get(k, d), own, k) for k, d in (("multiplier", "1"), ("offset", "0")))
        found[name] = (None, 0.0, offset) if leader in fixed else (leader, ratio, offset)
    idle = [name for name in fixed if joints[name].find("mimic") is not None]
    words = "it is not used, because these joints are fixed"
    return found, [f"mimic of {first_few(idle)}: {words}"] if idle else []


def _strip_mjcf(root: ET.Element, where: str) -> None:
    for constraints in root.findall("equality"):
        for constraint in [*constraints]:
            if constraint.get("active") == "false":
                constraints.remove(constraint)
            elif constraint.tag != "joint":
                words = "a closed chain has no equations here: remove it, or lock a joint"
                raise BadInput(f"{where}: equality {named(constraint)}: {words}")
    for tendon in root.findall("tendon/*"):
        raise BadInput(f"{where}: tendon {named(tendon)}: has no equations here: remove it")
    for actuator in root.findall("actuator/*"):
        if actuator.get("joint") is None and actuator.get("jointinparent") is None:
            words = "only actuators of a joint have equations here: remove it"
            raise BadInput(f"{where}: actuator {named(actuator)}: {words}")
    for compiler in root.findall("compiler"):
        for key in _PLACES:
            compiler.attrib.pop(key, None)
    for world in root.findall("worldbody"):
        for holder in _holders(world):
            for geom in holder.findall("geom"):
                holder.remove(geom)
    from_geoms = any(c.get("inertiafromgeom") == "true" for c in root.findall("compiler"))
    for parent in [*root.iter()]:
        if parent.tag == "body":
            _strip_geoms(parent, from_geoms, where)
        for element in [*parent]:
            if element.tag in _UNNEEDED:
                parent.remove(element)
    for geom in root.iter("geom"):
        for key in ("material", "mesh", "hfield"):
            geom.attrib.pop(key, None)
        if geom.get("type") in ("mesh", "hfield", "sdf"):
            geom.attrib.pop("type")


def _strip_geoms(body: ET.Element, from_geoms: bool, where: str) -> None:
    """Remove the geoms of a body whose mass is given; the mass of the others comes from their geoms."""
    for holder in _holders(body):
        for geom in holder.findall("geom"):
            if body.find("inertial") is not None and not from_geoms:
                holder.remove(geom)
            elif geom.get("mesh") or geom.get("hfield"):
                words = "its mass comes from a mesh, which is not read: give it an inertial"
                raise BadInput(f"{where}: {named(body)}: {words}")


def _holders(body: ET.Element) -> Iterator[ET.Element]:
    """A body and the frames in it, which may hold its geoms."""
    yield body
    for frame in body.findall("frame"):
        yield from _holders(frame)
