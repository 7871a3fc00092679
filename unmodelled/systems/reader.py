"""Safe reader of `system/1` files; nothing in a file is executed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from unmodelled.base.errors import Faults
from unmodelled.systems.declarations import read_declarations
from unmodelled.systems.document import Node, load_yaml
from unmodelled.systems.equations import Equations
from unmodelled.systems.model import System, symbol
from unmodelled.systems.names import checked_name
from unmodelled.systems.robot.model import RobotModel
from unmodelled.systems.robot.sections import with_robot

SCHEMA = "system/1"
_REQUIRED = ("schema", "name", "states", "outputs", "dynamics")
_OPTIONAL = ("inputs", "operating_point", "parameters", "signals", "ports", "tables", "events")
_OF_ROBOTS = ("model", "locked", "identify")


def read_system(path: Path | str, robot_numbers: Sequence[str] = ()) -> System:
    """Read a system file (system/1); nothing in the file is executed.

    Args:
        path: YAML file with states, inputs, outputs, parameters, ports and dynamics.
        robot_numbers: patterns, such as "*.damping", of numbers of its robot file that are parameters
            beside those that the file names, if they are not 0; default none.

    Returns:
        The system that the file describes.

    Raises:
        BadInput: one line per fault that names file, line and place. Expressions are checked once sections
            and names are right, and an expression that uses a name with a fault once that is mended.

    Examples:
        >>> import unmodelled as um
        >>> system, _ = um.example("pendulum")
        >>> again = um.read_system(system.source)
        >>> again == system
        True
        >>> again.port_names, again.uncertain
        (('joint',), ('b',))
    """
    root = load_yaml(Path(path))
    schema = root.entries().get("schema")
    if schema is None or schema.content != SCHEMA:
        raise (schema or root).wrong(f"must start with 'schema: {SCHEMA}'")
    faults = Faults()
    sections, robot = _sections(root, faults, robot_numbers)
    name = ""
    with faults.collected():
        name = checked_name(sections["name"].text(), sections["name"]) if "name" in sections else ""
    sound = len(faults) == 0
    declared = read_declarations(sections, faults)
    if not sound or declared.names.refused:  # expressions would have faults that follow from these
        faults.check()
    found = Equations(sections, declared, robot, faults=faults).system(name)
    _check_starts(found, sections)
    return replace(found, source=str(path))


def _sections(
    root: Node, faults: Faults, robot_numbers: Sequence[str]
) -> tuple[dict[str, Node], RobotModel | None]:
    """Return the top-level entries, and the robot if the file names one, whose entries are among them."""
    entries = root.entries()
    if "model" not in entries:
        for key in [key for key in entries if key in _OF_ROBOTS]:
            wrong = "belongs to a robot: add model, the name of its MJCF or URDF file"
            faults.add(str(entries[key].wrong(wrong)))
        with faults.collected():
            root.fields(_REQUIRED, (*_OPTIONAL, *_OF_ROBOTS))
        return {key: node for key, node in entries.items() if key in (*_REQUIRED, *_OPTIONAL)}, None
    if "events" in entries:
        raise entries["events"].wrong("a system with a robot has no events: remove them")
    return with_robot(root.fields(_REQUIRED[:2], (*_REQUIRED[2:], *_OPTIONAL, *_OF_ROBOTS)), robot_numbers)


def _check_starts(system: System, sections: dict[str, Node]) -> None:
    """Refuse numbers of single experiments anywhere but in initial values."""
    read = [*system.dynamics, *(output.expression for output in system.outputs)]
    read += [port.law for port in system.ports if port.law is not None]
    read += [rate for event in system.events for rate in (event.expression, *(event.then or ()))]
    names = {s for expression in read for s in expression.free_symbols}
    for parameter in system.parameters:
        if parameter.per_experiment and symbol(parameter.name) in names:
            written = sections["parameters"].entries() if "parameters" in sections else {}
            state = parameter.name.removesuffix("_0")
            node = written.get(parameter.name) or sections["states"].entries()[state]
            raise node.wrong(
                f"only initial values may use {parameter.name!r}, which every experiment has for itself"
            )
