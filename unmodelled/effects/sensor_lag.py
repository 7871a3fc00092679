"""Lag of a sensor: a low-pass filter between a quantity and its log."""

from unmodelled.effects.effect import SensorEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Memory, Shape, share
from unmodelled.effects.place import Site

#: Number of time constants that are tried, and the longest one as a part of the longest experiment.
_TIMES, _LONGEST = 6, 0.05


class SensorLag(SensorEffect):
    """First-order low-pass filter of the sensor, such as of a speed that a drive has smoothed."""

    kind = "timing"
    family = "sensor_lag"

    def law(self, at: Site) -> Law:
        grid = geometric(at.period, _LONGEST * at.duration, _TIMES)
        return Law(
            "y_f, T_y*d(y_f)/dt = y - y_f",
            {"c_y": share("y_f - y")},
            {"T_y": Shape("t", grid, (0.5 * at.period, max(0.1 * at.duration, grid[-1])))},
            memory={"y_f": Memory("y", "(y - y_f)/T_y", start="y")},
        )
