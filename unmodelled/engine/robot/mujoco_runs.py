"""Free runs of a robot file in MuJoCo: a backend of `free_run`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import ceil
from typing import Any

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.engine.free_run import Integration, Sizes, Windows
from unmodelled.engine.machine.program import Program
from unmodelled.engine.robot.supplement import Supplement
from unmodelled.systems.model import System
from unmodelled.systems.robot.compile import compiled, plain_name, written_names
from unmodelled.systems.robot.loading import loaded

#: Coordinates (rad, m) and speeds beyond which a run has diverged; MuJoCo resets a run far beyond.
_LOST = 1e6
#: Inertia (kg m^2) or mass (kg) of a locked joint, which no torque moves.
_HELD = 1e10


@dataclass(frozen=True)
class RobotInMujoco:
    """Robot file with what it gets beside it, and how the inputs of a system drive it."""

    text: str  # content of the file; contacts and limits of joints are left out, as in the equations
    name: str  # name of the file, for messages
    controls: Sequence[str]  # inputs of actuators; those of other actuators are zero and without effect
    applied: Mapping[str, sp.Expr]  # effort on a joint that no actuator of the file drives
    locked: Mapping[str, float] = field(default_factory=dict)  # rad or m, by names of the file
    supplement: Supplement = field(default_factory=Supplement)
    #: state that is the activation of an actuator with a time constant, by the input of the actuator
    activations: Mapping[str, str] = field(default_factory=dict)

    def __call__(self, system: System, observed: Sequence[sp.Expr]) -> MujocoRuns:
        """Return the backend that runs the file in place of the equations of a system."""
        return MujocoRuns(self, system, observed)


class MujocoRuns:
    """Free runs in MuJoCo with the integrator of the file, and its time step or a little less.

    States of the system that the robot does not have, such as the memory of a sensor or the lag of a drive,
    are integrated beside it by Heun's method, as far as observed values or efforts depend on them. States
    that the supplement remembers by have their names in the system.
    """

    def __init__(self, robot: RobotInMujoco, system: System, observed: Sequence[sp.Expr]) -> None:
        import mujoco

        self.model = model = loaded(robot.text, robot.name).model
        written = written_names(model, "joint")
        held = [written.index(name) for name in robot.locked]
        self.held, self.at = model.jnt_qposadr[held], [*robot.locked.values()]
        model.dof_armature[model.jnt_dofadr[held]] = _HELD
        # a joint that is locked follows no other one, and moves none
        model.eq_active0[np.isin(model.eq_obj1id, held) | np.isin(model.eq_obj2id, held)] = 0
        self.forces = robot.supplement.complete(model, robot.name)
        # what hits what is not known without meshes; a run that is lost must not begin again
        flags = mujoco.mjtDisableBit
        model.opt.disableflags |= int(flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_AUTORESET)
        self.step = float(model.opt.timestep)
        self.observed = Program.of(system, observed)
        self.applied = Program.of(system, [*robot.applied.values()])
        names = [state.name for state in system.states]
        joints = [plain_name(name) for name in written]
        moving = [k for k, name in enumerate(joints) if f"q_{name}" in names]
        self.q, self.qd = ([names.index(f"{s}_{joints[k]}") for k in moving] for s in ("q", "qd"))
        self.places, self.dofs = model.jnt_qposadr[moving], model.jnt_dofadr[moving]
        locked = dict(zip(held, self.at, strict=True))
        self.gears = compiled(robot.text, robot.name).following(locked)
        self.to = model.jnt_dofadr[[joints.index(name) for name in robot.applied]]
        inputs = [item.name for item in system.inputs]
        actuators = [f"u_{plain_name(name)}" for name in written_names(model, "actuator")]
        self.controls = [actuators.index(name) for name in robot.controls]
        self.u = [inputs.index(name) for name in robot.controls]
        slow = [k for k in np.flatnonzero(model.actuator_actadr >= 0) if actuators[k] in robot.activations]
        self.activated = model.actuator_actadr[slow]
        self.a = [names.index(robot.activations[actuators[k]]) for k in slow]
        self.z = [names.index(name) for name in robot.supplement.rates]
        of_robot = {system.x[k] for k in (*self.q, *self.qd, *self.a, *self.z)}
        self.beside = system.states_behind([*observed, *robot.applied.values()], of_robot)
        self.rates = Program.of(system, [system.dynamics[k] for k in self.beside])
        off = [k for k, name in enumerate(actuators) if name not in robot.controls]
        model.actuator_gainprm[off], model.actuator_biasprm[off] = 0.0, 0.0

    @property
    def sizes(self) -> Sizes:
        """Numbers of states, inputs, parameters and constants of the equations."""
        return self.observed.sizes

    def run(self, windows: Windows, p: Array, c: Array, x0: Array, how: Integration) -> Array:
        """Simulate checked windows; for the shapes of (p, c, x0) see `Backend.run`."""
        longest = int(windows.steps.max(initial=0)) + 1
        y = np.full((*x0.shape[:2], longest, len(self.observed.shown)), np.nan)
        hold = np.broadcast_to(np.asarray(how.hold, np.float64), windows.u.shape[1])
        with _quiet(self.forces):
            for (w, i), _ in np.ndenumerate(y[:, :, 0, 0]):
                rows = slice(windows.start[w], windows.start[w] + windows.steps[w] + 1)
                u, owner = windows.u[windows.shift[i] :][rows], windows.owner[w]
                x = self._states(windows.t[rows], u, x0[w, i], p[owner, i], c[owner], hold, how.period)
                known = windows.t[rows], x, u, p[owner, i], c[owner]
                y[w, i, : len(x)] = self.observed.evaluate(*known)
        return y

    def _states(self, t: Array, u: Array, x0: Array, p: Array, c: Array, hold: Array, period: float) -> Array:
        """States at the samples, shape (samples, states); nan from where the run is lost."""
        import mujoco

        substeps = ceil(period / self.step * (1.0 - 1e-9))
        self.model.opt.timestep = period / substeps
        data, x = mujoco.MjData(self.model), np.full((len(t), len(x0)), np.nan)
        x[0] = x0
        data.qpos[self.held] = self.at
        data.qpos[self.places], data.qvel[self.dofs], data.time = x0[self.q], x0[self.qd], t[0]
        for k, gear in self.gears.items():
            data.qpos[k] = gear.ratio * data.qpos[gear.leader] + gear.offset
            data.qvel[k] = gear.ratio * data.qvel[gear.leader]
        data.act[self.activated] = x0[self.a]
        self.forces.begin(t[0], x0[self.z])
        state = x0
        later = np.vstack([u[1:], u[-1:]])
        for k in range(1, len(t)):
            for s in range(substeps):
                now = u[k - 1] + hold * (later[k - 1] - u[k - 1]) * (s + 0.5) / substeps
                data.ctrl[self.controls] = now[self.u]
                state = self._step(data, state, now, p, c)
            state = self._state(data, state)
            x[k] = state
            if not np.max(np.abs(x[k, [*self.q, *self.qd]])) < _LOST:
                x[k] = np.nan
                break
        return x

    def _step(self, data: Any, state: Array, u: Array, p: Array, c: Array) -> Array:
        """All states, shape (states,), after a step; those of MuJoCo only where something depends on them."""
        import mujoco

        if len(self.to):
            data.qfrc_applied[self.to] = self.applied.evaluate(np.array(data.time), state, u, p, c)
        if not self.beside:
            mujoco.mj_step(self.model, data)
            return self._state(data, state) if len(self.to) else state
        step = self.model.opt.timestep
        rates = self.rates.evaluate(np.array(data.time), state, u, p, c)
        mujoco.mj_step(self.model, data)
        state = self._state(data, state)
        state[self.beside] += step * rates
        after = self.rates.evaluate(np.array(data.time), state, u, p, c)
        state[self.beside] += 0.5 * step * (after - rates)
        return state

    def _state(self, data: Any, before: Array) -> Array:
        """All states, shape (states,): those of MuJoCo, and the others as before."""
        state = before.copy()
        state[self.q], state[self.qd] = data.qpos[self.places], data.qvel[self.dofs]
        state[self.a], state[self.z] = data.act[self.activated], self.forces.memory
        return state


@contextmanager
def _quiet(forces: Any) -> Iterator[None]:
    """Run MuJoCo with passive forces and without its warnings, which it would write to a file."""
    import mujoco

    before = mujoco.get_mjcb_passive(), mujoco.get_mju_user_warning()
    mujoco.set_mjcb_passive(forces)
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mjcb_passive(before[0])
        mujoco.set_mju_user_warning(before[1])
