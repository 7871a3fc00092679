"""How sure an answer may be."""

from __future__ import annotations

#: Largest confidence: there were too few machines to say more.
HIGHEST_CONFIDENCE = 0.99
#: Share of the squared gap from which named effects explain most of it.
MOST = 0.5
#: A probability that the logs give holds as far as the model of machine and logs does. How often it does was
#: counted on fresh planted cases (docs/decisions/0018-evidence.md) of which the logs are sure: 15 of 25
#: answers without a law, 35 of 37 first laws, which is rounded down for machines unlike these, and four of
#: eight further laws are right.
NO_LAW, FIRST_LAW, FURTHER_LAW = 0.6, 0.9, 0.5


def of_no_law(left: float, noise: float) -> float:
    """Return the probability of an answer without a law.

    The best law that stands leaves a share of the squared residual; a share of the squared gap is the noise
    of the sensors, in which nothing can hide.

    Examples:
        >>> of_no_law(1.0, 1.0), of_no_law(1.0, 0.0) == NO_LAW
        (0.99, True)
    """
    return min(HIGHEST_CONFIDENCE, left * (noise + NO_LAW * (1.0 - noise)))


def of_law(probability: float, number: int) -> float:
    """Return the probability of a named law, the first one of an answer being number 0.

    Examples:
        >>> of_law(1.0, 1) == FURTHER_LAW
        True
    """
    return probability * (FURTHER_LAW if number else FIRST_LAW)
