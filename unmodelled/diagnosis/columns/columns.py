"""Everything that could be wrong as columns: the change of all window errors by a plausible amount of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.columns.jacobians import Jacobians
from unmodelled.diagnosis.columns.local_laws import LocalLaws
from unmodelled.diagnosis.columns.path import Path
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.effects.added import Added
from unmodelled.effects.delay import Delay
from unmodelled.effects.effect import Effect, LawEffect
from unmodelled.effects.extrapolation import continued
from unmodelled.effects.law import Law
from unmodelled.effects.library import effects
from unmodelled.effects.outputs import rate_output
from unmodelled.effects.place import Place, Site, site
from unmodelled.systems.model import System

#: Most starting values of the shapes of a law at a place: a budget. A shape with `ROUGH` values or more, such
#: as a number of ripples per turn, has many optima, and needs all of them.
MOST_SHAPES, ROUGH = 16, 20
#: Plausible relative deviation of a gain or parameter between experiments; of dry friction, as a share of the
#: missing effort (0.1 loses planted scatter of friction, 1 lets it imitate laws).
BETWEEN, FRICTION_BETWEEN = 0.1, 0.3
#: Widest prior of a number that every model leaves open, in its plausible sizes.
OPEN = 10.0


@dataclass(frozen=True, eq=False)
class Atom:
    """A law at a place with one set of shapes: some columns that come and go together."""

    effect: Effect
    place: Place
    shape: dict[str, float]  # local name -> value, SI; of a delay, the delay (s) that the column stands for
    scale: Array  # plausible sizes of its amplitudes, (amplitudes,), SI: the unit of the columns
    positive: Mask  # (amplitudes,): cannot be negative
    numbers: int  # that were chosen: amplitudes, and shapes with more than one starting value

    @property
    def name(self) -> tuple[str, str, str | None, object]:
        """Return family and place: variants of a law at one place are one explanation."""
        return self.effect.family, self.place.channel, self.place.factor, self.place.level

    @property
    def key(self) -> tuple[str, str, Place]:
        """Return family, variant and place."""
        return self.effect.family, self.effect.variant, self.place


@dataclass(frozen=True, eq=False)
class Group:
    """Columns that are there in every model."""

    columns: Array  # changes of the window errors, (judged windows, K, outputs, members)
    prior: Array  # plausible deviations, (members,), in units of the columns
    atoms: tuple[Atom | None, ...]  # differences that may be named, by member; None where one is only there


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns around a path."""

    path: Path

    @cached_property
    def jacobians(self) -> Jacobians:
        """Return the Jacobians along the path."""
        return Jacobians(self.path)

    def at(self, place: Place, forcing: Array) -> Array:
        """Return columns (judged windows, K, outputs, N) of forcings (windows, 2 K + 1, N), SI, at a place.

        Columns are in units of the sensor noise.
        """
        path, slopes = self.path, self.jacobians.by(Place(place.kind, place.name))
        forcing = np.ascontiguousarray(forcing)
        start = np.zeros((*path.x[:, 0].shape, forcing.shape[2]))
        if path.measured:
            # a fault of an output also changes the states that are read from it
            gain, output, slope = self.jacobians.start_gain
            shown = slopes[1][:, 0, output] * path.recording.noise[output] / gain
            rate = (forcing[:, 2] - forcing[:, 0]) / path.period
            change = np.where(slope[:, None], rate[:, None], forcing[:, :1])
            start[:, path.measured] = -shown[..., None] * change
        return self.jacobians.propagated(slopes, forcing, start)

    @cached_property
    def starts(self) -> Array:
        """Return the columns, shape (judged windows, K, outputs, measured states), of initial states."""
        path, many = self.path, len(self.path.measured)
        start = np.zeros((*path.x[:, 0].shape, many))
        start[:, path.measured] = path.sigma[:, :, None] * np.eye(many)
        return self.jacobians.started(start)

    @cached_property
    def open(self) -> Group:
        """Return what every model leaves open: uncertain parameters, input timing, numbers of its effects."""
        return self._group((self._of(u), _prior(u), None) for u in self.unknowns(own=False))

    def unknowns(self, *, own: bool) -> list[Unknown]:
        """Return the numbers that experiments share, or those that each has for itself."""
        return [u for u in self.path.hypothesis.unknowns if u.own is own]

    def _group(self, members: Iterable[tuple[Array, float, Atom | None]]) -> Group:
        columns, prior, atoms = [np.empty((*self.path.error.shape, 0))], [], []
        for column, plausible, atom in members:
            columns.append(column)
            prior.append(plausible)
            atoms.append(atom)
        return Group(np.concatenate(columns, axis=3), np.array(prior), tuple(atoms))

    def _of(self, unknown: Unknown) -> Array:
        late = self.path.hypothesis.delays.get(unknown.name)
        if late is None:
            return self._parameter(unknown.name, unknown.scale)
        inputs = {item.name for item in self.path.system.inputs}
        place = Place("actuator" if late in inputs else "sensor", late)
        return self.at(place, self.laws.delayed(place, np.array([unknown.scale])))

    def _parameter(self, name: str, scale: float) -> Array:
        return self.at(Place("parameter", name), np.full((*self.path.t.shape, 1), scale))

    @cached_property
    def own(self) -> Group:
        """Return numbers that are known to differ between experiments, and starts of hidden states."""
        numbers = ((self._of(u), _prior(u), None) for u in self.unknowns(own=True))
        return self._group([*numbers, *self._hidden_starts()])

    def scatter(self) -> Iterator[tuple[Array, float, Atom | None]]:
        """Yield gains of inputs, uncertain parameters and dry friction that differ between experiments.

        Columns (judged windows, K, outputs, 1) with their plausible deviation, and laws that may be named.
        """
        for effect, place in self._every:
            law = effect.law(self.sites[place]) if isinstance(effect, LawEffect) else None
            known = place.kind == "parameter" and place.name not in self._uncertain
            if law is None or not law.per_experiment or known:
                continue
            local = self.laws.contributions(continued(self.sites[place], law), place, [{}])
            port = place.kind == "port"
            size = self.sites[place].effort if port else 1.0
            # scatter of a friction that is not there would be the friction
            there = {e.family for e in self.path.hypothesis.effects if e.place == place}
            atom = Atom(effect, place, {}, size * np.ones(1), np.zeros(1, bool), 1)
            may_be_named = not effect.beside or bool(effect.beside & there)
            yield (
                self.at(place, size * local),
                FRICTION_BETWEEN if port else BETWEEN,
                atom if may_be_named else None,
            )

    def _hidden_starts(self) -> Iterator[tuple[Array, float, None]]:
        """Starts of hidden states, which are never measured, but for those that another experiment leaves."""
        path, (_, chained, _) = self.path, self.path.chain
        before = path.recording.logs.continues
        begun = ~chained & np.array([not (before and before[run]) for run in path.owner])
        for k in path.hidden:
            start = np.zeros((*path.x[:, 0].shape, 1))
            start[begun, k] = np.std(path.x[..., k])
            yield self.jacobians.started(start), 1.0, None

    @property
    def _uncertain(self) -> set[str]:
        return {p.name for p in self.path.hypothesis.study.system.parameters if p.identify}

    @cached_property
    def _every(self) -> list[tuple[Effect, Place]]:
        """Every effect of the library and of the user where it can be added to the hypothesis."""
        hypothesis = self.path.hypothesis
        found = []
        library = (effect for effect in effects() if effect.family not in hypothesis.study.without)
        for effect in (*library, *hypothesis.study.laws):
            taken = {e.place.channel for e in hypothesis.effects if e.family == effect.family}
            known = set(effect.places(hypothesis.study.system))
            places = [p for p in hypothesis.places(effect) if p in known and p.channel not in taken]
            found += [(effect, place) for place in places]
        return found

    @cached_property
    def sites(self) -> dict[Place, Site]:
        """Return all places with the sizes of their signals."""
        study = self.path.hypothesis.study
        places = [*(p for _, p in self._every), *(Place("port", port.name) for port in study.system.ports)]
        return {p: site(self._system(p), p, study.scales) for p in dict.fromkeys(places)}

    def _system(self, place: Place) -> System:
        """The system that a law at a place sees: at inputs and outputs, the one beneath a chain."""
        hypothesis = self.path.hypothesis
        beneath = hypothesis.chained and place.kind in ("actuator", "sensor")
        return hypothesis.study.system if beneath else self.path.system

    def of_law(self, law: Law, place: Place) -> Array:
        """Return columns (judged windows, K, outputs, amplitudes), in plausible sizes, of a law."""
        scale = np.array([a.scale for a in law.amplitudes.values()])
        return self._of_law(continued(self.sites[place], law), place, [{}], scale)

    def _of_law(self, law: Law, place: Place, shapes: Sequence[Mapping[str, float]], scale: Array) -> Array:
        """Columns (..., K, outputs, shapes * amplitudes) of a law, also where an output shows its rate."""
        sizes = np.tile(scale, len(shapes))
        found = self.at(place, self.laws.contributions(law, place, shapes) * sizes)
        system = self._system(place)
        if law.rates is None or (shown := rate_output(system, place.name)) is None:
            return found
        rates = self.laws.contributions(law.rates, place, shapes) * sizes
        return found + self.at(replace(place, name=shown.name), rates)

    def of_regressors(self, added: Added) -> Array:
        """Return columns (judged windows, K, outputs, amplitudes), in plausible sizes, of an effect."""
        scale = np.array([added.scales[name] for name in added.amplitudes])
        return self.at(added.place, scale * self.path.evaluate(added.regressors))

    @cached_property
    def laws(self) -> LocalLaws:
        """Return the laws along the path."""
        return LocalLaws(self.path, self.sites)

    def atoms(self) -> Iterator[tuple[list[Atom], Array]]:
        """Yield every law at every place with its shapes, and columns (..., K, outputs, atoms * amplitudes).

        Differences between experiments are in `scatter`; laws at levels of a factor follow from these.
        """
        for effect, place in self._every:
            if isinstance(effect, Delay):
                yield self._late(effect, place)
            elif isinstance(effect, LawEffect):
                law = continued(self.sites[place], effect.law(self.sites[place]))
                if not law.per_experiment:
                    names, grids = tuple(law.shapes), [s.grid for s in law.shapes.values()]
                    grid = [dict(zip(names, values, strict=True)) for values in product(*grids)]
                    rough = any(len(g) >= ROUGH for g in grids)
                    most = len(grid) if rough else MOST_SHAPES
                    few = np.unique(np.linspace(0, len(grid) - 1, most).round().astype(int))
                    shapes = [grid[k] for k in few]
                    scale = np.array([a.scale for a in law.amplitudes.values()])
                    positive = np.array([a.bounds[0] >= 0.0 for a in law.amplitudes.values()])
                    numbers = len(scale) + sum(len(g) > 1 for g in grids)
                    atoms = [Atom(effect, place, shape, scale, positive, numbers) for shape in shapes]
                    yield atoms, self._of_law(law, place, shapes, scale)

    def _late(self, effect: Delay, place: Place) -> tuple[list[Atom], Array]:
        study = self.path.hypothesis.study
        (grid,) = effect.add(self.path.system, place, study.scales).shapes.values()
        late = [d for d in grid if d < 0.5 * study.horizon or d == grid[0]][:MOST_SHAPES]
        one = np.ones(1)
        atoms = [Atom(effect, place, {"delay": d}, one, np.ones(1, bool), 1) for d in late]
        return atoms, self.at(place, self.laws.delayed(place, np.array(late)))


def _prior(unknown: Unknown) -> float:
    """Half the width of the bounds, in plausible sizes."""
    return min(0.5 * (unknown.high - unknown.low) / unknown.scale, OPEN)


def at_level(atom: Atom, factor: str, level: float | str) -> Atom:
    """Return an atom that acts in the experiments of one level of a factor only."""
    return replace(atom, place=replace(atom.place, factor=factor, level=level))
