"""How sure an answer may be."""

from __future__ import annotations

#: Largest confidence: there were too few machines to say more.
HIGHEST_CONFIDENCE = 0.99
#: Share of the squared gap from which named effects explain most of it.
MOST = 0.5
