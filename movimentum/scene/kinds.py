"""Scalar or vector: the kind of every expression, by unification over the whole script."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum

from movimentum.diagnostics import Label, insertion
from movimentum.scene.cords import CORD
from movimentum.scene.findings import Findings
from movimentum.scene.leaves import Wheel
from movimentum.scene.model import AnchorRef
from movimentum.scene.pairs import PAIRED
from movimentum.scene.resolve import (
    CONTACT,
    CURVE_VALUES,
    ComponentUse,
    KnownPlace,
    Meanings,
    PassedOn,
    Swallowed,
    VariableUse,
)
from movimentum.source import Span
from movimentum.syntax.expression_tree import (
    Call,
    Clock,
    Constant,
    Expression,
    Member,
    Name,
    Negate,
    Number,
    Operator,
    Piecewise,
    Power,
    Product,
    Range,
    Rotate,
    Sum,
    Transition,
    Vector,
)


class Kind(StrEnum):
    """The kind of an expression's value."""

    SCALAR = "scalar"
    VECTOR = "vector"


class Cell:
    """The kind of one expression, possibly shared with others, and the place that determined it."""

    __slots__ = ("evidence", "kind", "parent")

    def __init__(self, kind: Kind | None = None, evidence: Span | None = None) -> None:
        self.parent: Cell | None = None
        self.kind = kind
        self.evidence = evidence

    def root(self) -> Cell:
        """The cell that represents all cells known to have the same kind as this one."""
        cell = self
        while cell.parent is not None:
            if cell.parent.parent is not None:
                cell.parent = cell.parent.parent
            cell = cell.parent
        return cell


Multiplication = tuple[Cell, Cell, Cell, Product, int]
"""Kinds of left, right and result of one ``*``, and which of a product's it is."""


_OF_VECTORS = {
    "a": "`.a` is the angle from one vector to another",
    "across": "`.across` measures from a point to the line through two others",
    "along": "`.along` measures along the line through two points",
}
"""Functions of vectors, and what is said where something else is given to them."""


