"""Parser of the expressions of a system file: text to SymPy against an allow-list; nothing is executed."""

from __future__ import annotations

import ast
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import sympy as sp

from unmodelled.base.errors import BadInput, closest
from unmodelled.systems import numbers, quantities, units
from unmodelled.systems.functions import lookup, sanitised
from unmodelled.systems.model import TIME, symbol
from unmodelled.systems.numbers import NoValue
from unmodelled.systems.operations import COMPARISONS, FUNCTIONS, OPERATORS, RANKS, Operation
from unmodelled.systems.quantities import CLOCK, UNKNOWN, NotDimensionless, Quantity, UnitsDiffer
from unmodelled.systems.robot.model import MotionFunction
from unmodelled.systems.scope import DEEPEST_TREE, LARGEST, Scope, Value, has_large_derivative, tree_size
from unmodelled.systems.syntax import shown, tree
from unmodelled.systems.units import ONE

DEEPEST = 40


def parse(text: str, scope: Scope, where: str) -> sp.Expr:
    """Parse a text as a SymPy expression."""
    return evaluate(text, scope, where).expression


def evaluate(text: str, scope: Scope, where: str) -> Value:
    """Parse a text as a SymPy expression, together with its unit and size.

    Args:
        text: expression as written by the user.
        scope: names that the expression can use.
        where: start of the error message, such as file and line.

    Returns:
        Expression with its dimension (as far as it is known) and the size of its tree.

    Raises:
        BadInput: if the text is not a valid expression, or if its units do not match.
    """
    line, body = tree(text, where)
    builder = _Builder(line, scope, where)
    value = builder.value(body)
    try:
        expression = sanitised(numbers.checked_numbers(value.expression))
    except NoValue:
        raise builder.wrong(f"{shown(line)} has no finite real value") from None
    return Value(expression, value.quantity, *tree_size(expression))


