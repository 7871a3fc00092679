"""Numbers that logs determine only together with others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unmodelled.design.audit.fits import AuditFits
from unmodelled.diagnosis.data.remark import Remark
from unmodelled.diagnosis.doubts.undetermined import COMBINED_RATIO, Z, combination, undetermined

#: Least correlation of two numbers that change together.
TOGETHER = 0.5


def ties(fits: AuditFits) -> dict[str, Remark]:
    """Return the combination that a number is a part of, by its name.

    Of combinations that leave numbers loose, the diagnosis tells those that its fits determine least. Where a
    number is loose by its interval alone, the covariance of all open numbers tells what it goes along with.
    """
    said = (remark for remark in undetermined(fits.steady) if len(remark.numbers) > 1)
    found = {name: remark for remark in said for name in remark.numbers}
    return {**{name: remark for remark in _loose(fits) for name in remark.numbers}, **found}


def _loose(fits: AuditFits) -> Iterator[Remark]:
    """Combinations of numbers that are not determined, and would be if the others were known."""
    level, values = fits.judged.every.options.level, fits.numbers.fitted.fit.values
    names = [name for name in fits.opened if values[name] != 0.0]
    if len(names) < 2:
        return
    spread = fits.numbers.spread(names)
    alone = 1.0 / np.diag(np.linalg.inv(spread))
    size, told = np.sqrt(np.diag(spread)), set[str]()
    for k in np.argsort(-size).tolist():
        name = names[k]
        found = fits.numbers.estimate(name, "1", 0.0, level)
        if found.determined or name in told or size[k] ** 2 < COMBINED_RATIO**2 * alone[k]:
            continue
        like = spread[k] / (size[k] * size)
        moves = {n: Z * float(like[j] * size[j]) for j, n in enumerate(names) if abs(like[j]) >= TOGETHER}
        if len(moves) > 1:
            told |= set(moves)
            yield combination(fits.steady, moves)
