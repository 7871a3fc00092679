"""The numbers of a diagnosis that a user may set."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from unmodelled.base.errors import BadInput, closest
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds

#: How a diagnosis finds laws: by the evidence of each law beside the measurement chain, over long windows, or
#: by a search for the set that predicts best.
WAYS = "evidence", "search"


def check_by(by: str) -> None:
    """Refuse a way of diagnosis that there is not."""
    if by not in WAYS:
        raise BadInput(f"by: must be {' or '.join(WAYS)}, got {str(by)[:60]!r}")


@dataclass(frozen=True)
class Options:
    """The few numbers that decide what a diagnosis names; the defaults are measured.

    What half and twice of a number change on virtual and measured machines is in
    `unmodelled.diagnosis.data.thresholds`. The confidence of an answer is that of the defaults.

    Attributes:
        level: level of confidence intervals, and of the test whether a law predicts better; default 0.95.
        material_rest: share of the error above the noise that a better explanation removes at least; default
            0.1.
        material_share: share of the gap that each unit of further complexity removes at least; default 0.05.
        further_rest: share of the error above the noise that an `effect` leaves at most; default 0.3.
        negligible_error: error below which nothing matters, in that of a prediction without a model; default
            0.01.
        useful_error: error of corrected logs above which no fault is found, in that of a prediction without a
            model; default 0.5.
        unexplained_gap: error that an `effect` leaves at most, in that of a prediction without a model;
            default 0.1.
        fault_share: share of the squared error that a fault of the logs explains at least; default 0.8.
        held_out_share: share of the experiments that take no part in fitting and choosing; default 0.25.
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

    level: float = DEFAULT_THRESHOLDS.level
    material_rest: float = DEFAULT_THRESHOLDS.material_rest
    material_share: float = DEFAULT_THRESHOLDS.material_share
    further_rest: float = DEFAULT_THRESHOLDS.further_rest
    negligible_error: float = DEFAULT_THRESHOLDS.negligible_error
    useful_error: float = DEFAULT_THRESHOLDS.useful_error
    unexplained_gap: float = DEFAULT_THRESHOLDS.unexplained_gap
    fault_share: float = DEFAULT_THRESHOLDS.fault_share
    held_out_share: float = DEFAULT_THRESHOLDS.held_out_share
    most_equal: int = DEFAULT_THRESHOLDS.most_equal

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

    @property
    def thresholds(self) -> Thresholds:
        """Return all thresholds of a diagnosis with these options."""
        return replace(DEFAULT_THRESHOLDS, **asdict(self))


#: The options of every diagnosis unless others are given.
DEFAULT_OPTIONS = Options()
