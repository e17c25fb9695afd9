"""Prints expressions and literals as scripts spell them: the text parses to an equal tree, equal trees print alike."""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction

from movimentum.syntax.expression_tree import (
    Blank,
    Call,
    Clock,
    Constant,
    Element,
    Expression,
    Index,
    Member,
    Name,
    Negate,
    Number,
    Piecewise,
    Power,
    Product,
    Range,
    Rotate,
    Several,
    Sum,
    TableUse,
    Transition,
    Vector,
    postorder,
)
from movimentum.syntax.tree import (
    Text,
)

# How tightly a node binds. A node gets parentheses where a tighter one is needed.
_SUM, _PRODUCT, _UNARY, _POWER, _POSTFIX, _ATOM = range(6)


def expression_text(root: Expression) -> str:
    """One expression, without parentheses around it and without unnecessary ones."""
    done: dict[int, tuple[str, int]] = {}

    def tight(node: Expression, least: int) -> str:
        text, level = done[id(node)]
        return text if level >= least else f"({text})"

    def unturned(node: Expression) -> str:
        """An operand whose own rotation must not be read as one of the product around it."""
        return f"({done[id(node)][0]})" if isinstance(node, Rotate) else tight(node, _UNARY)

    def listed(nodes: tuple[Expression, ...]) -> str:
        return ", ".join(done[id(node)][0] for node in nodes)

    for node in postorder(root):
        match node:
            case Number() | Name() | Several() | Blank() | Constant() | Element() | Clock():
                made = _leaf_text(node)
            case Index():
                last = "" if node.last is None else f"..{done[id(node.last)][0]}"
                made = f"{tight(node.operand, _POSTFIX)}[{done[id(node.index)][0]}{last}]", _POSTFIX
            case Transition():
                made = f"{done[id(node.start)][0]} -> {done[id(node.end)][0]}", _SUM
            case Vector():
                made = f"[{listed(node.components)}]", _ATOM
            case Member():
                made = f"{tight(node.operand, _POSTFIX)}.{node.name}", _POSTFIX
            case Rotate():
                made = f"{tight(node.operand, _POSTFIX)}.r({done[id(node.angle)][0]})", _POSTFIX
            case Call():
                made = f".{node.function}({listed(node.arguments)})", _ATOM
                if node.reads is not None:
                    made = _table_text(node.reads, listed(node.arguments)), _ATOM
            case Negate():
                made = f"-{unturned(node.operand)}", _UNARY
            case Power():
                base = done[id(node.base)][0] if isinstance(node.base, Number) else tight(node.base, _POSTFIX)
                made = f"{base}^{unturned(node.exponent)}", _POWER
            case Sum():
                first, *rest = node.operands
                pieces = [tight(first, _PRODUCT)]
                for operator, operand in zip(node.operators, rest, strict=True):
                    pieces.append(f" {operator} {tight(operand, _PRODUCT)}")
                made = "".join(pieces), _SUM
            case Product():
                first, *rest = node.operands
                pieces = [tight(first, _UNARY)]
                for operator, operand in zip(node.operators, rest, strict=True):
                    pieces.append(f" {operator} {unturned(operand)}")
                made = "".join(pieces), _PRODUCT
            case Range():
                made = _range_value_text(node, done), _ATOM
            case Piecewise():
                made = _piecewise_text(node, done), _ATOM
        done[id(node)] = made
    return done[id(root)][0]


def _table_text(reads: TableUse, argument: str) -> str:
    file, column, *over = (text_literal(each.text) if isinstance(each, Text) else each.name for each in reads.texts)
    return f".table({file}, {column}, {argument})" + table_options(over[0] if over else "", reads.smooth, reads.ends)


def table_options(over: str, smooth: bool, ends: str) -> str:
    """The suffixes of ``.table(…)``; ``over`` is the literal of a column's name."""
    return (f".over({over})" if over else "") + ".smooth" * smooth + (f".{ends}" if ends else "")


def _range_value_text(node: Range, done: Mapping[int, tuple[str, int]]) -> str:
    pieces = [f"{{ {done[id(node.subject)][0]} : {done[id(node.values[0])][0]}"]
    for bound, value in zip(node.bounds, node.values[1:], strict=True):
        pieces.append(f" > {done[id(bound)][0]} : {done[id(value)][0]}")
    return "".join(pieces) + " }"


def _piecewise_text(node: Piecewise, done: Mapping[int, tuple[str, int]]) -> str:
    cases = zip(node.lefts, node.comparisons, node.rights, node.values, strict=False)
    pieces = [
        f"{done[id(left)][0]} {sign} {done[id(right)][0]} : {done[id(value)][0]}; "
        for left, sign, right, value in cases
    ]
    return "{ " + "".join(pieces) + done[id(node.values[-1])][0] + " }"


def _leaf_text(node: Number | Name | Several | Blank | Constant | Element | Clock) -> tuple[str, int]:
    """A node with nothing below it, and how tightly it binds."""
    match node:
        case Number():
            return number_text(node.value), _UNARY  # not an atom: `2.x` could be misread
        case Name():
            return node.name, _ATOM
        case Several():
            return node.said, _ATOM
        case Blank():
            return "_", _ATOM
        case Constant():
            return _constant_text(node.value)
        case Element():
            return f"#{node.id}", _ATOM
        case Clock():
            return f".{node.name}", _ATOM


def _constant_text(value: Fraction | float) -> tuple[str, int]:
    """A constant's value and how tightly it binds; a fraction that no decimal number equals as a quotient."""
    if isinstance(value, Fraction):
        denominator, tens = value.denominator, 0
        while denominator % 10 == 0 or denominator % 5 == 0 or denominator % 2 == 0:
            denominator //= 10 if denominator % 10 == 0 else 5 if denominator % 5 == 0 else 2
            tens += 1
        if denominator != 1:
            return f"{value.numerator}/{value.denominator}", _SUM if value < 0 else _PRODUCT
        digits = abs(value.numerator) * (10**tens // value.denominator)
        text = number_text(Decimal((0, tuple(map(int, str(digits))), -tens)))
    elif not math.isfinite(value):  # an overflow, which the scene stage reports
        return "1/0", _PRODUCT
    else:
        text = number_text(Decimal(repr(abs(value))))
    return ("-" + text if value < 0 else text), _UNARY


def number_text(value: Decimal) -> str:
    """A number in its shortest spelling: ``12``, ``0.5``, ``1e-9``."""
    _, digit_tuple, exponent = value.as_tuple()
    assert isinstance(exponent, int)
    digits = "".join(map(str, digit_tuple)).lstrip("0")
    stripped = digits.rstrip("0")
    if not stripped:
        return "0"
    exponent += len(digits) - len(stripped)
    point = len(stripped) + exponent  # how many digits stand before the point
    if exponent >= 0 and point <= 16:
        return stripped + "0" * exponent
    if exponent < 0 and -4 < point <= 16:
        return f"{stripped[:point]}.{stripped[point:]}" if point > 0 else "0." + "0" * -point + stripped
    rest = f".{stripped[1:]}" if len(stripped) > 1 else ""
    return f"{stripped[0]}{rest}e{point - 1}"


def float_text(value: float) -> str:
    """A float in the shortest spelling that reads back exactly."""
    return ("-" if value < 0.0 else "") + number_text(Decimal(repr(abs(float(value)))))


def text_literal(text: str) -> str:
    """A text in quotes."""
    return "'" + text.replace("'", "''") + "'"
