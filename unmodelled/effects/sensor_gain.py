"""Gain error of a sensor."""

from collections.abc import Mapping

from unmodelled.effects.added import Added
from unmodelled.effects.effect import SensorEffect
from unmodelled.effects.law import Amplitude, Fixed, Law
from unmodelled.effects.place import Site

#: Standard deviation of the gains of sensors as they are calibrated: a few percent.
CALIBRATION = 0.03


class SensorGain(SensorEffect):
    """Constant relative error of the sensor's gain, about 0 degC of a temperature."""

    family = "sensor_gain"
    says = "gain off by {g}"

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        return dict.fromkeys(added.amplitudes, CALIBRATION)

    def law(self, at: Site) -> Law:
        if not (zero := at.zero("y")):
            return Law("(1 + g)*y", {"g": Amplitude("y", 0.1, (-0.95, 10.0))})
        amplitudes = {"g": Amplitude("(y - y_z)", 0.1, (-0.95, 10.0))}
        return Law("y + g*(y - y_z)", amplitudes, fixed={"y_z": Fixed("y", zero)})
