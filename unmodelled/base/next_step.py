"""What to do after a diagnosis, by one rule for terminal, page and notebook."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Entry = Mapping[str, Any]

#: File of the augmented system in the folder of an answer.
AUGMENTED = "augmented_system.yaml"
#: What to do next, by verdict.
NEXT_STEPS = {
    "effect": f"simulate {AUGMENTED} on new logs to confirm the effect",
    "main_effect": f"simulate {AUGMENTED} on new logs; index.html shows where the rest lies",
    "no_gap": "use the identified parameters; other motions can still show effects that these logs do not",
    "unknown": "see in index.html where the gap lies, then add the missing physics to the system file",
    "check_logs": "correct the logs, then diagnose again",
}
#: What to do next where the augmented system is not offered.
KEEP = "keep the system as given for simulations; see in index.html where the gap lies"


def next_step(content: Entry) -> str:
    """Return what to do next.

    Beside a gap that a wrong number makes, smaller effects are too small to be named.

    Examples:
        >>> next_step({"verdict": "check_logs", "effects": []})
        'correct the logs, then diagnose again'
    """
    if any(each["file"] == AUGMENTED for each in content.get("refused", ())):
        return KEEP
    texts = [str(e.get("text")) for e in content["effects"]]
    pairs = zip(texts, content["effects"], strict=True)
    wrong = [e["parameter"] for text, e in pairs if text.startswith(f"{e.get('parameter')} = ")]
    if content["verdict"] != "main_effect" or not wrong:
        return NEXT_STEPS[content["verdict"]]
    return f"correct {' and '.join(wrong)} in the system file, then diagnose again: smaller effects will show"
