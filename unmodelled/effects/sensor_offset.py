"""Offset of a sensor."""

from collections.abc import Mapping

from unmodelled.effects.added import Added
from unmodelled.effects.effect import SensorEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site

#: Standard deviation of the zeros of sensors, in the plausible size of an offset, a tenth of the signal.
USUAL_SIZES = 0.3


class SensorOffset(SensorEffect):
    """Constant added to the measured quantity."""

    family = "sensor_offset"
    says = "zero off by {y_0}"

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        return {name: USUAL_SIZES * added.scales[name] for name in added.amplitudes}

    def law(self, at: Site) -> Law:
        zero = at.zero("y")  # a thermometer is a few degrees off, not a tenth of the absolute temperature
        size = at["y"].high - zero if zero else at["y"].rms
        return Law("y + y_0", {"y_0": signed("1", 0.1 * size)})