@dataclass(frozen=True)
class _Builder:
    line: str
    scope: Scope
    where: str

    def wrong(self, problem: str) -> BadInput:
        return BadInput(f"{self.where}: {problem}")

    def source(self, node: ast.expr) -> str:
        return shown(ast.get_source_segment(self.line, node) or self.line)

    def value(self, node: ast.expr, depth: int = 0) -> Value:
        if depth > DEEPEST:
            raise self.wrong(
                f"the expression is nested too deeply: more than {DEEPEST} levels: name parts of it "
                "in signals"
            )
        match node:
            case ast.Constant(value=int() | float() as literal) if not isinstance(literal, bool):
                return self._literal(node, literal)
            case ast.Name():
                return self._name(node)
            case ast.UnaryOp(op=ast.USub() | ast.UAdd()):
                return self._signed(node, depth)
            case ast.BinOp():
                return self._chain(node, depth)
            case ast.Compare(ops=[comparison], comparators=[right]) if type(comparison) in COMPARISONS:
                parts = [node.left, right]
                return self._apply(COMPARISONS[type(comparison)], node, parts, self._values(parts, depth))
            case ast.Compare():
                raise self.wrong(
                    f"{self.source(node)}: comparisons cannot be chained: multiply them, "
                    "as in (a < b)*(b < c)"
                )
            case ast.Call():
                return self._call(node, depth)
        raise self.wrong(f"{self.source(node)} is not allowed")

    def _values(self, nodes: Sequence[ast.expr], depth: int) -> list[Value]:
        return [self.value(node, depth + 1) for node in nodes]

    def _literal(self, node: ast.expr, literal: int | float) -> Value:
        try:
            exact = numbers.exact_number(literal)
        except NoValue:
            raise self.wrong(f"{self.source(node)} is not a finite number: write a smaller one") from None
        return Value(exact, quantities.literal(literal))

    def _name(self, node: ast.Name) -> Value:
        name = node.id
        if name in self.scope.values and name not in self.scope.refused:
            return self.scope.values[name]
        if name == "t":
            return Value(TIME, CLOCK)
        if name == "pi":
            return Value(sp.Float(math.pi), quantities.literal(1))
        if name in self.scope.refused:
            raise self.wrong(self.scope.refused[name])
        if name in FUNCTIONS or name in self.scope.tables or name in self.scope.functions or name == "diff":
            raise self.wrong(f"{shown(name)} is a function: write {name}(...)")
        known = [n for n in (*self.scope.values, "t", "pi") if n not in self.scope.refused]
        raise self.wrong(f"unknown symbol {shown(name)}{closest(name, known)}")

    def _signed(self, node: ast.UnaryOp, depth: int) -> Value:
        inner = self.value(node.operand, depth + 1)
        if isinstance(node.op, ast.UAdd):
            return inner
        return replace(inner, expression=-inner.expression, size=inner.size + 1)

    def _chain(self, node: ast.BinOp, depth: int) -> Value:
        """Evaluate a chain of operators from left to right, without recursion, so that sums can be long."""
        spine: list[ast.BinOp] = [node]
        while isinstance(spine[-1].left, ast.BinOp):
            spine.append(spine[-1].left)
        value = self.value(spine[-1].left, depth + 1)
        for rank, parts in itertools.groupby(reversed(spine), lambda part: RANKS.get(type(part.op))):
            run = list(parts)
            if rank is None:
                raise self.wrong(f"{self.source(run[0])}: the operator is not allowed: use + - * / **")
            rights = [self.value(part.right, depth + 1) for part in run]
            if rank is not ast.Pow:
                value = self._run(rank, run, [value, *rights])
                continue
            for part, exponent in zip(run, rights, strict=True):
                value = self._power(part, value, exponent)
        return value

    def _run(self, rank: type[ast.operator], run: list[ast.BinOp], values: list[Value]) -> Value:
        for i, part in enumerate(run, start=1):
            if isinstance(part.op, ast.Div) and values[i].expression == 0:
                raise self.wrong(f"{self.source(part)}: division by zero")
            if isinstance(part.op, ast.Div):
                inverse = quantities.raised(values[i].quantity, Fraction(-1))
                values[i] = Value(1 / values[i].expression, inverse, values[i].size + 1)
            elif isinstance(part.op, ast.Sub):
                values[i] = replace(values[i], expression=-values[i].expression, size=values[i].size + 1)
        return self._apply(OPERATORS[rank], run[-1], [run[0].left, *(part.right for part in run)], values)

    def _power(self, node: ast.BinOp, base: Value, exponent: Value) -> Value:
        if exponent.quantity.settled not in (None, ONE):
            raise self.wrong(
                f"{self.source(node)}: an exponent must be without unit: divide it by a constant of its unit"
            )
        try:
            expression = numbers.power(base.expression, exponent.expression)
        except (NoValue, ArithmeticError, ValueError, TypeError):
            problem = f"no finite real value, or a power above {numbers.HIGHEST_POWER}"
            raise self.wrong(f"{self.source(node)}: {problem}") from None
        by = exponent.expression
        number = numbers.fraction(by) if numbers.is_number(by) else None
        return self._sized(node, expression, quantities.raised(base.quantity, number), [base, exponent])

    def _call(self, node: ast.Call, depth: int) -> Value:
        if not isinstance(node.func, ast.Name):
            raise self.wrong(f"{self.source(node.func)} is not a function")
        name = node.func.id
        for argument in node.args:
            if isinstance(argument, ast.Starred):
                raise self.wrong(f"{self.source(argument)} is not allowed")
        if node.keywords:
            raise self.wrong(f"{self.source(node)}: arguments have no names here: write them in order")
        if name == "diff":
            return self._diff(node, depth)
        if name in self.scope.tables:
            return self._lookup(name, node, depth)
        if name in self.scope.functions:
            return self._motion(self.scope.functions[name], node, depth)
        if name not in FUNCTIONS:
            if name in self.scope.values:
                raise self.wrong(f"{shown(name)} is not a function; a product is written with *")
            known = (*FUNCTIONS, "diff", *self.scope.tables, *self.scope.functions)
            raise self.wrong(f"unknown function {shown(name)}{closest(name, known)}")
        operation = FUNCTIONS[name]
        if not operation.least <= len(node.args) <= operation.most:
            count = f"{operation.least}" + (" or more" if operation.most > operation.least else "")
            raise self.wrong(f"{shown(name)} takes {count} argument(s), got {len(node.args)}")
        return self._apply(operation, node, node.args, self._values(node.args, depth))

    def _lookup(self, name: str, node: ast.Call, depth: int) -> Value:
        if len(node.args) != 1:
            raise self.wrong(f"{shown(name)} takes 1 argument, got {len(node.args)}")
        argument = self.value(node.args[0], depth + 1)
        expression = lookup(sp.Integer(self.scope.tables[name]), argument.expression, 0)
        return self._sized(node, expression, UNKNOWN, [argument])

    def _motion(self, function: MotionFunction, node: ast.Call, depth: int) -> Value:
        wanted = [str(x).removeprefix("robot.") for x in function.arguments]
        if len(node.args) != len(wanted):
            takes = f"takes {len(wanted)} arguments ({', '.join(wanted)})"
            raise self.wrong(f"{shown(function.name)} {takes}, got {len(node.args)}")
        parts = self._values(node.args, depth)
        for part, unit, argument in zip(parts, function.arguments.values(), node.args, strict=True):
            if part.quantity.settled not in (None, unit):
                got = units.describe(part.quantity.settled)
                raise self.wrong(f"{self.source(argument)}: unit must be {units.describe(unit)}, got {got}")
        result = Quantity(function.unit, constant=True)
        return self._sized(node, function([part.expression for part in parts]), result, parts)

    def _diff(self, node: ast.Call, depth: int) -> Value:
        if len(node.args) != 2:
            raise self.wrong(f"diff takes 2 arguments, an expression and a state, got {len(node.args)}")
        by = node.args[1]
        if not isinstance(by, ast.Name) or by.id not in self.scope.states:
            raise self.wrong(f"diff: the second argument must be a state, got {self.source(by)}")
        inner, state = self.value(node.args[0], depth + 1), self.value(by)
        if has_large_derivative(inner.expression):
            raise self.wrong(f"{self.source(node)}: the derivative is too large: write it out in signals")
        expression = sanitised(sp.diff(inner.expression, symbol(by.id)))
        unit = replace(quantities.quotient(inner.quantity, state.quantity), number=False)
        return self._sized(node, expression, unit, [Value(expression, UNKNOWN, *tree_size(expression))])

    def _apply(
        self, operation: Operation, node: ast.expr, nodes: Sequence[ast.expr], parts: list[Value]
    ) -> Value:
        try:
            unit = operation.unit([part.quantity for part in parts])
        except UnitsDiffer as differ:
            one, two = self.source(nodes[differ.first]), self.source(nodes[differ.second])
            problem = f"units differ: {one} is in {differ.units[0]}, {two} in {differ.units[1]}"
            raise self.wrong(problem) from None
        except NotDimensionless as error:
            problem = f"{self.source(node)}: the argument must be without unit, got {error.unit}: divide it"
            raise self.wrong(problem) from None
        try:
            expression = _result(operation, [part.expression for part in parts])
        except (NoValue, ArithmeticError, ValueError, TypeError):
            raise self.wrong(f"{self.source(node)} has no finite real value: check its numbers") from None
        return self._sized(node, expression, unit, parts)

    def _sized(self, node: ast.expr, expression: sp.Expr, unit: Quantity, parts: Sequence[Value]) -> Value:
        size = 1 + sum(part.size for part in parts)
        depth = 1 + max((part.depth for part in parts), default=0)
        if size > LARGEST or depth > DEEPEST_TREE:
            raise self.wrong(f"{self.source(node)} is too large once its signals are inserted: simplify it")
        return Value(expression, unit, size, depth)


def _result(operation: Operation, parts: list[sp.Expr]) -> sp.Expr:
    if not all(numbers.is_number(part) for part in parts):
        return operation.symbolic(*parts)
    exact = operation in OPERATORS.values() and all(isinstance(part, sp.Rational) for part in parts)
    if exact:
        return numbers.shortened(operation.symbolic(*parts))
    return numbers.folded(operation.numeric, *parts)
