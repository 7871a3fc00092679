"""The machines of the withheld check."""

from __future__ import annotations

from pipeline.rigs.withheld.belt_axis import BeltAxis
from pipeline.rigs.withheld.cam_drive import CamDrive
from pipeline.rigs.withheld.cell import Cell
from pipeline.rigs.withheld.column import Column
from pipeline.rigs.withheld.further.ball_beam import BallBeam
from pipeline.rigs.withheld.further.ball_screw import BallScrew
from pipeline.rigs.withheld.further.buck_converter import BuckConverter
from pipeline.rigs.withheld.further.cart_pendulum import CartPendulum
from pipeline.rigs.withheld.further.coupled_drive import CoupledDrive
from pipeline.rigs.withheld.further.coupled_tanks import CoupledTanks
from pipeline.rigs.withheld.further.heated_block import HeatedBlock
from pipeline.rigs.withheld.further.hydraulic_cylinder import HydraulicCylinder
from pipeline.rigs.withheld.further.magnet import Magnet
from pipeline.rigs.withheld.further.mass_chain import MassChain
from pipeline.rigs.withheld.further.rotary_pendulum import RotaryPendulum
from pipeline.rigs.withheld.further.rotary_servo import RotaryServo
from pipeline.rigs.withheld.further.servo_valve import ServoValve
from pipeline.rigs.withheld.further.thrust_stand import ThrustStand
from pipeline.rigs.withheld.further.two_link_arm import TwoLinkArm
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
#: Machines of other kinds, with inertia and without, which have cases of their own. One more machine in a
#: tuple changes the cases of its kinds, to which published rows refer.
FURTHER: tuple[Machine, ...] = (
    RotaryServo(),
    CoupledDrive(),
    BallScrew(),
    CartPendulum(),
    TwoLinkArm(),
    RotaryPendulum(),
    Magnet(),
    MassChain(),
    BallBeam(),
    HydraulicCylinder(),
    ThrustStand(),
    CoupledTanks(),
    HeatedBlock(),
    BuckConverter(),
    ServoValve(),
)
EVERY: tuple[Machine, ...] = (*MACHINES, *BALANCES, *FURTHER)
