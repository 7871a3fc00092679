"""Find what a model of a machine leaves out, from logs of the machine."""
