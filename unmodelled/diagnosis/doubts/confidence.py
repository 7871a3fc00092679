"""How sure an answer may be."""

from __future__ import annotations

#: Largest confidence: there were too few machines to say more.
HIGHEST_CONFIDENCE = 0.99
#: Share of the squared gap from which named effects explain most of it.
MOST = 0.5
#: A probability that the logs give holds as far as the model of machine and logs does. How often it does was
#: counted on planted cases (docs/decisions/0018-evidence.md): where no law is named, of the first law, and of
#: further laws.
NO_LAW, FIRST_LAW, FURTHER_LAW = 0.65, 0.9, 0.5


def of_law(probability: float, number: int) -> float:
    """Return the probability of a named law, the first one of an answer being number 0.

    Examples:
        >>> of_law(1.0, 1) == FURTHER_LAW
        True
    """
    return probability * (FURTHER_LAW if number else FIRST_LAW)
