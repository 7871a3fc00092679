"""Reference runs that an explanation compares with (the background set of section 5.5.1)."""

import torch
from torch import Tensor

from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.errors import BadInput


def shares_of_references(background: Sequences, steps: int) -> Tensor:
    """Return the share of every reference in the background of every step; each row sums to one.

    The background B_k contains all references with at least k steps, with equal shares. References are
    neither stretched nor padded, so that Phi may have a small jump where a reference ends.

    Gives (steps, references).
    """
    if not len(background):
        raise BadInput("background: it holds no run")
    longest = int(background.lengths.max())
    if longest < steps:
        raise BadInput(f"background: its longest run has {longest} steps, an explained one {steps}")
    lasting = torch.arange(1, steps + 1)[:, None] <= torch.from_numpy(background.lengths)
    return lasting.double() / lasting.sum(1, keepdim=True)


def check_inputs(expected: SequenceInputs, runs: Sequences, background: Sequences) -> None:
    """Refuse an empty set of runs, and runs or a background with other inputs than those of the network."""
    if not len(runs):
        raise BadInput("runs: there is none to explain")
    for name, sequences in (("runs", runs), ("background", background)):
        for kind in ("features", "settings"):
            reads, given = getattr(expected, kind), getattr(sequences.inputs, kind)
            if given != reads:
                raise BadInput(
                    f"{name}: the network reads the {kind} {', '.join(reads) or 'none'}, "
                    f"got {', '.join(given) or 'none'}"
                )
