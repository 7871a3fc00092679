"""Insertion of a law into a system, at a port, an input, an output or a parameter."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import sympy as sp

from unmodelled.effects.added import RIGHT, Added
from unmodelled.effects.columns import Column, Member
from unmodelled.effects.extrapolation import continued, extent, slopes
from unmodelled.effects.law import Amplitude, Law, Shape
from unmodelled.effects.motion import acceleration, effort_signals
from unmodelled.effects.outputs import rate_output
from unmodelled.effects.place import Place, Site
from unmodelled.effects.substitution import substituted, with_law, with_output, with_states
from unmodelled.effects.translation import Translation
from unmodelled.systems import grammar
from unmodelled.systems.model import Constant, Parameter, State, System, symbol
from unmodelled.systems.scope import Scope, Value


def attached(site: Site, law: Law, family: str, variant: str) -> Added:
    """Return the system with a law at a site, and the numbers that a fit needs."""
    parts = _Parts(site, continued(site, law))
    names, units = parts.words.names, parts.words.units
    fitted: dict[str, Amplitude | Shape] = {**law.amplitudes, **law.shapes}
    amplitudes = tuple(names[n] for n in law.amplitudes)
    return Added(
        family,
        variant,
        site.place,
        parts.system(),
        law=parts.words.text(law.text),
        amplitudes=amplitudes,
        regressors=parts.regressors(),
        shares=tuple(names[n] for n, amplitude in law.amplitudes.items() if amplitude.share),
        shapes={names[n]: shape.grid for n, shape in law.shapes.items()},
        bounds={names[n]: number.bounds for n, number in fitted.items()},
        scales={names[n]: number.scale for n, number in fitted.items()},
        units={names[n]: units[n] for n in fitted},
        memory=tuple(names[n] for n in law.memory),
        columns=parts.columns,
        per_experiment=amplitudes if law.per_experiment else (),
        # what all experiments share is not in the numbers of single ones, whose mean is free otherwise
        priors={names[n]: a.scale for n, a in law.amplitudes.items()} if law.per_experiment else {},
        linear=not parts.inertial,
        slopes=slopes(law, parts.words),
        extent=extent(parts.words),
        robot={quantity: parts.words.text(value) for quantity, value in law.robot.items()},
        told={names[n]: told for n, told in law.told.items()},
        waves={
            names[n]: replace(w, cosine=names[w.cosine], times=names.get(str(w.times), w.times))
            for n, w in law.waves.items()
        },
        phrase=_in_names(law.phrase, law, names),
        negative=_in_names(law.negative, law, names),
        cycle=law.cycle,
        error=sp.S.Zero if law.cycle is None else parts.error(),
        signals=parts.words.signals,
    )


def _in_names(phrase: str, law: Law, names: Mapping[str, str]) -> str:
    """A phrase with the names that the numbers have in the system."""
    return phrase.format_map({n: f"{{{names[n]}}}" for n in law.names}) if phrase else ""


@dataclass(frozen=True)
class _Parts:
    site: Site
    law: Law

    @cached_property
    def words(self) -> Translation:
        return Translation(self.site, self.law, (*self._member, *self._signals))

    @property
    def _member(self) -> tuple[str, ...]:
        """Name of the constant that is 1 in the experiments of the level, if the system lacks such a one."""
        factor = self.site.place.factor
        known = {constant.name for constant in self.site.system.operating_point}
        return () if factor is None or factor in known else (f"in_{factor}",)

    @property
    def _signals(self) -> tuple[str, ...]:
        system, place = self.site.system, self.site.place
        if place.kind == "port":
            effort = system.port(place.name).effort
            return f"{effort}_free", f"{effort}_mobility", f"{effort}_total"
        return () if place.kind == "sensor" else (f"{place.name}_acting",)

    @property
    def columns(self) -> dict[str, Column]:
        names, place = self.words.names, self.site.place
        own = {names[name]: column for name, column in self.law.columns.items()}
        if place.factor is None or place.level is None:
            return own
        return own | {names[name]: Member(place.factor, place.level) for name in self._member}

    @cached_property
    def _indicator(self) -> tuple[sp.Expr, str]:
        """Expression that is 1 where the effect acts, and its text in front of an amplitude."""
        factor, level = self.site.place.factor, self.site.place.level
        if factor is None or level is None:
            return sp.S.One, ""
        if self._member:
            name = self.words.names[self._member[0]]
            return symbol(name), f"{name}*"
        text = f"({factor} == {float(level)!r})"
        return grammar.parse(text, Scope({factor: Value(symbol(factor))}), text), f"{text}*"

    @property
    def inertial(self) -> bool:
        """Whether the contribution depends on the acceleration that it changes."""
        a = self.site.quantities.get("a")
        return a is not None and any(v.expression.has(a.expression) for v in self.words.adds.values())

    def regressors(self) -> tuple[sp.Expr, ...]:
        """Return the regressors (see `Added`), with the acceleration of the system without the effect."""
        system, known = self.site.system, {}
        if self.inertial:
            a = acceleration(system, system.port(self.site.place.name), system.closed)
            known[self.site.quantities["a"].expression] = a.xreplace(dict.fromkeys(system.e, sp.S.Zero))
        adds = (self.words.adds[name] for name in self.law.amplitudes)
        return tuple(self._indicator[0] * value.expression.xreplace(known) for value in adds)

    def error(self) -> sp.Expr:
        """Return the error of a sensor over what it should show."""
        shown = replace(self.site.quantities["y"], expression=RIGHT)
        alone = replace(self.words, site=replace(self.site, quantities={"y": shown}))
        return sum((symbol(self.words.names[n]) * v.expression for n, v in alone.adds.items()), sp.S.Zero)

    @cached_property
    def _terms(self) -> list[tuple[sp.Expr, sp.Expr]]:
        """Amplitudes and slopes where they act, each with the contribution of one unit."""
        indicator, names = self._indicator[0], self.words.names
        return [(indicator * symbol(names[n]), value.expression) for n, value in self.words.adds.items()]

    def _written(self, **others: str) -> str:
        """Return the sum of the terms as text; `others` replace local names."""
        words, before = self.words, self._indicator[1]
        return " + ".join(
            _product(before + words.names[name], words.text(number.adds, **others))
            for name, number in self.law.terms.items()
        )

    def system(self) -> System:
        """Return the system with the law."""
        words = self.words
        memory = {
            State(words.names[n], words.units[n], words.value(m.start).expression): (
                words.value(m.rate).expression,
                words.text(m.rate),
            )
            for n, m in self.law.memory.items()
        }
        starts = {words.names[n]: words.text(m.start) for n, m in self.law.memory.items() if m.start != "0"}
        grown = with_states(self._placed(), memory, starts)
        constants = (Constant(name, "1") for name in self.columns)
        return replace(
            grown,
            parameters=(*grown.parameters, *self._parameters()),
            operating_point=(*grown.operating_point, *constants),
        )

    def _parameters(self) -> Iterator[Parameter]:
        law, names, units = self.law, self.words.names, self.words.units
        for n, amplitude in law.amplitudes.items():
            yield Parameter(names[n], units[n], 0.0, not amplitude.share, amplitude.bounds)
        for n, shape in law.shapes.items():
            yield Parameter(names[n], units[n], shape.grid[len(shape.grid) // 2], True, shape.bounds)
        for n, fixed in law.fixed.items():
            yield Parameter(names[n], units[n], fixed.value)
        for n in law.slopes:
            yield Parameter(names[n], units[n], 0.0)

    def _placed(self) -> System:
        system, place = self.site.system, self.site.place
        if place.kind == "port":
            return self._at_port(system, place)
        total = sum((k * f for k, f in self._terms), sp.S.Zero)
        if place.kind == "sensor":
            return self._at_sensor(system, with_output(system, place.name, total, self._written()))
        (signal,) = (self.words.names[name] for name in self._signals)
        more = symbol(place.name) + total, f"{place.name} + {self._written()}"
        return substituted(system, place.name, {signal: more})

    def _at_sensor(self, known: System, grown: System) -> System:
        """Add what the law adds to the output that shows the rate of the place's output."""
        names, (before, factor) = self.words.names, self._indicator[::-1]
        rates, shown = self.words.rates, rate_output(known, self.site.place.name)
        if not rates or shown is None:
            return grown
        total = sum((factor * symbol(names[n]) * v.expression for n, v in rates.items()), sp.S.Zero)
        text = {n: self.words.text(self.law.amplitudes[n].rate) for n in rates}
        written = " + ".join(_product(before + names[n], text[n]) for n in rates)
        return with_output(grown, shown.name, total, written)

    def _at_port(self, system: System, place: Place) -> System:
        port = system.port(place.name)
        if not self.inertial:
            total = sum((k * f for k, f in self._terms), sp.S.Zero)
            return with_law(system, port, total, self._written())
        a, new = self.site.quantities["a"].expression, [self.words.names[name] for name in self._signals]
        signals = effort_signals(system, port, a, self._terms, self._written(a=new[0]), new)
        return substituted(system, port.effort, signals)


def _product(factor: str, text: str) -> str:
    if text == "1":
        return factor
    body = ast.parse(text, mode="eval").body  # made of texts that were checked when they were read
    bare = isinstance(body, ast.Call | ast.Name | ast.Constant)
    chain = isinstance(body, ast.BinOp) and not isinstance(body.op, ast.Add | ast.Sub)
    return f"{factor}*{text}" if bare or chain else f"{factor}*({text})"
