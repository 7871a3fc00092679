"""Parameters by CMA-ES: armature, viscous and dry friction, bias and delay of the joints, as in PACE."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.head_to_head.joints import BIAS, DELAY, JointFit
from benchmarks.head_to_head.method import Model
from unmodelled.diagnosis.data.study import Study

#: Step size at the start in plausible sizes, simulations at most, CPU seconds at most.
SIGMA, EVALUATIONS, SECONDS = 0.3, 6000, 150.0
#: Families of the parameters of PACE.
FAMILIES = ("inertia_error", "viscous_friction", "coulomb_friction", BIAS, DELAY)


class CmaEs:
    """CMA-ES (package cma) over the mean square error of the free runs of the training experiments."""

    name, needs = "CMA-ES (PACE)", ("cma",)

    def fit(self, study: Study) -> Model:
        import cma

        joints = JointFit.of(study, FAMILIES)
        low, high = joints.bounds
        options = {
            "bounds": [low.tolist(), high.tolist()],
            "seed": study.seed + 1,
            "maxfevals": EVALUATIONS,
            "tolfun": 1e-9,
            "tolfunhist": 1e-10,
            "tolx": 1e-6,
            "verbose": -9,
        }
        evolution, begun = cma.CMAEvolutionStrategy(joints.start, SIGMA, options), time.process_time()
        while not evolution.stop() and time.process_time() - begun < SECONDS:
            points = evolution.ask()
            square = np.mean(joints.errors(np.array(points)) ** 2, axis=0)
            evolution.tell(points, square.tolist())
        why = ", ".join(evolution.stop()) or f"{SECONDS:.0f} s of CPU time"
        found = np.clip(evolution.result.xbest, low, high)
        return joints.model(found, f"{evolution.result.evaluations} simulations, stopped by {why}")
