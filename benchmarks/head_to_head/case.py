"""Machines of the comparison: published ones with a part of their physics withheld, and virtual ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unmodelled.base.files import read_json
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.faults.duplicates import different
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import several
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[2] / "systems"
#: Published machines, the short ones first.
MACHINES = ("ur10e_joint", "so101", "xl330", "cascaded_tanks", "double_pendulum", "emps", "silverbox")
#: System file of the double pendulum by the URDF of its authors, see docs/own_data.
URDF = """schema: system/1
name: double_pendulum
model: double_pendulum.urdf
inputs: {tau_Joint1: {column: u1}, tau_Joint2: {column: u2}}
outputs: {q_Joint1: {column: q1}, q_Joint2: {column: q2}, qd_Joint1: {column: v1}, qd_Joint2: {column: v2}}
"""


@dataclass(frozen=True)
class Case:
    """A machine with its logs."""

    name: str  # of the machine and of what is withheld
    system: Path
    logs: Path
    truth: dict[str, Any] | None = None  # content of truth.json of a virtual machine
    robot: bool = False

    def study(self) -> Study:
        """Read system and logs, and hold out the experiments that the diagnosis holds out (seed 0)."""
        system = read_system(self.system)
        logs = different(several(system, read_logs(self.logs, system)))
        return Study.of(system, logs, horizon_of(logs, None), 0)


def measured(logs: Path, robot: Path | None = None) -> Iterator[Case]:
    """Yield the published machines whose logs <machine>/logs, as `acquire` writes them, are in a folder.

    `robot` is a folder with double_pendulum.urdf and double_pendulum.yaml (`URDF`).
    """
    if robot is not None:
        folder = logs / "double_pendulum" / "logs"
        yield Case("double_pendulum/urdf", robot / "double_pendulum.yaml", folder, robot=True)
    for machine in MACHINES:
        for system in sorted((SYSTEMS / machine).glob("*_withheld.yaml")):
            folder = logs / machine / "logs"
            if folder.exists():
                yield Case(f"{machine}/{system.stem.removesuffix('_withheld')}", system, folder)


def virtual(cases: Path) -> Iterator[Case]:
    """Yield virtual machines with withheld effects, as `acquire source=withheld_campaign` writes them."""
    for truth in sorted(cases.glob("*/truth.json")):
        folder = truth.parent
        yield Case(f"virtual/{folder.name}", folder / "system.yaml", folder / "logs", read_json(truth))
