"""A system file of a hoist that may be changed, and the complaint that reading a bad file ends with."""

from pathlib import Path

from tests.machines.known import refusals
from unmodelled.systems.reader import read_system

HOIST = """\
schema: system/1
name: hoist
states:                        # order = state vector x
  x: {unit: m}
  v: {unit: m/s}               # optional keys: initial (default 0; used when no output measures it)
inputs:                        # order = input vector u
  u: {unit: V, column: u}      # log column; optional: delay [s] (default 0)
outputs:                       # y = g(x, u; p); a log column each
  x: {column: x, unit: m}      # optional: expression (default: the state of that name), delay [s]
  v: {column: v, unit: m/s}
operating_point:               # optional; constants of one experiment, columns of experiments.csv
  m: {unit: kg}
parameters:
  M:  {value: 8.5, unit: kg}                                           # known: held fixed
  kf: {value: 12.0, unit: N/V}
  b:  {value: 31.0, unit: N s/m, identify: true, bounds: [5, 90]}      # uncertain: identified
signals:                       # named expressions, in order; diff(expression, state) is allowed
  F_m: kf*u
ports:                         # where an effort that the model leaves out can act
  rail: {effort: F_rail, unit: N, position: x, velocity: v}   # position/velocity: state or signal
tables:                        # optional: measured characteristics
  f_t: {file: converter.csv, x: speed_ratio, y: torque_ratio, kind: cubic}
dynamics:                      # time derivative of every state; efforts appear as symbols
  x: v
  v: (F_m - b*v - F_rail)/M - 9.81
"""
CONVERTER = "speed_ratio,torque_ratio\n0,2.0\n0.5,1.5\n0.9,1.0\n1.0,0.2\n"


def written(folder: Path, text: str, table: str = CONVERTER) -> Path:
    """The system file and its table in `folder`; the path of the former."""
    (folder / "converter.csv").write_text(table)
    path = folder / "hoist.yaml"
    path.write_text(text)
    return path


def changed(*changes: tuple[str, str]) -> str:
    """The file of the hoist with other words in place of some that occur once."""
    text = HOIST
    for old, new in changes:
        assert text.count(old) == 1, f"{old!r} must occur once"
        text = text.replace(old, new)
    return text


def line_of(text: str, part: str) -> int:
    """Number of the line where `part` begins."""
    return text[: text.index(part)].count("\n") + 1


def complaints(path: Path) -> list[str]:
    """All faults for which the file is refused."""
    return refusals(lambda: read_system(path))


def complaint(path: Path) -> str:
    """The one line that refuses the file, with no other fault; it begins with the path."""
    (message,) = complaints(path)
    assert "\n" not in message and message.isprintable()
    assert message.startswith(f"{path}: ")
    return message
