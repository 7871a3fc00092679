"""The numbers that decide what a diagnosis says, each with its meaning, unit, origin and sensitivity.

Grids, budgets and tolerances of optimisers are not thresholds: they stay beside the code that uses them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

_DEVELOPMENT = "chosen on withheld machines with seeds below 100 (decision 8)"
_JUDGEMENT = "judgement of its first version; no study is recorded"
_ALARMS = (
    "raised no false alarm on 139 withheld cases, EMPS and six other measured machines (rule_changes.md)"
)
_UNMEASURED = "not measured"


def _threshold(value: float, unit: str, meaning: str, origin: str, sensitivity: str = _UNMEASURED) -> Any:
    """Return a field of `Thresholds` with its documentation as metadata."""
    about = {"unit": unit, "meaning": meaning, "origin": origin, "sensitivity": sensitivity}
    return field(default=value, metadata=about)


@dataclass(frozen=True)
class Thresholds:
    """Every threshold of a diagnosis.

    Each field's metadata has `meaning`, `unit`, `origin` (why it has this value) and `sensitivity` (what
    changes at half and at twice the value). The noise ratio of a model is the mean square of its remaining
    free-run errors, in variances of the sensor noise, less one: zero at the noise floor. The loss is Huber's,
    a negative logarithm of a likelihood.

    Example:
        >>> Thresholds().held_out_share
        0.25
        >>> Thresholds(held_out_share=0.5).held_out_share
        0.5
    """

    # Experiments and the search space
    held_out_share: float = _threshold(
        0.25, "share of the experiments", "held out from fitting and choosing, at least one", _JUDGEMENT
    )
    longest_delay: int = _threshold(
        64, "samples", "longest additional sensor delay that is a candidate", _JUDGEMENT
    )
    longest_delay_share: float = _threshold(
        0.1, "share of the shortest experiment", "the same, in short experiments", _JUDGEMENT
    )
    input_timing: float = _threshold(
        0.6,
        "sampling periods",
        "an input may act so much before or after its logged time without being called delayed",
        "half a sample of zero-order hold, and a tenth for the fit",
    )
    most_levels: int = _threshold(
        8, "levels", "a column of experiments.csv with more levels is not a factor", _JUDGEMENT
    )
    fewest_per_level: int = _threshold(
        2, "experiments", "a level with fewer experiments has no candidates of its own", _JUDGEMENT
    )

    # Complexity of a candidate
    local_complexity: float = _threshold(
        1.5, "units of complexity", "added for an effect at one level of a factor only", _DEVELOPMENT
    )
    known_parameter_complexity: float = _threshold(
        1.0, "units of complexity", "added for an effect on a parameter that is not uncertain", _DEVELOPMENT
    )
    penalty: float = _threshold(
        0.003, "loss per compared value", "a unit of complexity must save so much", _DEVELOPMENT
    )
    largest_penalty_factor: float = _threshold(
        4.0, "1", "the penalty rises to so many times itself while a large gap remains", _DEVELOPMENT
    )
    same_complexity: float = _threshold(
        0.6,
        "units of complexity",
        "a smaller difference does not make a candidate more complex",
        _DEVELOPMENT,
    )
    simple_complexity: float = _threshold(
        4.0, "units of complexity", "no simpler candidate of more effects is searched below this", _JUDGEMENT
    )

    # Number of effects
    significant_loss: float = _threshold(
        40.0, "loss", "one effect more must save so much in all", _DEVELOPMENT
    )
    significant_loss_per_complexity: float = _threshold(
        3.0, "loss per unit of complexity", "one effect more must save so much besides", _DEVELOPMENT
    )
    further_share: float = _threshold(
        0.5, "share of the noise ratio", "a second or third effect must explain so much", _DEVELOPMENT
    )
    at_floor: float = _threshold(
        0.05, "noise ratio", "at or below this, no second effect is added", _DEVELOPMENT
    )
    above_floor: float = _threshold(
        0.15,
        "noise ratio",
        "above this, a gap remains (verdict unknown); at or below it, no third effect is added",
        "0.25 until 2026-11-20 (rule_changes.md)",
    )
    above_floor_share: float = _threshold(
        0.04, "share of the known physics' noise ratio", "at or below this, no gap remains", _DEVELOPMENT
    )
    far_from_floor: float = _threshold(
        10.0,
        "noise ratio",
        "above this, no candidate comes near the noise and the gap decides what complexity must save",
        "measured machines, after 237 withheld cases had been diagnosed (decision 8)",
    )
    complexity_share: float = _threshold(
        0.005,
        "share of the known physics' noise ratio",
        "far from the noise, a unit of complexity must explain so much",
        "measured machines, after 237 withheld cases had been diagnosed (decision 8)",
    )

    # What cannot be told apart
    equal_loss: float = _threshold(
        10.0, "loss", "candidates that differ by less cannot be told apart", _DEVELOPMENT
    )
    equal_loss_per_value: float = _threshold(
        0.003, "loss per compared value", "the same", "0.001 until 2026-11-20 (rule_changes.md)"
    )
    mixed_loss_per_value: float = _threshold(
        0.005,
        "loss per compared value",
        "the same where the experiments disagree",
        "0.003 until 2026-11-20 (rule_changes.md)",
    )
    mixed_t: float = _threshold(
        2.0, "standard errors", "experiments disagree where the mean difference is smaller", "about 95 %"
    )
    better_loss: float = _threshold(
        6.0, "loss", "a more complex candidate is listed where it is better by more", _DEVELOPMENT
    )
    most_equal: int = _threshold(3, "candidates", "listed as indistinguishable at most", _JUDGEMENT)

    # Faults of the logs
    fault_share: float = _threshold(
        0.9, "share of the squared error", "explained by a fault that decides the verdict check_logs", _ALARMS
    )
    fault_share_some: float = _threshold(
        0.5, "share of the squared error", "the same of a fault in some experiments only", _ALARMS
    )
    suspect_share: float = _threshold(
        0.25,
        "share of the squared error",
        "explained before parameters are fitted to the correction",
        _ALARMS,
    )
    fault_error_ratio: float = _threshold(
        0.5,
        "share of a prediction's squared error",
        "corrected model against prediction without a model",
        _ALARMS,
    )
    material_error: float = _threshold(
        0.005, "standard deviations within a run", "at or below this error no fault is searched", _ALARMS
    )
    inertia_error_ratio: float = _threshold(
        2.0, "1", "a wrong inertia must leave so many times the squared error of a wrong clock", _ALARMS
    )
    equal_error_ratio: float = _threshold(
        1.1, "1", "corrections whose squared errors differ by less cannot be told apart", _ALARMS
    )
    little_input: float = _threshold(
        0.1, "share of the input", "must be worse than none where an input has no effect", _ALARMS
    )
    outstanding_error: float = _threshold(
        4.0,
        "median of the others",
        "squared error of an experiment that may have a fault of its own",
        _ALARMS,
    )
    fewest_for_outstanding: int = _threshold(
        3, "experiments", "needed to say that one of them stands out", _JUDGEMENT
    )
    copied_noise: float = _threshold(
        0.1,
        "share of the filtered noise",
        "left over by a filter of another output that is its source",
        _ALARMS,
    )

    # Where the gap lies
    shown_channel_share: float = _threshold(
        0.2, "share of the gap", "a channel with more has regions and figures", _JUDGEMENT
    )
    least_gap_share: float = _threshold(
        0.005, "share of the gap", "channels with less are not listed", _JUDGEMENT
    )
    input_likeness: float = _threshold(
        0.999, "correlation", "a parameter acts like the gain of an input", _JUDGEMENT
    )
    port_likeness: float = _threshold(
        0.99, "correlation", "a parameter acts like the effort of a port", _JUDGEMENT
    )
    least_rule_share: float = _threshold(
        0.02, "share of what is lacking", "explained by a rule at a channel", _JUDGEMENT
    )
    sensor_handicap: float = _threshold(
        0.1,
        "share of what is lacking",
        "a rule at a sensor must explain so much more than another",
        _JUDGEMENT,
    )
    clear_correction: float = _threshold(
        4.0,
        "noise variances",
        "mean square of a correction above this ends the growth of windows",
        _JUDGEMENT,
    )
    blind_error: float = _threshold(
        3.0, "median standard errors", "a window with a larger error does not count", _JUDGEMENT
    )
    enough_experiments: int = _threshold(
        4, "experiments", "independent parts; fewer experiments are divided into stretches", _JUDGEMENT
    )
    region_density: float = _threshold(
        1.5, "share of the correction per share of the samples", "in a region, at least", _JUDGEMENT
    )
    region_t: float = _threshold(2.0, "standard errors", "a region's density above one", "about 95 %")
    region_share: float = _threshold(
        0.1, "share of the squared correction", "of a region, at least", _JUDGEMENT
    )
    most_regions: int = _threshold(6, "regions", "listed at most", _JUDGEMENT)
    factor_density: float = _threshold(
        1.3, "share of the gap per share of the samples", "at a level of a factor, at least", _JUDGEMENT
    )
    factor_significance: float = _threshold(
        0.02, "probability", "of a level's share by chance (permutation test), at most", _JUDGEMENT
    )


#: The thresholds of every diagnosis unless others are given.
DEFAULT_THRESHOLDS = Thresholds()
