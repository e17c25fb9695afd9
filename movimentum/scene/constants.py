"""Constant expressions: exact ones for times and sizes, floats for coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import repeat

from movimentum.diagnostics import replacement
from movimentum.expressions import Expr, StatedNumber, rational_value
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.lower import Context, lower
from movimentum.scene.resolve import Meanings
from movimentum.scene.values import number
from movimentum.source import Span
from movimentum.syntax.expression_tree import (
    Blank,
    Call,
    Clock,
    Constant,
    Expression,
    Member,
    Name,
    Negate,
    Number,
    Operator,
    Product,
    Rotate,
    Sum,
    Vector,
    postorder,
)
from movimentum.syntax.tree import Text

MAX_BITS = 1000
"""How many binary digits numerator and denominator of an exact number may have; a float then holds it."""


def exact(root: Expression | Text, what: str, findings: Findings) -> Fraction | None:
    """The exact value of numbers joined by ``+ - * /``, or that of the float of any other constant expression; None
    after an error, whose message calls it ``what``.
    """
    if isinstance(root, Text):
        findings.error("kind/mismatch", f"{what} must be a number, not a text", root.span)
        return None
    value = _exact(root)
    if isinstance(value, Fraction):
        return value
    if isinstance(value, Span):
        findings.error("kind/not-finite", "division by zero", value)
        return None
    nodes = list(postorder(root))
    if not all(_is_exact(node) for node in nodes):
        strange = next((node for node in nodes if isinstance(node, Vector) or _first_variable_part(node)), None)
        if strange is not None:
            findings.error(
                "kind/not-constant", f"{what} must be a number (or numbers joined by `+ - * /`)", strange.span
            )
            return None
        computed = constant(root, what, findings)
        return None if computed is None else Fraction(computed)
    findings.error("kind/not-finite", f"{what} is out of range", root.span)
    return None


def _is_exact(node: Expression) -> bool:
    return isinstance(node, Number | Negate | Sum | Product) or (
        isinstance(node, Constant) and isinstance(node.value, Fraction)
    )


def exact_value(root: Expression) -> Fraction | None:
    """The exact value of numbers joined by ``+ - * /``; None of everything else, and where there is none."""
    value = _exact(root)
    return value if isinstance(value, Fraction) else None


def _exact(root: Expression) -> Fraction | Span | None:
    """The exact value, or the place of a division by zero; None if there is none or it has too many digits."""
    values: dict[int, Fraction] = {}
    for node in postorder(root):
        match node:
            case Number():
                value = Fraction(node.value)
            case Constant(value=Fraction()):
                value = Fraction(node.value)
            case Negate():
                value = -values[id(node.operand)]
            case Sum() | Product():
                first = values[id(node.operands[0])]
                joined = _joined(first, node.operators, [values[id(item)] for item in node.operands[1:]])
                if joined is None:
                    return node.span
                value = joined
            case _:
                return None
        if value.numerator.bit_length() > MAX_BITS or value.denominator.bit_length() > MAX_BITS:
            return None
        values[id(node)] = value
    return values[id(root)]


def _joined(first: Fraction, operators: Sequence[Operator], rest: Sequence[Fraction]) -> Fraction | None:
    for operator, value in zip(operators, rest, strict=True):
        match operator:
            case Operator.PLUS:
                first += value
            case Operator.MINUS:
                first -= value
            case Operator.TIMES:
                first *= value
            case Operator.OVER:
                if not value:
                    return None
                first /= value
        if first.numerator.bit_length() > 8 * MAX_BITS or first.denominator.bit_length() > 8 * MAX_BITS:
            return first  # far out of range already: the caller says so
    return first


def constant(root: Expression | Text, what: str, findings: Findings) -> float | None:
    """The value of a scalar expression without names, clocks and ``_``; None after an error."""
    value = constant_expression(root, what, findings)
    if value is None or value.value is None:
        return None
    rounded = value.origin is not None and rational_value(value) != Fraction(repr(value.value))
    return StatedNumber(value.value, value) if rounded else value.value


def constant_expression(root: Expression | Text, what: str, findings: Findings) -> Expr | None:
    """The same, as a constant that knows how it was computed."""
    if isinstance(root, Text):
        findings.error("kind/mismatch", f"{what} must be a number, not a text", root.span)
        return None
    errors = findings.errors
    if isinstance(root, Number | Constant):  # nearly all are
        plain = number(root, findings)
        return plain if findings.errors == errors else None
    nodes = list(postorder(root))
    for node in nodes:
        place = _first_variable_part(node)
        if place is not None:
            name = node.name if isinstance(node, Name) else ""
            guess = findings.nearest(name, findings.constants) if name else None
            findings.error(
                "kind/not-constant",
                f"{what} must be a constant",
                place,
                helps=(
                    replacement(f"did you mean `{guess}`?", place, guess)
                    if guess
                    else f"`.let {name} = …;` makes a constant"
                    if name and name not in findings.things
                    else "a thing is drawn only once; steps state what changes",
                ),
            )
            return None
    inference = Inference(findings)
    meanings: Meanings = {}
    inference.expression(nodes, meanings)
    inference.require(root, Kind.SCALAR, f"{what} must be a scalar")
    inference.finish()
    if findings.errors != errors:
        return None
    value = lower(nodes, meanings, Context(inference, findings, repeat(0)))
    return None if value is None or value[0].value is None else value[0]


def _first_variable_part(node: Expression) -> Span | None:
    match node:
        case Name() | Blank() | Member() | Rotate():
            return node.span
        case Clock() if node.name != "pi":
            return node.span
        case Call() if node.function in ("i", "d", "a"):
            return node.span
        case _:
            return None
