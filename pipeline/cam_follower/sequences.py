"""Runs as padded arrays, the input of a recurrent network (section 5.4.2)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput

#: The angle enters by its sine and cosine, which stay within the data however far the cam turns (5.4.3).
_DERIVED: Mapping[str, Callable[[Array], Array]] = {"sin(theta)": np.sin, "cos(theta)": np.cos}


@dataclass(frozen=True)
class SequenceInputs:
    """Names of the inputs of a network.

    Attributes:
        features: names of the features tau, one value per sample: signals of the campaign, sin(theta) and
            cos(theta).
        settings: names of the settings q_s, one value per run: columns of the table of experiments; default:
            none.

    Raises:
        BadInput: when there are no features, or a name occurs twice.
    """

    features: tuple[str, ...]
    settings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # a config file hands over lists
        object.__setattr__(self, "features", tuple(self.features))
        object.__setattr__(self, "settings", tuple(self.settings))
        if not self.features:
            raise BadInput("features: at least one is needed, got none")
        for kind, names in (("features", self.features), ("settings", self.settings)):
            for name in names:
                if names.count(name) > 1:
                    raise BadInput(f"{kind}: {name} is named more than once")


@dataclass(frozen=True)
class Sequences:
    """Runs of different length, with zeros after their end."""

    inputs: SequenceInputs
    runs: Indices  # (runs,), ids of the experiments
    features: Array  # (runs, steps, features), SI units
    settings: Array  # (runs, settings), SI units
    target: Array  # (runs, steps), detachment eps, m
    lengths: Indices  # (runs,), numbers of samples

    @classmethod
    def of(cls, campaign: Campaign, inputs: SequenceInputs, most: int | None = None) -> "Sequences":
        """Read all runs of a campaign with the signal eps, in the order of the campaign."""
        runs = campaign.experiments["exp"].to_numpy(np.int64)
        lengths = np.diff(campaign.offsets)
        if np.any(lengths == 0):
            raise BadInput(f"experiment {runs[np.argmin(lengths)]}: has no samples")
        lengths = lengths if most is None else np.minimum(lengths, most)
        features = np.zeros((len(runs), int(lengths.max(initial=0)), len(inputs.features)))
        for j, name in enumerate(inputs.features):
            _pad(campaign, _signal(campaign, name), name, lengths, features[..., j])
        target = np.zeros(features.shape[:2])
        _pad(campaign, _signal(campaign, "eps"), "eps", lengths, target)
        columns = [_setting(campaign, name) for name in inputs.settings]
        settings = np.stack(columns, -1) if columns else np.zeros((len(runs), 0))
        return cls(inputs, runs, features, settings, target, lengths)

    def __len__(self) -> int:
        return len(self.runs)

    @property
    def mask(self) -> Mask:
        """Whether a sample belongs to its run rather than to the padding, shape (runs, steps)."""
        real: Mask = np.arange(self.features.shape[1]) < self.lengths[:, None]
        return real

    def of_runs(self, rows: Indices) -> "Sequences":
        """Select runs, and pad them to the longest of them. Takes rows (selected,)."""
        lengths = self.lengths[rows]
        steps = int(lengths.max(initial=0))
        return replace(
            self,
            runs=self.runs[rows],
            features=self.features[rows, :steps],
            settings=self.settings[rows],
            target=self.target[rows, :steps],
            lengths=lengths,
        )


def _signal(campaign: Campaign, name: str) -> Array:
    source = "theta" if name in _DERIVED else name
    if source not in campaign.signals:
        known = ", ".join([*campaign.signals, *_DERIVED])
        raise BadInput(f"feature {name}: the campaign has no such signal, it must be one of {known}")
    values = np.asarray(campaign.signals[source], np.float64)
    if name not in _DERIVED:
        return values
    with np.errstate(invalid="ignore"):  # what is not finite is named with its run, where it is used
        return _DERIVED[name](values)


def _pad(campaign: Campaign, values: Array, name: str, lengths: Indices, out: Array) -> None:
    """Copy the first `lengths` samples of every run into `out` (runs, steps)."""
    for i, (start, length) in enumerate(zip(campaign.offsets[:-1], lengths, strict=True)):
        sequence = values[start : start + length]
        wrong = np.flatnonzero(~np.isfinite(sequence))
        if len(wrong):
            run = campaign.experiments["exp"].iloc[i]
            raise BadInput(f"experiment {run}: feature {name} is not a finite number at sample {wrong[0]}")
        out[i, :length] = sequence


def _setting(campaign: Campaign, name: str) -> Array:
    if name not in campaign.experiments:
        known = ", ".join(map(str, campaign.experiments))
        raise BadInput(f"setting {name}: the campaign has no such column, it must be one of {known}")
    try:
        values: Array = campaign.experiments[name].to_numpy(np.float64)
    except ValueError:
        raise BadInput(f"setting {name}: is not a column of numbers") from None
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong):
        raise BadInput(
            f"experiment {campaign.experiments['exp'].iloc[wrong[0]]}: setting {name} is not a finite number"
        )
    return values
