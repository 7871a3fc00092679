"""Masses and inertias of the links of a URDF file, as they are written.

MuJoCo refuses a file with one number that no solid body has, such as the placeholders of links that never
move. The equations of motion need less: positive inertias of what the joints move. Hence MuJoCo compiles the
file with the inertias of a body of its own, and gets the numbers of the file afterwards.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

#: Largest number of a robot file, SI.
LARGEST_NUMBER = 1e100
#: Share by which a principal moment may exceed the sum of the others: rounding of the file.
_ROUNDED = 1e-6
#: Any body whose frame is not that of its inertia, so that MuJoCo's model has no shortcut for it.
_SOME = {"origin": {"xyz": "0.1 0.2 0.3", "rpy": "0.4 0.5 0.6"}, "mass": {"value": "1"}}
_SOME |= {"inertia": {"ixx": "1", "iyy": "1.1", "izz": "1.2", "ixy": "0", "ixz": "0", "iyz": "0"}}


@dataclass(frozen=True)
class Inertial:
    """Mass properties of a link."""

    mass: float  # kg
    com: Array  # (3,), centre of mass in the frame of the link, m
    moments: Array  # (3,), principal moments of inertia about the centre of mass, kg m^2
    axes: Array  # (3, 3), matrix from the principal axes to the frame of the link

    @property
    def possible(self) -> bool:
        """Whether a solid body has such moments of inertia."""
        a, b, c = np.sort(self.moments)
        return bool(self.mass >= 0.0 and a >= -_ROUNDED * abs(c) and a + b >= (1.0 - _ROUNDED) * c)


def inertials(root: ET.Element, where: str) -> dict[str, Inertial]:
    """Return the mass properties of the links of a URDF by name, and replace them by those of some body.

    `boundmass`, `boundinertia` and `balanceinertia` of `compiler` mend them as in MuJoCo.
    """
    found = {}
    mended = {key: text for each in root.findall("mujoco/compiler") for key, text in each.attrib.items()}
    for link in root.findall("link"):
        name = link.get("name", "")
        found[name] = _mended(_inertial(link, f"{where}: link {name!r}"), mended, where)
        for element in link.findall("inertial"):
            link.remove(element)
        some = ET.SubElement(link, "inertial")
        for tag, attributes in _SOME.items():
            ET.SubElement(some, tag, attributes)
    return found


def set_inertials(model: Any, found: Mapping[str, Inertial]) -> None:
    """Set the mass properties of the links in a model of MuJoCo."""
    import mujoco

    for name, inertial in found.items():
        k = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if k > 0:  # 0 is the world
            model.body_mass[k], model.body_ipos[k] = inertial.mass, inertial.com
            model.body_inertia[k] = inertial.moments
            mujoco.mju_mat2Quat(model.body_iquat[k], inertial.axes.ravel())


def _inertial(link: ET.Element, where: str) -> Inertial:
    inertial = link.find("inertial")
    if inertial is None:
        return Inertial(0.0, np.zeros(3), np.zeros(3), np.eye(3))
    mass = _number(_child(inertial, "mass"), "value", None, where)
    origin = _child(inertial, "origin")
    x = [_row(origin, key, where) for key in ("xyz", "rpy")]
    tensor, inertia = np.zeros((3, 3)), inertial.find("inertia")
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)) if inertia is not None else ():
        assert inertia is not None
        key = f"i{'xyz'[i]}{'xyz'[j]}"
        tensor[i, j] = tensor[j, i] = _number(inertia, key, None if i == j else "0", where)
    moments, axes = np.linalg.eigh(tensor)
    axes = _turned(x[1]) @ axes
    return Inertial(mass, x[0], moments, axes if np.linalg.det(axes) > 0.0 else -axes)


def _mended(inertial: Inertial, how: Mapping[str, str], where: str) -> Inertial:
    bounds = (value_of(how.get(k, "0"), f"{where}: compiler", k) for k in ("boundmass", "boundinertia"))
    least_mass, least_moment = bounds
    mass = max(inertial.mass, least_mass) if least_mass else inertial.mass
    moments = np.maximum(inertial.moments, least_moment) if least_moment else inertial.moments
    if how.get("balanceinertia") == "true" and moments[0] + moments[1] < moments[2]:
        moments = np.full(3, moments.mean())
    return Inertial(mass, inertial.com, moments, inertial.axes)


def _child(parent: ET.Element, tag: str) -> ET.Element:
    found = parent.find(tag)
    return ET.Element(tag) if found is None else found


def _number(element: ET.Element, key: str, default: str | None, where: str) -> float:
    text = element.get(key, default)
    if text is None:
        raise BadInput(f"{where}: {element.tag} has no {key}: add it, or remove the inertial of the link")
    return value_of(text, f"{where}: {element.tag}", key)


def _row(element: ET.Element, key: str, where: str) -> Array:
    texts = element.get(key, "0 0 0").split()
    if len(texts) != 3:
        raise BadInput(f"{where}: {element.tag} {key}: must be three numbers, got {len(texts)}")
    return np.array([value_of(text, f"{where}: {element.tag}", key) for text in texts])


def value_of(text: str, where: str, key: str) -> float:
    """Return the number of an attribute."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < LARGEST_NUMBER:
        raise BadInput(f"{where} {key}: must be a finite number, got {text[:40]!r}: correct it")
    return value


def _turned(rpy: Array) -> Array:
    """Matrix of a rotation by roll, pitch and yaw about fixed axes."""
    (a, b, c), (x, y, z) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [b * c, x * y * c - a * z, a * y * c + x * z],
            [b * z, x * y * z + a * c, a * y * z - x * c],
            [-y, x * b, a * b],
        ]
    )
