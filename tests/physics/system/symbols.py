"""Symbols that expressions are written with, and the scope that knows them and a table."""

from __future__ import annotations

from unmodelled.systems.model import symbol
from unmodelled.systems.scope import Scope, Value

NAMES = ("x", "v", "u", "b")
x, v, u, b = map(symbol, NAMES)
SCOPE = Scope({name: Value(symbol(name)) for name in NAMES}, {"cam": 0}, ("x", "v"))
