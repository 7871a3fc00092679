"""The measurement chain of a real campaign: drive, control, sensors, filters and clock.

Every part is drawn at random for a case. The known physics of the case does not contain it.
"""
