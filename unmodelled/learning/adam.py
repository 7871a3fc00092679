"""Adam of torch, without the compiler of torch."""

from __future__ import annotations

import torch
from torch.optim import Optimizer


class Adam(torch.optim.Adam):
    """Adam whose first step does not load torch's compiler, which takes longer than a short training.

    Steps of `torch.optim` are wrapped for `torch.compile`, which nothing here uses. The steps within the
    wrappers are the same.
    """

    add_param_group = Optimizer.add_param_group.__wrapped__  # type: ignore[attr-defined]
    zero_grad = Optimizer.zero_grad.__wrapped__  # type: ignore[attr-defined]
    step = torch.no_grad()(torch.optim.Adam.step.__wrapped__)  # type: ignore[attr-defined]
