"""The machines of the withheld check."""

from __future__ import annotations

from pipeline.rigs.withheld.belt_axis import BeltAxis
from pipeline.rigs.withheld.cam_drive import CamDrive
from pipeline.rigs.withheld.hoist import Hoist
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.pendulum import Pendulum
from pipeline.rigs.withheld.slider_crank import SliderCrank

MACHINES: tuple[Machine, ...] = (SliderCrank(), CamDrive(), Hoist(), BeltAxis(), Pendulum())