class Inference:
    """Kinds of all expressions of a script; variables are shared by name.

    Call `expression` for every tree, `equate` or `require` for what relates them, then `finish`, then ask `kind`.
    """

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self._cells: dict[int, Cell] = {}
        self._variables: dict[str, Cell] = {}
        self._products: list[Multiplication] = []

    def kind(self, node: Expression) -> Kind:
        """The kind of a node; a scalar if nothing decides it."""
        return self._cells[id(node)].root().kind or Kind.SCALAR

    def variable_kind(self, name: str) -> Kind:
        """The kind of a variable."""
        return self._variables[name].root().kind or Kind.SCALAR

    def expression(self, nodes: Sequence[Expression], meanings: Meanings) -> None:
        """Take in an expression: its ``nodes``, children before parents."""
        for node in nodes:
            if not isinstance(meanings.get(id(node)), Swallowed | Wheel):
                self._cells[id(node)] = self._cell(node, meanings)

    def require(self, node: Expression, kind: Kind, because: str) -> None:
        """``node`` must be of ``kind``; ``because`` says why, as a whole sentence."""
        cell = self._cells[id(node)].root()
        if cell.kind is None:
            cell.kind, cell.evidence = kind, node.span
        elif cell.kind is not kind:
            self._findings.error("kind/mismatch", because, node.span, _is(cell.kind), labels=self._reasons(node, cell))

    def equate(self, first: Expression, second: Expression, because: str) -> None:
        """Both must be of the same kind; ``because`` says why, as a whole sentence."""
        a, b = self._cells[id(first)].root(), self._cells[id(second)].root()
        if a is b:
            return
        if a.kind is not None and b.kind is not None and a.kind is not b.kind:
            self._findings.error(
                "kind/mismatch",
                because,
                second.span,
                _is(b.kind),
                labels=[Label(first.span, _is(a.kind)), *self._reasons(first, a), *self._reasons(second, b)],
            )
            return
        _join(a, b)

    def finish(self) -> None:
        """Decide what had to wait: which factor of a product is its vector."""
        self._propagate()
        # What is left waits for a choice. A product that nothing asks to be a vector is a product of scalars.
        for item in self._products:
            if not self._multiply(item) and item[2].root().kind is None:
                for cell in item[:3]:
                    cell.root().kind = cell.root().kind or Kind.SCALAR
        self._propagate()
        for *_, product, index in self._products:
            self._findings.error(
                "kind/mismatch",
                "one of these factors must be a vector, but nothing says which",
                product.operands[index + 1].span,
                labels=(Label(product.operands[index].span, "this one?"),),
                helps=[
                    insertion("state the vector's components: `v = [_, _];`", *self._as_vector(operand))
                    for operand in product.operands[index : index + 2]
                    if isinstance(operand, Name)
                ],
            )

    def _as_vector(self, name: Name) -> tuple[int, str]:
        """A statement that makes a variable a vector, and the place for it: behind the statement that uses it."""
        end = re.compile(r"(?:[^;/]|//[^\r\n]*|/\*.*?\*/|/)*;", re.DOTALL).match(
            self._findings.source.text, name.span.end
        )
        return (name.span.end if end is None else end.end()), f" {name.name} = [_, _];"

    def _propagate(self) -> None:
        """Draw conclusions from products until there are no more, forwards and backwards in turn."""
        before = -1
        while self._products and len(self._products) != before:
            before = len(self._products)
            self._products = [item for item in self._products if not self._multiply(item)]
            self._products = [item for item in reversed(self._products) if not self._multiply(item)]
            self._products.reverse()

    # --- one node ---

    def _cell(self, node: Expression, meanings: Meanings) -> Cell:
        if isinstance(meanings.get(id(node)), KnownPlace):
            return Cell(Kind.VECTOR, node.span)
        match node:
            case Number() | Clock() | Constant():
                return Cell(Kind.SCALAR, node.span)
            case Name():
                meaning = meanings[id(node)]
                assert isinstance(meaning, VariableUse)
                return self._variables.setdefault(meaning.name, Cell())
            case Vector():
                for component in node.components:
                    self.require(component, Kind.SCALAR, "the components of a vector must be scalars")
                return Cell(Kind.VECTOR, node.span)
            case Member():
                meaning = meanings[id(node)]
                if isinstance(meaning, PassedOn):
                    return self._cells[id(node.operand)]
                if isinstance(meaning, ComponentUse):
                    self.require(node.operand, Kind.VECTOR, f"only a vector has `.{node.name}`")
                return Cell(Kind.VECTOR if isinstance(meaning, AnchorRef) else Kind.SCALAR, node.span)
            case Rotate():
                self.require(node.operand, Kind.VECTOR, "only a vector can be rotated")
                self.require(node.angle, Kind.SCALAR, "the angle of a rotation must be a scalar")
                return Cell(Kind.VECTOR, node.span)
            case Negate():
                return self._cells[id(node.operand)]
            case Power():
                self.require(node.base, Kind.SCALAR, "only a scalar can be raised to a power")
                self.require(node.exponent, Kind.SCALAR, "an exponent must be a scalar")
                return Cell(Kind.SCALAR, node.span)
            case Sum():
                first, *rest = node.operands
                for operator, operand in zip(node.operators, rest, strict=True):
                    self.equate(first, operand, f"a scalar and a vector cannot be joined by `{operator}`")
                return self._cells[id(first)]
            case Product():
                return self._product(node)
            case Call():
                return self._call(node, meanings)
            case Range():
                for part in (node.subject, *node.values, *node.bounds):
                    self.require(part, Kind.SCALAR, "a range must consist of scalars")
                return Cell(Kind.SCALAR, node.span)
            case Piecewise():
                for part in (*node.lefts, *node.rights):
                    self.require(part, Kind.SCALAR, "only scalars can be compared")
                for value in node.values[1:]:
                    self.equate(node.values[0], value, "the values of a piecewise expression must be of one kind")
                return self._cells[id(node.values[0])]
            case Transition():
                self.equate(node.start, node.end, "`->` leads from a scalar to a scalar or from a vector to a vector")
                return self._cells[id(node.start)]
            case _:
                return Cell()

    def _call(self, node: Call, meanings: Meanings) -> Cell:
        if node.function in ("i", "d"):
            return self._cells[id(node.arguments[0])]
        if node.function in PAIRED:
            return Cell(Kind.SCALAR, node.span)
        if node.function == CORD:
            for argument in node.arguments:
                if id(argument) in self._cells:  # and no wheel
                    self.require(argument, Kind.VECTOR, "a cord runs from anchors and places to others, about wheels")
            return Cell(Kind.SCALAR, node.span)
        if node.function in CURVE_VALUES:
            for place in node.arguments[1:]:
                self.require(place, Kind.SCALAR, "a place on a curve is a number from 0 to 1")
            return Cell(Kind.VECTOR if node.function in ("point", "tangent") else Kind.SCALAR, node.span)
        if node.function in CONTACT:
            for argument in node.arguments:
                if not isinstance(meanings.get(id(argument)), Swallowed):
                    self.require(argument, Kind.VECTOR, f"`.{node.function}` takes a point, such as `Rod.P`")
            return Cell(Kind.SCALAR, node.span)
        if node.function in ("at", "first", "last", "mean"):
            for time in node.arguments[1:]:
                self.require(time, Kind.SCALAR, "a time is a scalar")
            return self._cells[id(node.arguments[0])]
        vectors = _OF_VECTORS.get(node.function)
        for argument in node.arguments:
            if vectors:
                self.require(argument, Kind.VECTOR, vectors)
            else:
                self.require(argument, Kind.SCALAR, f"`.{node.function}` takes scalars")
        return Cell(Kind.SCALAR, node.span)

    def _product(self, node: Product) -> Cell:
        result = self._cells[id(node.operands[0])]
        for index, operator in enumerate(node.operators):
            factor = node.operands[index + 1]
            if operator is Operator.OVER:
                self.require(factor, Kind.SCALAR, "a divisor must be a scalar")
                continue
            left, result = result, Cell()
            item = (left, self._cells[id(factor)], result, node, index)
            if not self._multiply(item):
                self._products.append(item)
        return result

    def _multiply(self, item: Multiplication) -> bool:
        """Draw the conclusions from one ``*``; whether there are no more to come."""
        left, right, result = (cell.root() for cell in item[:3])
        node, index = item[3], item[4]
        if left.kind is Kind.SCALAR:
            self._unify_product(right, result, node, index)
            return True
        if right.kind is Kind.SCALAR:
            self._unify_product(left, result, node, index)
            return True
        vector = left if left.kind is Kind.VECTOR else right if right.kind is Kind.VECTOR else None
        if vector is not None:
            other = right if vector is left else left
            if other.kind is Kind.VECTOR or other is vector:
                self._findings.error(
                    "kind/mismatch",
                    "two vectors cannot be multiplied",
                    node.operands[index + 1].span,
                    _is(Kind.VECTOR),
                    labels=(Label(Span(node.operands[0].span.start, node.operands[index].span.end), "a vector"),),
                )
                result.kind = result.kind or Kind.VECTOR
                return True
            other.kind, other.evidence = Kind.SCALAR, node.span
            self._unify_product(vector, result, node, index)
            return True
        if result.kind is Kind.SCALAR or left is right:
            for cell in (left, right):
                cell.kind, cell.evidence = Kind.SCALAR, cell.evidence or node.span
            self._unify_product(left, result, node, index)
            return True
        return False

    def _unify_product(self, factor: Cell, result: Cell, node: Product, index: int) -> None:
        if factor is result:
            return
        if factor.kind is not None and result.kind is not None and factor.kind is not result.kind:
            labels = [Label(result.evidence, f"used as a {result.kind} here")] if result.evidence else []
            self._findings.error(
                "kind/mismatch",
                f"this product is a {factor.kind}, but it is used as a {result.kind}",
                Span(node.operands[0].span.start, node.operands[index + 1].span.end),
                _is(factor.kind),
                labels=labels,
            )
            return
        _join(factor, result)

    def _reasons(self, node: Expression, cell: Cell) -> list[Label]:
        """The other place that determined the kind of ``node``, unless the node itself shows it."""
        evidence = cell.evidence
        if evidence is None or (node.span.start <= evidence.start and evidence.end <= node.span.end):
            return []
        return [Label(evidence, f"because this is a {cell.kind}")]


def _join(a: Cell, b: Cell) -> None:
    if a.kind is None:
        a, b = b, a
    b.parent = a


def _is(kind: Kind) -> str:
    return f"a {kind}"
