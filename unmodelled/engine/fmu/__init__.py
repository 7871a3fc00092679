"""Export of a system as a Functional Mock-up Unit (FMI 3.0, co-simulation)."""
