"""The withheld check: compare diagnoses with the known faults of virtual machines."""
