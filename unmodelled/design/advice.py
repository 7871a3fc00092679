"""Advice on the parameters of a system, from an analysis of identifiability."""

from __future__ import annotations

from collections.abc import Sequence

from unmodelled.design.absorption import beside_networks
from unmodelled.design.identifiability import ABSORBED, MOST, Identifiability, ParameterSet
from unmodelled.systems.model import System

#: Sets that are recommended, and groups of parameters to separate, that are put into words.
SHOWN = 3
WARNED = 12


def advise(system: System, result: Identifiability) -> list[str]:
    """Return sentences on which parameters can be identified, must be separated, and are to be held fixed."""
    best = [f"{_set(s.names)} can be identified together" for s in result.sets if s.maximal][:SHOWN]
    return [
        *_marked(system, result),
        *(best or ["no parameter can be identified from these data"]),
        *[_warning(result, s) for s in _culprits(result)][:WARNED],
        *[_absorbed(system, result, name) for name in result.absorbed if name in result.sensitive],
        *_insensitive(result),
    ]


def _set(names: Sequence[str]) -> str:
    return f"{{{', '.join(names)}}}"


def _marked(system: System, result: Identifiability) -> list[str]:
    names = tuple(n for n in system.uncertain if n in result.found.parameters)
    if not names:
        return []
    verdict = result.judge(names)
    can = "can" if verdict.both else "cannot"
    numbers = f"{verdict.collinearity:.3g}, beside networks {verdict.collinearity_with_network:.3g}"
    return [
        f"{_set(names)}, marked in the system file, {can} be identified together "
        f"(collinearity {numbers}; limit {result.limit:g})"
    ]


def _culprits(result: Identifiability) -> list[ParameterSet]:
    """Return the smallest sets that fail although each of their members could be identified alone."""
    usable = {*result.sensitive} - {*result.absorbed}
    failing = [s for s in result.sets if not s.both and {*s.names} <= usable]
    smallest = [s for s in failing if not any({*o.names} < {*s.names} for o in failing)]
    return sorted(smallest, key=lambda s: (len(s.names), -max(s.collinearity, s.collinearity_with_network)))


def _warning(result: Identifiability, s: ParameterSet) -> str:
    names = sorted(s.names, key=lambda n: -result.norms[n])
    if len(names) == 1:
        effort = max(result.found.efforts, key=lambda e: abs(result.correlation_of(e, names[0])))
        value = result.correlation_of(effort, names[0])
        return f"{names[0]} acts like the effort {effort} (correlation {value:.2f}): hold it fixed"
    if len(names) > 2:
        worst = max(s.collinearity, s.collinearity_with_network)
        return (
            f"{', '.join(names[:-1])} and {names[-1]} cannot all be identified together (collinearity "
            f"{worst:.3g}): hold one of them fixed"
        )
    a, b = names
    value, left = result.correlation_of(a, b), result.left_correlation_of(a, b)
    head = f"{a} and {b} must be separated: "
    if abs(value) > result.correlated or (not s.identifiable and not result.found.efforts):
        return f"{head}their effects on the model output are correlated ({value:.2f})"
    if not s.with_network:
        return f"{head}what networks leave of their effects is correlated ({left:.2f})"
    return (
        f"{head}with the effort {', '.join(result.found.efforts)} their effects on the model output are "
        f"collinear (index {s.collinearity:.3g})"
    )


def _absorbed(system: System, result: Identifiability, name: str) -> str:
    """Return a sentence with the port whose network alone absorbs the parameter, or with all ports."""
    column = len(result.found.efforts) + result.found.parameters.index(name)
    effect = result.found.matrix[:, [column]]
    energy = float((effect**2).sum())
    where = ", ".join(system.port_names)
    for k, port in enumerate(system.port_names):
        gain, inputs = result.found.matrix[:, k], result.found.inputs[k]
        left = beside_networks(effect, [gain], [inputs])
        if float((left**2).sum()) < ABSORBED * energy:
            where = port
            break
    plural = "s" if "," in where else ""
    return (
        f"{name} is absorbed by the network{plural} in port{plural} {where}: hold it fixed or give the "
        f"network{plural} other inputs"
    )


def _insensitive(result: Identifiability) -> list[str]:
    silent = [n for n in result.found.parameters if result.norms[n] == 0.0]
    weak = [n for n in result.found.parameters if n not in result.sensitive and n not in silent]
    capped = [n for n in result.sensitive if n not in result.compared]
    return [
        *(f"{n} hardly matters (sensitivity {result.norms[n]:.2g}): hold it fixed" for n in weak),
        *(f"{n} has no effect on the derivative of any state: hold it fixed" for n in silent),
        *(
            f"{n} is not among the {MOST} most sensitive parameters: its sets were not looked at"
            for n in capped
        ),
    ]
