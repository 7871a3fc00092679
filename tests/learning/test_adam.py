"""Adam steps as torch's own does, and loads no compiler."""

from __future__ import annotations

import subprocess
import sys

import pytest
import torch

from unmodelled.learning.adam import Adam

LOADED = """
import sys, torch
from unmodelled.learning.adam import Adam
weights = torch.nn.Parameter(torch.ones(3))
optimiser = Adam([weights], lr=0.1)
optimiser.zero_grad()
weights.square().sum().backward()
optimiser.step()
print(*sorted({name.split(".")[1] for name in sys.modules if name.startswith("torch.")}))
"""


def trained(optimiser: type[torch.optim.Optimizer]) -> list[torch.Tensor]:
    """Weights after some steps with two groups and a falling rate."""
    generator = torch.Generator().manual_seed(0)
    weights = [torch.nn.Parameter(torch.randn(n, generator=generator)) for n in (5, 3)]
    adam = optimiser([{"params": [w]} for w in weights], lr=0.1)  # type: ignore[call-arg]
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(adam, 10)
    for _ in range(10):
        adam.zero_grad()
        sum(w.pow(4).sum() for w in weights).backward()  # type: ignore[union-attr]
        adam.step()
        schedule.step()
    return [w.detach() for w in weights]


def test_the_steps_are_those_of_torch() -> None:
    assert all(torch.equal(a, b) for a, b in zip(trained(Adam), trained(torch.optim.Adam), strict=True))


@pytest.mark.long
def test_no_compiler_is_loaded() -> None:
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    assert "optim" in done.stdout.split() and "_dynamo" not in done.stdout.split()
