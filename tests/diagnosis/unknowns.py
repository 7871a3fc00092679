"""What is not known of the pendulum with friction, and its simulation on logs of a bench."""

from __future__ import annotations

from pathlib import Path

from tests.diagnosis.benches import FRICTION, Bench, pendulum
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown

B, MGL, F_C = Unknown("b", 0.0, 0.1, 0.03), Unknown("mgl", 0.2, 5.0, 0.9), Unknown("F_c", 0.0, 1.0, 0.05)


def simulation_of(folder: Path, bench: Bench, *changes: tuple[str, str]) -> Simulation:
    """The pendulum with friction and other changes of its file, on logs of the bench."""
    system = pendulum(folder, *FRICTION, *changes)
    return Simulation(system, Recording.of(bench.logs(folder / "logs", system), 0.1))
