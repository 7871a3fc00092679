"""The numbers of a diagnosis that a user may set."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from unmodelled.base.errors import BadInput, closest


@dataclass(frozen=True)
class Options:
    """The few numbers of an answer that are a matter of taste.

    Attributes:
        level: level of confidence intervals; default 0.95. Higher: wider intervals.
        useful_error: error of corrected logs above which no fault is found, in that of a prediction without a
            model; default 0.5. Half or twice: 3 and 5 of 244 answers change.
        fault_share: share of the squared error that a fault of the logs explains at least; default 0.8. At
            0.6 and 0.9, 1 and 4 of 244 answers change.
        most_equal: largest number of effects listed as indistinguishable; default 3.

    Examples:
        >>> import unmodelled as um
        >>> strict = um.Options(level=0.99)
        >>> strict.validate()
        >>> um.Options(level=1.5).validate()
        Traceback (most recent call last):
            ...
        unmodelled.base.errors.BadInput: options: level: must be between 0 and 1, got 1.5
    """

    level: float = 0.95
    useful_error: float = 0.5
    fault_share: float = 0.8
    most_equal: int = 3

    @classmethod
    def of(cls, given: Options | Mapping[str, Any] | None) -> Options:
        """Return options from their names and values, validated.

        Args:
            given: options, values by name, or None for the defaults.

        Raises:
            BadInput: when a name is none of an option, or a value is outside its range.
        """
        names = [f.name for f in fields(cls)]
        if given is None or isinstance(given, Options):
            found = given or DEFAULT_OPTIONS
        elif not isinstance(given, Mapping):
            raise BadInput(f"options: must be a mapping such as {{level: 0.99}}, got {str(given)[:60]!r}")
        else:
            for name in given:
                if name not in names:
                    raise BadInput(f"options: there is no {name}{closest(str(name), names)}")
            found = cls(**given)
        found.validate()
        return found

    def validate(self) -> None:
        """Check all numbers.

        Raises:
            BadInput: when a number is outside its range.
        """
        for name, value in asdict(self).items():
            whole = name == "most_equal"
            number = isinstance(value, int if whole else int | float) and not isinstance(value, bool)
            if whole and not (number and value >= 0):
                raise BadInput(f"options: {name}: must be a whole number from 0 on, got {value}")
            if not whole and not (number and math.isfinite(value) and 0.0 < value < 1.0):
                raise BadInput(f"options: {name}: must be between 0 and 1, got {value}")

    @property
    def changed(self) -> dict[str, float]:
        """Return the values that are not the defaults, by name."""
        default = asdict(DEFAULT_OPTIONS)
        return {name: value for name, value in asdict(self).items() if value != default[name]}


#: The options of every diagnosis unless others are given.
DEFAULT_OPTIONS = Options()
