"""The withheld check: diagnoses of machines whose faults are known, judged."""
