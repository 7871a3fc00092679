"""Hybrid models of a system file: which networks, which trained parameters, and how they are trained."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from unmodelled.base.arrays import Indices
from unmodelled.base.errors import BadInput
from unmodelled.engine.free_run import Integration, Method
from unmodelled.learning.evaluation import judged
from unmodelled.learning.fit import Fit, load_stack
from unmodelled.learning.fitting import fit, start_from
from unmodelled.learning.held_out import measured_samples, surfaces
from unmodelled.learning.initial import initial_parameters, initial_weights, scales
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.recipe import Recipe, Tables, check_folds, required
from unmodelled.learning.resume import checkpoint_beside
from unmodelled.learning.rollout import Measured
from unmodelled.learning.splits import Fold, Split
from unmodelled.learning.structures import Plan, Structure
from unmodelled.learning.windows import Problem, Training
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system


@dataclass(frozen=True)
class AugmentedRecipe(Recipe):
    """A hybrid model of a system and its training.

    Tables of `evaluate` are errors, examples, efforts and surface.

    Attributes:
        networks: structure of the model: which networks sit where, see `unmodelled.learning.structures`.
        windows: settings of the training.
        identify: names of the parameters that are trained too; None: those that the system file marks.
        spread: largest relative deviation from which training starts, of every parameter that is trained;
            within its bounds; default 0.
        spread_of_fixed: largest relative deviation of the other parameters; default 0.
        method: integration method of the free run, euler or rk4; default euler.
        substeps: number of integration steps per sampling period; default 1.
        hold: interpolation of the inputs between samples, 0 (held) to 1 (linear), where the system file does
            not hold them; default 0.
    """

    networks: Structure
    windows: Training
    identify: tuple[str, ...] | None = None
    spread: float = 0.0
    spread_of_fixed: float = 0.0
    method: Method = "euler"
    substeps: int = 1
    hold: float = 0.0

    def plan(self, system: System) -> Plan:
        """Return the structure of the model for a system.

        Args:
            system: known physics.

        Returns:
            Physics, networks and trained parameters, and the penalty of every network.

        Raises:
            BadInput: when a parameter to identify does not exist, or a network does not suit the system.
        """
        names = [p.name for p in system.parameters]
        trained = system.uncertain if self.identify is None else tuple(self.identify)
        for name in trained:
            if name not in names:
                raise BadInput(f"identify: unknown parameter {name!r}, must be one of {', '.join(names)}")
        return self.networks(system, trained)

    def integration(self, system: System, period: float) -> Integration:
        """Return the integration of the free runs.

        Args:
            system: known physics.
            period: sampling period, s.

        Raises:
            BadInput: when the method is unknown, or the system holds some of its inputs only.
        """
        if self.method not in ("euler", "rk4"):
            raise BadInput(f"method must be euler or rk4, got {self.method}")
        held = [item.name for item in system.inputs if item.hold]
        if 0 < len(held) < len(system.inputs):
            raise BadInput(
                f"{system.place}: inputs: {', '.join(held)} hold their values between samples and the others "
                "do not; models are trained with all or none of them, give all inputs the same hold"
            )
        return Integration(period, self.method, self.substeps, 0.0 if held else self.hold)

    def problem(
        self, system: System, data: Measured, period: float, runs: list[Indices], seed: int
    ) -> Problem:
        """Return a stack of untrained models and the data that they are fitted to.

        Args:
            system: known physics.
            data: measured samples.
            period: sampling period, s.
            runs: training experiments of every model of the stack, each shape (experiments,); scales come
                from a model's own training experiments.
            seed: seed of the random generators; a model has the same start in a stack of any size.

        Raises:
            BadInput: when the recipe does not suit the system.
        """
        plan = self.plan(system)
        structure = plan.structure
        # a member's own source, so that it starts the same whatever the size of the stack
        sources = [np.random.default_rng([seed, member]) for member in range(len(runs))]
        p = np.stack([initial_parameters(structure, self.spread, self.spread_of_fixed, r) for r in sources])
        values = {q.name: q for q in structure.system.parameters}
        unit = np.array([abs(values[n].value) or 1.0 for n in structure.trainable])
        bounds = np.array([values[n].limits for n in structure.trainable]).reshape(-1, 2)
        scale, gain = scales(structure, data, runs, torch.from_numpy(p), period)
        weights = np.stack([initial_weights(structure, rng) for rng in sources])
        tensors = (torch.from_numpy(a) for a in (p, unit, scale, gain, weights))
        penalties = np.asarray(plan.penalties, np.float64)
        how = self.integration(system, period)
        return Problem(Nnap(structure, *tensors), data, runs, bounds, penalties, how, seed)

    def fit(
        self,
        system: System,
        logs: Logs,
        folds: list[Fold],
        repeats: int = 1,
        seed: int = 0,
        start: Nnap | None = None,
        device: str = "cpu",
        checkpoint: Path | None = None,
    ) -> Fit:
        """Fit one model per fold and repeat to the training experiments of the fold.

        Args:
            system: known physics.
            logs: measured experiments.
            folds: division of the experiments into training and test experiments.
            repeats: number of models per fold, which differ in their random start; default 1.
            seed: seed of the random generators; default 0.
            start: fitted stack of the same structure and size to continue from; default: from scratch.
            device: `cpu` for the compiled kernels (default), or a device of torch such as `cuda`.
            checkpoint: file that keeps the state of the training until it is done; default: none.

        Returns:
            The fitted stack.

        Raises:
            BadInput: when the recipe does not suit the system, the data or the stack to start from.
        """
        runs = [np.asarray(fold.train, np.int64) for fold in folds for _ in range(repeats)]
        problem = self.problem(system, measured_samples(logs), logs.period, runs, seed)
        if start is not None:
            start_from(problem, start)
        ids = {fold.name: tuple(logs.ids[run] for run in fold.train.tolist()) for fold in folds}
        return fit(problem, self.windows, ids, device, checkpoint)

    def load(self, system: System, fits: Path) -> tuple[Nnap, dict[str, Any]]:
        """Read the stack that was fitted with this recipe.

        Args:
            system: known physics.
            fits: folder of the fit.

        Returns:
            The fitted stack, and what its file says about it: `folds`, `repeats`, `seed`, ...

        Raises:
            BadInput: when the fit is missing, damaged, or belongs to another recipe.
        """
        return load_stack(self.plan(system).structure, fits / "model.pt")

    def train(
        self,
        system: Path | None,
        logs: Path | None,
        split: Split,
        profile: Mapping[str, Any],
        start: Path | None,
        device: str,
        seed: int,
        out: Path,
    ) -> None:
        system, logs = required(system, logs)
        known = read_system(system)
        measured = read_logs(logs, known)
        folds = split.folds(measured.experiments_with_speed())
        before = self.load(known, start)[0] if start is not None else None
        checkpoint = checkpoint_beside(out)
        found = self.fit(known, measured, folds, profile["system_repeats"], seed, before, device, checkpoint)
        found.save(out)
        print(found)

    def evaluate(self, system: Path | None, logs: Path | None, fits: Path, split: Split) -> Tables:
        system, logs = required(system, logs)
        known = read_system(system)
        measured = read_logs(logs, known)
        fitted, about = self.load(known, fits)
        folds = split.folds(measured.experiments_with_speed())
        check_folds(folds, about["folds"], fits / "model.pt")
        trained, tests = ({fold.name: getattr(fold, kind) for fold in folds} for kind in ("train", "test"))
        how = self.integration(known, measured.period)
        found = judged(fitted, measured, trained, tests, about["repeats"], how)
        # the first model as it was before training
        data, first = measured_samples(measured), [folds[0].train]
        initial = self.problem(known, data, measured.period, first, about["seed"]).model
        print(found)
        return found.tables() | {"surface": surfaces({"initial": initial, "converged": fitted}, measured)}
