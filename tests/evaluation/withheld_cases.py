"""Made-up truths and diagnoses of the withheld check."""

from typing import Any

Content = dict[str, Any]

ACTS_AT = {"parameter:b": frozenset({"rail"}), "parameter:M": frozenset[str]()}


def effect(family: str, port: str, *others: tuple[str, str], **more: Any) -> Content:
    """As diagnosis.json names it, indistinguishable from `others`."""
    alike = [{"family": f, "port": p} for f, p in others]
    return {"family": family, "port": port, "indistinguishable": alike, **more}


def diagnosis(
    *effects: Content, verdict: str = "effect", confidence: float = 0.9, where: str = "rail", **gap: float
) -> Content:
    gaps = {"reidentified": 0.5, "neural": 0.2, "floor": 0.1, "shrink": 0.8}
    channels = [{"port": "actuator:u", "share": 0.1}, {"port": where, "share": 0.9}]
    return {
        "verdict": verdict,
        "confidence": confidence,
        "effects": list(effects),
        "where": {"channels": channels},
        "gap": gaps | gap,
    }


def truth(
    *effects: tuple[str, str], verdict: str = "effect", alike: tuple[tuple[str, str], ...] = (), **more: Any
) -> Content:
    others = [{"family": f, "channel": c} for f, c in alike]
    rows = [{"family": f, "channel": c, "alike": others, **more} for f, c in effects]
    return {"verdict": verdict, "system": "hoist", "level": 1.0, "effects": rows}


def refit(
    *seen: bool, gap_seen: bool = True, shrink: float = 0.9, term: tuple[str, str] | None = None
) -> Content:
    said = None if term is None else {"family": term[0], "channel": term[1]}
    return {"oracle": {"seen": list(seen), "gap_seen": gap_seen, "shrink": shrink}, "sparse_regression": said}
