"""Read diagnosis.json (`diagnosis/2`) and related files, and check their form."""

from functools import partial
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


def _read(shape: Shape, path: Path) -> dict[str, Any]:
    content: dict[str, Any] = read_shaped(path, shape)
    return content


#: Readers of a diagnosis, with everything that a page shows of it, and of a withheld case.
read_told, read_judged = partial(_read, _TOLD), partial(_read, _JUDGED)
#: Readers of the planted effects of a case, its refit with known effects, and its errors on validation runs.
read_truth, read_refit, read_validation = (partial(_read, shape) for shape in (_TRUTH, _REFIT, _VALIDATION))


def read_held_out(path: Path) -> list[str]:
    """Read the ids of the held-out experiments of a diagnosis."""
    found: list[str] = _read({"gap": {"held_out": [str]}}, path)["gap"]["held_out"]
    return found
