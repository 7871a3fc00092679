"""Flexible transmission: a shaft, belt or joint that twists between a port and the body that it moves."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from unmodelled.effects.body_behind import BodyBehind
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Fixed, Shape, Told
from unmodelled.effects.place import Site

#: Periods of the slowest frequency from which a fit starts, in the longest experiment.
_CYCLES = 4.0
#: Damping ratios from which a fit starts, and the range of all.
_RATIOS, _ALL_RATIOS = (0.05,), (1e-4, 2.0)


class _OnSpring(BodyBehind):
    kind = "play"
    family = "flexible_transmission"
    pushed = "omega_f**2*(x - x_b) + 2*zeta*omega_f*(v - v_b)"
    # of the body while the port stands still, as a tap on it with the drive held shows it
    told: ClassVar[Mapping[str, Told]] = {
        "omega_f": Told("resonance", "{0}/(2*pi)", 0.5 / np.pi, "Hz"),
        "zeta": Told("damping ratio"),
    }
    phrase = "resonance at {omega_f}, damping ratio {zeta}"

    def connection(self, at: Site) -> tuple[dict[str, Shape], dict[str, Fixed]]:
        slowest, fastest = 2.0 * np.pi * _CYCLES / at.duration, 1.0 / at.period
        frequencies = geometric(slowest, fastest, 28)
        return {
            "omega_f": Shape("1/t", frequencies, (0.5 * slowest, fastest)),
            "zeta": Shape("1", _RATIOS, _ALL_RATIOS),
        }, {}


class PartOnSpring(_OnSpring):
    """Part of the known mass on a spring with damping, such as the load behind an elastic shaft."""

    variant = "part"
    is_part = True


class LoadOnSpring(_OnSpring):
    """Additional mass on a spring with damping."""

    variant = "load"
    is_part = False
