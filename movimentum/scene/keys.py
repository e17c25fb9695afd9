"""Constraint keys: a left-hand side in canonical form, however it was written."""

from __future__ import annotations

from movimentum.scene.cords import CORD, reversed_text
from movimentum.scene.leaves import Wheel
from movimentum.scene.resolve import AngleUse, ComponentUse, Meanings, PassedOn, ThingTable
from movimentum.syntax.expression_tree import (
    Call,
    Expression,
    Member,
    Name,
    Operator,
    Product,
    Sum,
    children,
    postorder,
    rebuilt,
)
from movimentum.syntax.printer import expression_text

_OPPOSITE = {Operator.PLUS: Operator.MINUS, Operator.MINUS: Operator.PLUS}


def key_text(root: Expression, meanings: Meanings, table: ThingTable) -> str:
    """The canonical text of a left-hand side.

    White space, comments, redundant parentheses (also those of ``a + (b - c)``), the spelling of numbers, and the
    choice among ``.length`` and ``.l``, ``.angle`` and ``.a`` and so on make no difference. The order of terms does.
    """
    new: dict[int, Expression] = {}

    def of(node: Expression) -> Expression:
        return new[id(node)]

    for node in postorder(root):
        match node:
            case Member() if isinstance(meanings.get(id(node)), PassedOn):
                made: Expression = of(node.operand)  # a belt has one key, however it runs
            case Member():
                made = Member(of(node.operand), _member_name(node, meanings, table))
            case Sum():
                operands, operators = _flat_sum([of(item) for item in node.operands], node.operators)
                made = Sum(tuple(operands), tuple(operators))
            case Product():
                operands, operators = _flat_product([of(item) for item in node.operands], node.operators)
                made = Product(tuple(operands), tuple(operators))
            case Call(function=word) if word == CORD:
                wheels = [isinstance(meanings.get(id(item)), Wheel) for item in node.arguments]
                there = [of(item) for item in node.arguments]
                ways = (there, reversed_text(there, wheels))
                made = min((rebuilt(node, way, node.span) for way in ways), key=expression_text)
            case _:
                made = rebuilt(node, [of(item) for item in children(node)], node.span)
        new[id(node)] = made
    return expression_text(new[id(root)])


def _member_name(node: Member, meanings: Meanings, table: ThingTable) -> str:
    meaning = meanings[id(node)]
    if isinstance(meaning, ComponentUse):
        return meaning.name
    if isinstance(meaning, AngleUse):
        assert isinstance(node.operand, Name)
        return "a" if table.anchor(meaning.thing, "angle") else "angle"
    return node.name


def _flat_sum(items: list[Expression], signs: tuple[Operator, ...]) -> tuple[list[Expression], list[Operator]]:
    operands: list[Expression] = []
    operators: list[Operator] = []
    for sign, item in zip((Operator.PLUS, *signs), items, strict=True):
        if isinstance(item, Sum):
            operators.extend(
                inner if sign is Operator.PLUS else _OPPOSITE[inner] for inner in (Operator.PLUS, *item.operators)
            )
            operands.extend(item.operands)
        else:
            operators.append(sign)
            operands.append(item)
    return operands, operators[1:]


def _flat_product(items: list[Expression], signs: tuple[Operator, ...]) -> tuple[list[Expression], list[Operator]]:
    operands: list[Expression] = []
    operators: list[Operator] = []
    for sign, item in zip((Operator.TIMES, *signs), items, strict=True):
        if isinstance(item, Product) and sign is Operator.TIMES:
            operators.extend((sign, *item.operators))
            operands.extend(item.operands)
        else:
            operators.append(sign)
            operands.append(item)
    return operands, operators[1:]
