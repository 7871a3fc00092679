"""Figures of the withheld check, diagnoses of machines whose faults are known; see `pipeline.figures`."""
