"""Expressions of system files as presentation MathML, in the order in which they are written."""

from __future__ import annotations

import ast
import re
import unicodedata
from collections.abc import Iterator
from html import escape

from unmodelled.systems import syntax

COMPARISONS = {ast.Gt: ">", ast.GtE: "≥", ast.Lt: "<", ast.LtE: "≤", ast.Eq: "=", ast.NotEq: "≠"}
_SUM, _PRODUCT, _POWER, _ATOM = range(4)
Printed = tuple[str, int]  # and how strongly it binds

#: A derivative by time in a law, and the function that stands for it in the syntax tree.
_RATE, _DERIVATIVE = re.compile(r"(?<![\w.])d\((\w+)\)/dt\b", re.ASCII), "d_by_dt"
#: A sign of equality, no comparison.
_EQUALS = re.compile(r"(?<![<>=!])=(?!=)")


def formula(law: str, left: str = "") -> str:
    """Return the equations of a law, each displayed on a line of its own."""
    sides = (_EQUALS.split(part) for part in _parts(law))
    rows = ["<mo>=</mo>".join(_printed(_tree(side))[0] for side in each) for each in sides]
    if left:
        shown = name(left) if left.isidentifier() else f"<mtext>{escape(left)}</mtext>"
        rows[0] = f"{shown}<mo>=</mo>{rows[0]}"
    return "".join(f'<math display="block"><mrow>{row}</mrow></math>' for row in rows)


def _tree(text: str) -> ast.expr:
    return syntax.tree(_RATE.sub(rf"{_DERIVATIVE}(\1)", text), "law")[1]


def _parts(law: str) -> Iterator[str]:
    """Yield the parts of a law between commas outside parentheses."""
    depth, start = 0, 0
    for place, letter in enumerate(law):
        depth += (letter == "(") - (letter == ")")
        if letter == "," and depth == 0:
            yield law[start:place].strip()
            start = place + 1
    yield law[start:].strip()


def name(text: str) -> str:
    """Print a name with Greek letters, and the part after its first underscore as an index."""
    base, _, index = text.partition("_")
    if not (base and index):
        return f"<mi>{escape(_letter(text))}</mi>"
    return f"<msub><mi>{escape(_letter(base))}</mi><mi>{escape(_letter(index.replace('_', ' ')))}</mi></msub>"


def _letter(word: str) -> str:
    """The Greek letter that `word` names, or else the word."""
    size = "CAPITAL" if word[:1].isupper() else "SMALL"
    try:
        return unicodedata.lookup(f"GREEK {size} LETTER {word.upper()}")
    except KeyError:
        return word


def _printed(node: ast.expr) -> Printed:
    match node:
        case ast.Constant(value=int() | float() as value):
            return f"<mn>{value:g}</mn>", _ATOM
        case ast.Name(id=text):
            return name(text), _ATOM
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return f"<mo>−</mo>{_inside(operand, _POWER)}", _PRODUCT
        case ast.UnaryOp(operand=operand):
            return _printed(operand)
        case ast.BinOp():
            return _operation(node)
        case ast.Compare(left=first, ops=[op], comparators=[second]):
            sign = COMPARISONS[type(op)]
            return f"{_inside(first, _SUM)}<mo>{escape(sign)}</mo>{_inside(second, _SUM)}", -1
        case ast.Call(func=ast.Name(id=function), args=arguments):
            return _call(function, arguments)
    return f"<mtext>{escape(ast.unparse(node))}</mtext>", _ATOM


def _operation(node: ast.BinOp) -> Printed:
    match node.op:
        case ast.Add():
            return f"{_inside(node.left, _SUM)}<mo>+</mo>{_inside(node.right, _SUM)}", _SUM
        case ast.Sub():
            return f"{_inside(node.left, _SUM)}<mo>−</mo>{_inside(node.right, _PRODUCT)}", _SUM
        case ast.Mult():
            return f"{_inside(node.left, _PRODUCT)}<mo>·</mo>{_inside(node.right, _POWER)}", _PRODUCT
        case ast.Div():
            return f"<mfrac>{_row(node.left)}{_row(node.right)}</mfrac>", _POWER
    return f"<msup><mrow>{_inside(node.left, _ATOM)}</mrow>{_row(node.right)}</msup>", _POWER


def _call(function: str, arguments: list[ast.expr]) -> Printed:
    match function, arguments:
        case _ if function == _DERIVATIVE:
            above = f"<mrow><mi>d</mi>{_printed(arguments[0])[0]}</mrow>"
            return f"<mfrac>{above}<mrow><mi>d</mi><mi>t</mi></mrow></mfrac>", _POWER
        case "abs", [x]:
            return f"<mrow><mo>|</mo>{_printed(x)[0]}<mo>|</mo></mrow>", _ATOM
        case "sqrt", [x]:
            return f"<msqrt>{_row(x)}</msqrt>", _ATOM
        case "exp", [x]:
            return f"<msup><mi>e</mi>{_row(x)}</msup>", _POWER
        case "where", [condition, then, otherwise]:
            first = f"<mtr><mtd>{_row(then)}</mtd><mtd><mtext>if </mtext>{_row(condition)}</mtd></mtr>"
            last = f"<mtr><mtd>{_row(otherwise)}</mtd><mtd><mtext>else</mtext></mtd></mtr>"
            return f"<mrow><mo>{{</mo><mtable>{first}{last}</mtable></mrow>", _ATOM
    inner = "<mo>,</mo>".join(_printed(x)[0] for x in arguments)
    return f"<mrow><mi>{escape(function)}</mi><mo>(</mo>{inner}<mo>)</mo></mrow>", _ATOM


def _inside(node: ast.expr, least: int) -> str:
    """Print an operand, in parentheses if it binds less strongly than `least`."""
    text, binds = _printed(node)
    return text if binds >= least else f"<mrow><mo>(</mo>{text}<mo>)</mo></mrow>"


def _row(node: ast.expr) -> str:
    return f"<mrow>{_printed(node)[0]}</mrow>"
