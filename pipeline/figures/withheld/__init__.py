"""Figures of the withheld check, diagnoses of machines with known faults; see `pipeline.figures`."""
