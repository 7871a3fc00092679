"""Thresholds of a diagnosis, each with its meaning, unit, origin and sensitivity.

Grids, budgets and tolerances of optimisers are not thresholds: they stay beside the code that uses them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

_DEVELOPMENT = "chosen on withheld machines with seeds below 100 (decision 8)"
_MEASURED_MACHINES = "chosen on measured machines, after 237 withheld cases had been diagnosed (decision 8)"
_JUDGEMENT = "judgement of its first version; no study is recorded"
_ALARMS = "no false alarm on 139 withheld cases, EMPS and six other measured machines (rule_changes.md)"
_NO_DECISION = "none of 23 decisions changes at half and at twice the value (decision 10)"
_NO_FAULT = "none of the faults of 17 logs changes at half and at twice the value (decision 10)"
_NO_PLACE = "no channel, region or factor of 3 diagnoses changes at half and at twice the value (decision 10)"
_UNMEASURED = "not measured"


def _threshold(value: float, unit: str, origin: str, sensitivity: str) -> Any:
    """Return a field of `Thresholds` with its documentation as metadata."""
    return field(default=value, metadata={"unit": unit, "origin": origin, "sensitivity": sensitivity})


@dataclass(frozen=True)
class Thresholds:
    """Every threshold of a diagnosis.

    The metadata of a field has `unit`, `origin` (why it has this value) and `sensitivity` (what changes at
    half and at twice the value). The noise ratio of a model is the mean square of its remaining free-run
    errors, in variances of the sensor noise, less one: zero at the noise floor. The loss is Huber's, a
    negative logarithm of a likelihood.

    Attributes:
        held_out_share: share of the experiments that is held out from fitting and choosing, at least one
            experiment.
        longest_delay: longest additional sensor delay that is a candidate.
        longest_delay_share: longest additional sensor delay in short experiments.
        input_timing: time by which an input may act before or after its logged time without being called
            delayed.
        most_levels: largest number of levels of a factor; a column of experiments.csv with more is not one.
        fewest_per_level: smallest number of experiments of a level that has candidates of its own.
        local_complexity: complexity added for an effect at one level of a factor only.
        known_parameter_complexity: complexity added for an effect on a parameter that is not uncertain.
        penalty: loss that a unit of complexity must save.
        largest_penalty_factor: largest factor of the penalty, reached while a large gap remains.
        same_complexity: difference up to which a candidate does not count as more complex.
        simple_complexity: complexity below which no simpler candidate of more effects is searched.
        significant_loss: loss that one effect more must save.
        significant_loss_per_complexity: loss that one effect more must save besides.
        further_share: share that a second or third effect must explain.
        at_floor: noise ratio up to which no second effect is added.
        above_floor: noise ratio above which a gap remains (verdict unknown), and up to which no third effect
            is added.
        above_floor_share: noise ratio up to which no gap remains, relative to that of the known physics.
        far_from_floor: noise ratio above which no candidate comes near the noise, and complexity is weighed
            against the gap.
        complexity_share: share that a unit of complexity must explain far from the noise.
        equal_loss: loss by which candidates differ that cannot be told apart.
        equal_loss_per_value: loss per compared value for the same.
        mixed_loss_per_value: loss per compared value for the same, where the experiments disagree.
        mixed_t: mean difference up to which experiments disagree.
        better_loss: loss by which a more complex candidate must be better to be listed.
        most_equal: largest number of effects listed as indistinguishable.
        fault_share: share that a fault explains at least, if it decides the verdict check_logs.
        fault_share_some: share that a fault in some experiments explains at least.
        suspect_share: share that a correction explains before parameters are fitted to it.
        fault_error_ratio: squared error of the corrected model against that of a prediction without a model,
            at most.
        material_error: error up to which no fault is searched.
        inertia_error_ratio: squared error that a wrong inertia leaves against a wrong clock, at least.
        equal_error_ratio: ratio of squared errors of corrections that cannot be told apart.
        little_input: amount of an input that must be worse than none where the input has no effect.
        outstanding_error: squared error of an experiment that may have a fault of its own, at least.
        fewest_for_outstanding: smallest number of experiments of which one can stand out.
        copied_noise: residual of a filter that computes an output from another one, at most.
        shown_channel_share: share of a channel that has regions and figures, at least.
        least_gap_share: share of a channel that is listed, at least.
        input_likeness: likeness of a parameter's effect to that of an input's gain, at least.
        port_likeness: likeness of a parameter's effect to that of a port's effort, at least.
        least_rule_share: share that a rule at a channel explains, at least.
        sensor_handicap: share that a rule at a sensor must explain more than another rule.
        clear_correction: mean square of a correction above which windows are long enough.
        blind_error: standard error of a correction up to which its window counts.
        enough_experiments: number of experiments that are independent parts; fewer are divided into
            stretches.
        region_density: density of a region, at least.
        region_t: distance of the density of a region above one, at least.
        region_share: share of a region, at least.
        most_regions: largest number of regions listed.
        factor_density: density of a level of a factor, at least.
        factor_significance: probability of a level's share by chance, at most (permutation test).

    Example:
        >>> Thresholds().held_out_share
        0.25
        >>> Thresholds(held_out_share=0.5).held_out_share
        0.5
    """

    # Experiments and the search space
    held_out_share: float = _threshold(0.25, "share of the experiments", _JUDGEMENT, _UNMEASURED)
    longest_delay: int = _threshold(64, "samples", _JUDGEMENT, _UNMEASURED)
    longest_delay_share: float = _threshold(0.1, "share of the shortest experiment", _JUDGEMENT, _UNMEASURED)
    input_timing: float = _threshold(
        0.6, "sampling periods", "half a sample of zero-order hold, and a tenth for the fit", _UNMEASURED
    )
    most_levels: int = _threshold(8, "levels", _JUDGEMENT, _UNMEASURED)
    fewest_per_level: int = _threshold(2, "experiments", _JUDGEMENT, _UNMEASURED)

    # Complexity of a candidate
    local_complexity: float = _threshold(1.5, "units of complexity", _DEVELOPMENT, _NO_DECISION)
    known_parameter_complexity: float = _threshold(1.0, "units of complexity", _DEVELOPMENT, _NO_DECISION)
    penalty: float = _threshold(0.003, "loss per compared value", _DEVELOPMENT, _NO_DECISION)
    largest_penalty_factor: float = _threshold(4.0, "1", _DEVELOPMENT, _NO_DECISION)
    same_complexity: float = _threshold(
        0.6,
        "units of complexity",
        _DEVELOPMENT,
        "half: 1 of 23 lists of indistinguishable effects changes; twice: 3",
    )
    simple_complexity: float = _threshold(4.0, "units of complexity", _JUDGEMENT, _UNMEASURED)

    # Number of effects
    significant_loss: float = _threshold(40.0, "loss", _DEVELOPMENT, _NO_DECISION)
    significant_loss_per_complexity: float = _threshold(
        3.0, "loss per unit of complexity", _DEVELOPMENT, _NO_DECISION
    )
    further_share: float = _threshold(
        0.5,
        "share of the noise ratio",
        _DEVELOPMENT,
        "half: effects of 3 of 23 cases change; twice (all of it): 1 verdict of 23, a pair",
    )
    at_floor: float = _threshold(0.05, "noise ratio", _DEVELOPMENT, _NO_DECISION)
    above_floor: float = _threshold(
        0.15, "noise ratio", "0.25 until 2026-11-20 (rule_changes.md)", _NO_DECISION
    )
    above_floor_share: float = _threshold(
        0.04,
        "share of the known physics' noise ratio",
        _DEVELOPMENT,
        "half: 1 of 23 verdicts, EMPS effect to unknown; twice: none of 23",
    )
    far_from_floor: float = _threshold(10.0, "noise ratio", _MEASURED_MACHINES, _NO_DECISION)
    complexity_share: float = _threshold(
        0.005,
        "share of the known physics' noise ratio",
        _MEASURED_MACHINES,
        "half: named effects of 1 of 23 cases (EMPS) change; twice: none of 23",
    )

    # Effects that cannot be told apart
    equal_loss: float = _threshold(10.0, "loss", _DEVELOPMENT, _NO_DECISION)
    equal_loss_per_value: float = _threshold(
        0.003, "loss per compared value", "0.001 until 2026-11-20 (rule_changes.md)", _NO_DECISION
    )
    mixed_loss_per_value: float = _threshold(
        0.005, "loss per compared value", "0.003 until 2026-11-20 (rule_changes.md)", _NO_DECISION
    )
    mixed_t: float = _threshold(2.0, "standard errors", "about 95 %", _NO_DECISION)
    better_loss: float = _threshold(
        6.0,
        "loss",
        _DEVELOPMENT,
        "half: 2 of 23 lists of indistinguishable effects change; twice: none of 23",
    )
    most_equal: int = _threshold(
        3, "candidates", _JUDGEMENT, "half: 2 of 23 lists are shorter; twice: 1 is longer"
    )

    # Faults of the logs
    fault_share: float = _threshold(
        0.9, "share of the squared error", _ALARMS, "half, and half way to one: none of 17 logs"
    )
    fault_share_some: float = _threshold(
        0.5,
        "share of the squared error",
        _ALARMS,
        "half: none of 17 logs; twice (all of it): 7 faults of one experiment are missed",
    )
    suspect_share: float = _threshold(0.25, "share of the squared error", _ALARMS, _NO_FAULT)
    fault_error_ratio: float = _threshold(0.5, "share of a prediction's squared error", _ALARMS, _NO_FAULT)
    material_error: float = _threshold(0.005, "standard deviations within a run", _ALARMS, _NO_FAULT)
    inertia_error_ratio: float = _threshold(2.0, "1", _ALARMS, _NO_FAULT)
    equal_error_ratio: float = _threshold(
        1.1, "1", _ALARMS, "part above one halved and doubled: none of 17 logs"
    )
    little_input: float = _threshold(
        0.1,
        "share of the input",
        _ALARMS,
        "not measured: the 17 logs of decision 10 have no input without effect",
    )
    outstanding_error: float = _threshold(4.0, "median of the others", _ALARMS, _NO_FAULT)
    fewest_for_outstanding: int = _threshold(3, "experiments", _JUDGEMENT, _NO_FAULT)
    copied_noise: float = _threshold(
        0.1,
        "share of the filtered noise",
        _ALARMS,
        "not measured: the 17 logs of decision 10 have no computed output",
    )

    # Where the gap lies
    shown_channel_share: float = _threshold(0.2, "share of the gap", _JUDGEMENT, _NO_PLACE)
    least_gap_share: float = _threshold(0.005, "share of the gap", _JUDGEMENT, _NO_PLACE)
    input_likeness: float = _threshold(
        0.999,
        "correlation",
        _JUDGEMENT,
        "not measured: the 3 diagnoses of decision 10 have no effect on a parameter",
    )
    port_likeness: float = _threshold(
        0.99,
        "correlation",
        _JUDGEMENT,
        "not measured: the 3 diagnoses of decision 10 have no effect on a parameter",
    )
    least_rule_share: float = _threshold(0.02, "share of what is lacking", _JUDGEMENT, _NO_PLACE)
    sensor_handicap: float = _threshold(0.1, "share of what is lacking", _JUDGEMENT, _NO_PLACE)
    clear_correction: float = _threshold(4.0, "noise variances", _JUDGEMENT, _NO_PLACE)
    blind_error: float = _threshold(3.0, "median standard errors", _JUDGEMENT, _NO_PLACE)
    enough_experiments: int = _threshold(4, "experiments", _JUDGEMENT, _NO_PLACE)
    region_density: float = _threshold(
        1.5,
        "share of the correction per share of the samples",
        _JUDGEMENT,
        "half: 1 region more in 3 diagnoses; twice: 1 less",
    )
    region_t: float = _threshold(
        2.0, "standard errors", "about 95 %", "half: 8 regions more in 3 diagnoses; twice: 1 less"
    )
    region_share: float = _threshold(
        0.1, "share of the squared correction", _JUDGEMENT, "half: none in 3 diagnoses; twice: 1 region less"
    )
    most_regions: int = _threshold(6, "regions", _JUDGEMENT, _NO_PLACE)
    factor_density: float = _threshold(
        1.3, "share of the gap per share of the samples", _JUDGEMENT, _NO_PLACE
    )
    factor_significance: float = _threshold(0.02, "probability", _JUDGEMENT, _NO_PLACE)


#: The thresholds of every diagnosis unless others are given.
DEFAULT_THRESHOLDS = Thresholds()
