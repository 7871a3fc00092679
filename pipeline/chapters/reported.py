"""Read diagnosis.json (`diagnosis/2`) and related files, and check their form."""

from pathlib import Path
from typing import Any

from unmodelled.base.shapes import Shape, read_shaped

_NAMED = {"family": str, "port": str}
_NUMBER = (float, None)  # null where it is not finite

#: What everyone who reads a diagnosis needs of it.
_CORE = {
    "verdict": frozenset({"effect", "main_effect", "no_gap", "unknown", "check_logs"}),
    "confidence": float,
    "effects": [_NAMED | {"indistinguishable": [_NAMED]}],
}
#: What judging one takes.
_JUDGED = _CORE | {
    "where": {"channels": [{"port": str, "share": float}]},
    "gap": {"reidentified": float, "neural": float, "floor": float, "shrink": _NUMBER},
}
#: What telling all of it takes.
_TOLD = {
    "schema": frozenset({"diagnosis/2"}),
    **_CORE,
    "effects": [
        {
            **_NAMED,
            "law": str,
            "indistinguishable": [_NAMED],
            "parameters": {"*": {"value": _NUMBER, "interval": ([_NUMBER], None)}},
        }
    ],
    "where": {
        "channels": [{"port": str, "share": float}],
        "regions": [{"signal": str, "low": float, "high": float, "share": float}],
        "factors": [{"factor": str, "level": (str, float), "share": float}],
        "experiments": [{"id": str, "augmented": _NUMBER}],
    },
    "gap": {
        **dict.fromkeys(("known", "reidentified", "augmented", "floor"), float),
        **{"neural": _NUMBER, "shrink": _NUMBER, "interval": [_NUMBER], "held_out": [str]},
    },
    "parameters": {"*": {"known": _NUMBER, "identified": _NUMBER, "interval": ([_NUMBER], None)}},
    "comparison": [{"effects": [{"family": str, "port": str}], "difference": float, "named": bool}],
    "notes": [str],
}
_TRUTH = {
    "verdict": str,
    "system": str,
    "level": (float, None),
    "effects": [{"family": str, "channel": str, "alike": [{"family": str, "channel": str}]}],
}
_VALIDATION = {"reidentified": _NUMBER, "augmented": _NUMBER}
_REFIT = {
    "oracle": {"seen": [bool], "gap_seen": bool, "shrink": float},
    "sparse_regression": ({"family": str, "channel": str}, None),
}


def read_told(path: Path) -> dict[str, Any]:
    """Read a diagnosis with everything that a page shows of it."""
    return _read(path, _TOLD)


def read_judged(path: Path) -> dict[str, Any]:
    """Read a diagnosis of a withheld case."""
    return _read(path, _JUDGED)


def read_held_out(path: Path) -> list[str]:
    """Read the ids of the held-out experiments of a diagnosis."""
    found: list[str] = _read(path, {"gap": {"held_out": [str]}})["gap"]["held_out"]
    return found


def read_truth(path: Path) -> dict[str, Any]:
    """Read the planted effects of a withheld case."""
    return _read(path, _TRUTH)


def read_refit(path: Path) -> dict[str, Any]:
    """Read the refit of a withheld case with known planted effects."""
    return _read(path, _REFIT)


def read_validation(path: Path) -> dict[str, Any]:
    """Read the errors of a diagnosis on validation experiments."""
    return _read(path, _VALIDATION)


def _read(path: Path, shape: Shape) -> dict[str, Any]:
    content: dict[str, Any] = read_shaped(path, shape)
    return content
