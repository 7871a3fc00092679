"""Parts of an answer as a user meets them: a named effect, and the place of the gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from unmodelled.base.kind_words import kind_sentence, ranking_sentence
from unmodelled.base.notebook import shown
from unmodelled.base.wording import effect_name
from unmodelled.diagnosis.answer.sentences import numbers_of
from unmodelled.report.headline import percent


class Number(NamedTuple):
    """Number of a law.

    Attributes:
        value: identified value, SI.
        unit: SI unit.
        interval: ends of the 95 % interval, SI.
    """

    value: float
    unit: str
    interval: tuple[float, ...]


class FitSummary(NamedTuple):
    """End of the fit of the numbers of an answer.

    Attributes:
        converged: whether the error stopped falling before the iterations were used up.
        evaluations: simulated sets of numbers.
        seconds: duration of the diagnosis, s; None where it was not written down.
    """

    converged: bool
    evaluations: int
    seconds: float | None

    def __repr__(self) -> str:
        took = "" if self.seconds is None else f", {self.seconds:g} s in all"
        end = "converged" if self.converged else "ended before it converged"
        return f"the fit {end} after {self.evaluations} simulations{took}"


@dataclass(frozen=True, repr=False)
class NamedEffect:
    """Effect that the model leaves out, as an answer names it.

    Attributes:
        family: kind of the effect, coulomb_friction for instance.
        port: place of the effect: a port, actuator:<input>, sensor:<output> or parameter:<name>.
        law: formula of the effect, in names of the augmented system.
        parameters: numbers of the law by name, each with value, unit and interval (95 %), SI; each is an
            attribute, too, see `Number`. `remarks` lists why a number is doubtful.
        confidence: calibrated probability that it is this effect or one of `indistinguishable`, 0 to 1.
        shrink: share of the squared gap above the noise floor that the effect explains, 0 to 1.
        indistinguishable: effects that these data cannot tell from this one, in words.
        kind: subject of the law, which these data decide first, such as dry friction; empty where laws were
            not compared by evidence.
        probability: probability of this law, 0 to 1; None where laws were not compared by evidence.
        sentence: kinds between which the effect was chosen, and forms of the law, with their probabilities;
            empty where there is no kind.
        name: law and place in words, as titles and tables have them.
    """

    family: str
    port: str
    law: str
    parameters: Mapping[str, Mapping[str, Any]]
    confidence: float
    shrink: float
    indistinguishable: tuple[str, ...]
    kind: str = ""
    probability: float | None = None
    sentence: str = ""
    name: str = ""

    def __getattr__(self, name: str) -> Number:
        """Return a number of the law by its name, such as `effect.F_c`."""
        numbers = self.__dict__.get("parameters", {})
        if name not in numbers:
            raise AttributeError(f"{type(self).__name__} has no attribute or number {name!r}")
        entry = numbers[name]
        return Number(entry["value"], entry["unit"], tuple(entry["interval"] or ()))

    def __repr__(self) -> str:
        about = f"explains {percent(self.shrink)} of the gap, confidence {percent(self.confidence)}"
        lines = [self.sentence] if self.sentence else []
        lines += [f"{self.name}: {self.law} ({about})"]
        lines += numbers_of({"parameters": self.parameters})
        lines += [f"these logs cannot distinguish it from {other}" for other in self.indistinguishable]
        return "\n    ".join(lines)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.parameters]

    @classmethod
    def of(cls, content: Mapping[str, Any], answer: Mapping[str, Any]) -> NamedEffect:
        """Return the effect that an entry of diagnosis.json describes.

        Args:
            content: entry of the list `effects` in diagnosis.json.
            answer: content of diagnosis.json.
        """
        names = ("family", "port", "law", "parameters", "confidence", "shrink")
        alike = tuple(effect_name(other) for other in content["indistinguishable"])
        ranked = content.get("kind") and f"{ranking_sentence(answer, content)}. {kind_sentence(content)}"
        return cls(
            **{name: content[name] for name in names},
            indistinguishable=alike,
            kind=content.get("kind", ""),
            probability=content.get("probability"),
            sentence=ranked or "",
            name=effect_name(content),
        )


@dataclass(frozen=True, eq=False)
class GapLocation:
    """Location of the gap, as tables with the largest shares first.

    Attributes:
        channels: port, share of the squared gap above the noise floor.
        regions: signal, low, high (SI), share.
        factors: factor and level of the operating point, share.
        experiments: id, known, augmented: gap as given and with the effects found, standard deviations.
    """

    channels: pd.DataFrame
    regions: pd.DataFrame
    factors: pd.DataFrame
    experiments: pd.DataFrame

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> GapLocation:
        """Return the tables that the entry `where` of diagnosis.json describes.

        Args:
            content: entry `where` of diagnosis.json.
        """
        columns = {
            "channels": ["port", "share"],
            "regions": ["signal", "low", "high", "share"],
            "factors": ["factor", "level", "share"],
            "experiments": ["id", "known", "augmented"],
        }
        return cls(**{name: pd.DataFrame(content[name], columns=each) for name, each in columns.items()})

    def __repr__(self) -> str:
        filled = {name: table for name, table in vars(self).items() if len(table)}
        return "\n\n".join(f"{name}\n{table.to_string(index=False)}" for name, table in filled.items())

    def _repr_html_(self) -> str:
        return shown("Where the gap lies", [], vars(self))
