"""Physics plus efforts: which networks sit in which ports of a system, and which parameters are trained."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from unmodelled.systems.model import System, symbol


@dataclass(frozen=True)
class Network:
    """One-hidden-layer ReLU network that supplies (part of) the effort of a port, eq. 4.4."""

    port: str
    inputs: tuple[sp.Expr, ...]  # q = g(x, u; p), eq. 4.3, free of efforts
    hidden: int  # number of hidden units
    label: str = ""  # name of its effort in the report, F or F_c

    @property
    def size(self) -> int:
        """Number of weights: W_h (inputs, hidden), b_h, W_o, b_o."""
        return self.hidden * (len(self.inputs) + 2) + 1


@dataclass(frozen=True, eq=False)
class Augmented:
    """A system, networks in its ports, and the parameters that are trained with them."""

    system: System
    networks: tuple[Network, ...] = ()  # efforts of networks that share a port are added
    trainable: tuple[str, ...] = ()

    @cached_property
    def p(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the trained parameters."""
        return tuple(symbol(name) for name in self.trainable)

    @cached_property
    def index(self) -> tuple[int, ...]:
        """Indices of the trained parameters among all parameters."""
        names = [p.name for p in self.system.parameters]
        return tuple(names.index(name) for name in self.trainable)

    @cached_property
    def inputs(self) -> tuple[sp.Expr, ...]:
        """Inputs of all networks, one after the other."""
        return tuple(q for network in self.networks for q in network.inputs)

    @property
    def size(self) -> int:
        """Number of weights of all networks."""
        return sum(network.size for network in self.networks)
