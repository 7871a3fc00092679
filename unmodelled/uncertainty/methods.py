"""Names of the propagation methods in tables and results."""

from __future__ import annotations

#: Gaussian and maximum entropy densities from polynomial chaos are the text's (section 3.4.2).
GAUSSIAN, MAXIMUM_ENTROPY, PUSH_FORWARD = "gaussian", "maximum_entropy", "push_forward"
CHAOS = (GAUSSIAN, MAXIMUM_ENTROPY)
METHODS = (*CHAOS, PUSH_FORWARD)
#: In the place of a method at whose optimum something was taken: the distribution that data were drawn from.
PLANTED = "planted"
