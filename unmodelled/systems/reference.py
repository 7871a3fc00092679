"""Equations of a system as PyTorch functions: readable and differentiable on any device, but slow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy as sp
import torch
from torch import Tensor

from unmodelled.systems.model import TIME, System
from unmodelled.systems.procedure import common_parts
from unmodelled.systems.tables import Table

#: f(t, x, u, e, p, c) -> (..., k); t (...), x (..., states), u (..., inputs), e (..., ports), p (...,
#: parameters), c (..., constants of the operating point). Leading axes broadcast.
Equations = Callable[[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor], Tensor]


def torch_equations(system: System, expressions: Sequence[sp.Expr]) -> Equations:
    """Return a PyTorch function of the shape (..., k) like `numpy_system_function`, with gradients."""
    arguments = [(TIME,), system.x, system.u, system.e, system.p, system.c]
    modules = [_functions(system), vars(torch)]
    # dummify: a user's names are then never names in the code
    function = sp.lambdify(arguments, list(expressions), modules=modules, cse=common_parts, dummify=True)

    def equations(t: Tensor, x: Tensor, u: Tensor, e: Tensor, p: Tensor, c: Tensor) -> Tensor:
        rows = [tuple(a.unbind(-1)) for a in (x, u, e, p, c)]
        values = function((t,), *rows)
        shape = np.broadcast_shapes(t.shape, *(a.shape[:-1] for a in (x, u, e, p, c)))
        columns = (torch.as_tensor(v, dtype=x.dtype, device=x.device) for v in values)
        return torch.stack([column.expand(shape) for column in columns], -1)

    return equations


def _functions(system: System) -> dict[str, Callable[..., Any]]:
    tables = [_Lookup(table) for table in system.tables]
    return {
        "sgn": lambda x: torch.sign(_tensor(x)),
        "step": lambda x: 0.5 * (torch.sign(_tensor(x)) + 1.0),
        "whole": lambda x: torch.floor(_tensor(x)),
        "greater": lambda a, b: (_tensor(a) > b).to(_tensor(a).dtype),
        "at_least": lambda a, b: (_tensor(a) >= b).to(_tensor(a).dtype),
        "equal": lambda a, b: (_tensor(a) == b).to(_tensor(a).dtype),
        "absolute": lambda x: torch.abs(_tensor(x)),
        "minimum": lambda a, b: torch.minimum(_tensor(a), _tensor(b)),
        "maximum": lambda a, b: torch.maximum(_tensor(a), _tensor(b)),
        "select": lambda condition, a, b: torch.where(_tensor(condition) != 0.0, _tensor(a), _tensor(b)),
        "lookup": lambda k, x, order: tables[int(k)](_tensor(x), int(order)),
        **{
            name: _of_tensor(getattr(torch, name))
            for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "tanh")
        },
    }


def _tensor(x: Tensor | float) -> Tensor:
    return torch.as_tensor(x, dtype=None if isinstance(x, Tensor) else torch.float64)


def _of_tensor(function: Callable[[Tensor], Tensor]) -> Callable[[Tensor | float], Tensor]:
    """Return a PyTorch function that accepts plain numbers too, which SymPy leaves inside functions."""
    return lambda x: function(_tensor(x))


class _Lookup:
    """Characteristic as a piecewise polynomial that autograd differentiates."""

    def __init__(self, table: Table) -> None:
        self.table = table

    def __call__(self, x: Tensor, order: int) -> Tensor:
        knots, c = (torch.tensor(a, dtype=x.dtype, device=x.device) for a in self.table.pieces(order))
        held = torch.clamp(x, float(knots[0]), float(knots[-1]))
        k = (torch.searchsorted(knots, held.detach().contiguous(), right=True) - 1).clamp(0, len(knots) - 2)
        d = held - knots[k]
        value = ((c[0, k] * d + c[1, k]) * d + c[2, k]) * d + c[3, k]
        inside = (x >= knots[0]) & (x <= knots[-1])
        return torch.where(inside, value, torch.zeros_like(value)) if order else value
