"""Every law of the library at every place as columns around a fit: its evidence by one linear step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.columns.columns import Atom, at_level
from unmodelled.diagnosis.data.levels import levels
from unmodelled.diagnosis.judge.elimination import OPEN, SIGMAS, Reduced
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.systems.model import System

#: Size of a column, in weighted residuals, below which it changes nothing.
NOTHING = 1e-6


@dataclass(frozen=True, eq=False)
class Row:
    """A law at a place with one shape, by its linear step."""

    atom: Atom
    shapes: int  # shapes of this law that were tried at this place
    nats: float  # evidence for it, after the price of its numbers and shapes
    amount: Array  # amplitudes, (amplitudes,), in plausible sizes

    @property
    def name(self) -> str:
        """Return family@channel, with the level where it acts at one only, which is one explanation."""
        family, channel, factor, level = self.atom.name
        return f"{family}@{channel}" if factor is None else f"{family}@{channel} where {factor} is {level}"

    @property
    def place(self) -> tuple[object, ...]:
        """Return channel, factor and level."""
        return self.atom.name[1:]

    @property
    def about(self) -> tuple[object, ...]:
        """Return kind and place, which a user acts on first."""
        return self.atom.effect.kind, *self.place

    @property
    def key(self) -> tuple[str, str]:
        """Return name and variant."""
        return self.name, self.atom.effect.variant


def scan(around: Linearised) -> list[Row]:
    """Return every law at every place around a fit with its best shape, also at levels of factors."""
    study, found = around.columns.path.hypothesis.study, list[Row]()
    factors = study.logs.experiments.iloc[around.runs].drop(columns=started(study.system), errors="ignore")
    local = list(levels(factors))
    for atoms, columns in around.columns.atoms():
        products, effect = around.products(columns), atoms[0].effect
        if not effect.at_levels:
            found.append(_best(around, atoms, columns, len(atoms), around.reduced(products)))
        if effect.at_levels or atoms[0].place.kind == "port":
            for factor, level, members in local:
                here = np.isin(np.arange(len(around.runs)), members)
                own = [at_level(atom, factor, level) for atom in atoms]
                reduced = around.reduced(products, here)
                found.append(_best(around, own, columns, len(atoms) * len(local), reduced, here))
    pooled = around.pooled_of_fit
    for column, size, atom in around.columns.scatter():
        if atom is not None:
            nats = around.differing(column, OPEN * size) - pooled - around.weights.price(atom.numbers)
            found.append(Row(atom, 1, nats, np.zeros(1)))
    return found


def started(system: System) -> list[str]:
    """Return the constants of experiments that are only values at which states start: no factors of laws."""
    starts = {symbol.name for state in system.states for symbol in state.initial.free_symbols}
    acting = {symbol.name for equation in system.dynamics for symbol in equation.free_symbols}
    return sorted(starts - acting)


def row_of(around: Linearised, atom: Atom, columns: Array) -> Row:
    """Return a law that is not of the library, from its columns (windows, K, outputs, amplitudes)."""
    return _best(around, [atom], columns, 1, around.reduced(around.products(columns)))


def _best(
    around: Linearised,
    atoms: Sequence[Atom],
    columns: Array,
    shapes: int,
    reduced: Mapping[float, Reduced],
    here: Mask | None = None,
) -> Row:
    """The best of atoms with as many columns each, side by side, that are there in `here` only, if given."""
    many, best, choice = columns.shape[3] // len(atoms), -np.inf, (0, SIGMAS[0], np.zeros(0))
    for sigma, one in reduced.items():
        gains, amounts = _removed_each(one.products, atoms, many)
        k = int(np.argmax(gains))
        nats = around.pooled(one, float(one.products[-1, -1] - gains[k]))
        if nats > best:
            best, choice = nats, (k, sigma, amounts[k])
    k, sigma, amount = choice
    atom, mine, steps = atoms[k], slice(many * k, many * (k + 1)), reduced[sigma].steps
    step = steps[:, -1] - steps[:, mine] @ amount
    cost = around.weights.price(atom.numbers) + float(np.log(shapes))
    added = columns[..., mine] @ amount
    if here is not None:
        added[~np.isin(around.columns.path.owner, around.runs[here])] = 0.0
    nats = around.evidence_with(added, step, sigma) - around.evidence
    return Row(atom, shapes, nats - cost, amount)


def _removed_each(G: Array, atoms: Sequence[Atom], many: int) -> tuple[Array, Array]:
    """Squared residual that every atom removes alone, (atoms,), and amounts, (atoms, many)."""
    mine = np.arange(len(atoms) * many).reshape(len(atoms), many)
    H, g = G[mine[:, :, None], mine[:, None]], G[mine, -1]
    size = np.sqrt(np.maximum(np.einsum("amm->am", H), 0.0))
    there = np.maximum(size, NOTHING)
    normed = H / (there[:, :, None] * there[:, None]) + 1e-9 * np.eye(many)
    amounts = np.linalg.solve(normed, (g / there)[..., None])[..., 0] / there
    positive = np.array([atom.positive for atom in atoms])
    for k in np.flatnonzero(((positive & (amounts < 0.0)) | (size <= NOTHING)).any(axis=1)):
        amounts[k] = removed(G, mine[k], positive[k])[1]
    return np.einsum("am,am->a", amounts, g), amounts


def removed(G: Array, mine: Indices, positive: Mask) -> tuple[float, Array]:
    """Return the squared residual that columns remove, and their amounts, of products (N + 1, N + 1).

    A column whose amount would be negative, where none may be, is left out.
    """
    none, H = np.zeros(len(mine)), G[np.ix_(mine, mine)]
    size = np.sqrt(np.maximum(np.diag(H), 0.0))
    there = size > NOTHING
    if not there.any():
        return 0.0, none
    amount, few = none.copy(), mine[there]
    normed = H[np.ix_(there, there)] / np.outer(size[there], size[there]) + 1e-9 * np.eye(len(few))
    amount[there] = np.linalg.solve(normed, G[few, -1] / size[there]) / size[there]
    wrong = positive & (amount < 0.0)
    if not wrong.any():
        return float(amount @ G[mine, -1]), amount
    if wrong.all():
        return 0.0, none
    gain, less = removed(G, mine[~wrong], positive[~wrong])
    none[~wrong] = less
    return gain, none
