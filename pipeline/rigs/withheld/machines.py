"""The machines of the withheld check."""

from __future__ import annotations

from pipeline.rigs.withheld.belt_axis import BeltAxis
from pipeline.rigs.withheld.cam_drive import CamDrive
from pipeline.rigs.withheld.cell import Cell
from pipeline.rigs.withheld.column import Column
from pipeline.rigs.withheld.hoist import Hoist
from pipeline.rigs.withheld.hotplate import Hotplate
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.pendulum import Pendulum
from pipeline.rigs.withheld.slider_crank import SliderCrank
from pipeline.rigs.withheld.vessel import Vessel
from pipeline.rigs.withheld.winding import Winding

MACHINES: tuple[Machine, ...] = (SliderCrank(), CamDrive(), Hoist(), BeltAxis(), Pendulum())
#: Machines without inertia, which have cases of their own.
BALANCES: tuple[Machine, ...] = (Vessel(), Column(), Hotplate(), Winding(), Cell())
