"""The machines of the withheld check."""

from pipeline.rigs.withheld.balances import Cell, Column, Hotplate, Vessel, Winding
from pipeline.rigs.withheld.carriages import BeltAxis, Hoist
from pipeline.rigs.withheld.cranks import CamDrive, SliderCrank
from pipeline.rigs.withheld.further.axes import BallScrew, HydraulicCylinder, Magnet, MassChain
from pipeline.rigs.withheld.further.levels import BuckConverter, CoupledTanks, HeatedBlock, ServoValve
from pipeline.rigs.withheld.further.shafts import CoupledDrive, RotaryServo, ThrustStand
from pipeline.rigs.withheld.further.swinging import BallBeam, CartPendulum, RotaryPendulum, TwoLinkArm
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.pendulum import Pendulum

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
