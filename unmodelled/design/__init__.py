"""Design of the next experiment: inputs, within limits, that tell the models of a diagnosis apart."""
