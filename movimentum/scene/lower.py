"""Expressions of the language to scalar `Expr`s: one for a scalar, two (x and y) for a vector.

Degrees stay degrees. ``.t`` becomes a clock that starts with the step, ``.T`` one that starts at 0, ``.iv`` a
``lifetime`` leaf, ``.s`` a ``progress`` leaf; a vector's z is 0 until there are bodies in space.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction

from movimentum.diagnostics import replacement
from movimentum.expressions import (
    ONE,
    OPERATIONS,
    PI,
    ZERO,
    Expr,
    add,
    call,
    clock,
    derivative,
    div,
    integral,
    mul,
    neg,
    progress,
    sub,
    symbol,
)
from movimentum.records import dataclass, field
from movimentum.scene.cords import CORD, cord_of
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.leaves import ContactPair, Wheel
from movimentum.scene.model import (
    AnchorCoordinate,
    AnchorRef,
    Anonymous,
    GearPair,
    Thing,
    ThingAngle,
    ThingProperty,
    VariableComponent,
)
from movimentum.scene.reductions import earlier_value, is_reduction, reduced
from movimentum.scene.resolve import (
    CONTACT,
    AngleUse,
    ComponentUse,
    KnownPlace,
    Meaning,
    Meanings,
    PassedOn,
    PropertyUse,
    Swallowed,
    VariableUse,
)
from movimentum.scene.values import (
    Value,
    from_line,
    left_to_right,
    length_of,
    number,
    paired,
    piecewise,
    powered,
    ranged,
    times,
    transition,
    why_not_finite,
)
from movimentum.source import Span
from movimentum.syntax.expression_tree import (
    Blank,
    Call,
    Clock,
    Constant,
    Expression,
    Member,
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
    children,
)
from movimentum.syntax.printer import expression_text
from movimentum.syntax.vocabulary import SYNONYMS

MAX_DEPTH = 400
"""How deep an `Expr` may be, because later code that walks it may recurse."""

_LONG = 8
"""The members of a longer sum or product are paired like a tournament, so that its depth stays small."""

OPERATION_OF = {SYNONYMS.get(some.word, some.word): some.name for some in OPERATIONS if some.word is not None}
"""The language's functions (see `syntax.vocabulary`), and the operations that they are."""


@dataclass(frozen=True, slots=True)
class Context:
    """The context for lowering an expression: ``step_time``, ``step_end`` (None: the last step, which has no length)
    and the number of its ``constraint``; ``blanks`` counts the ``_`` of the whole script; ``things`` are the scene's;
    diagnostics go to ``findings``. ``reduces``: the words by which what is read may be reduced over the film.
    ``stored_from``: when the film begins, where ``.at`` keeps values from before the step.
    """

    inference: Inference
    findings: Findings
    blanks: Iterator[int]
    step_time: Fraction = field(default_factory=Fraction)
    constraint: int = -1
    step_end: Fraction | None = None
    things: Sequence[Thing] = ()
    reduces: frozenset[str] = frozenset()
    stored_from: Fraction | None = None


def lower(nodes: Sequence[Expression], meanings: Meanings, context: Context) -> Value | None:
    """The value of an expression given all its ``nodes``, children before parents; None after an error.

    Errors: ``kind/not-finite`` (a division by zero, the root of a negative number, an overflow, as far as constants
    show it), ``kind/not-constant`` (an exponent), ``kind/not-yet`` (a z), ``limit/nesting``.
    """
    errors = context.findings.errors
    values: dict[int, Value] = {}
    for node in nodes:
        meaning = meanings.get(id(node))
        if isinstance(meaning, Swallowed | Wheel):
            continue
        value = _leaf(node, meanings, context)
        if value is None:
            value = _operation(node, meanings, values, context)
            value = _checked(node, value, values, context)
        values[id(node)] = value
    value = values[id(nodes[-1])]
    if max(part.depth for part in value) > MAX_DEPTH:
        context.findings.error(
            "limit/nesting",
            f"this is nested deeper than the limit of {MAX_DEPTH} operations",
            nodes[-1].span,
            helps=("give a name to a part of it: `x = …;`",),
        )
    return value if context.findings.errors == errors else None


# --- leaves ---------------------------------------------------------------------------------------


def _leaf(node: Expression, meanings: Meanings, context: Context) -> Value | None:
    meaning = meanings.get(id(node))
    if meaning is not None:
        return _meant(node, meaning, context)
    match node:
        case Number() | Constant():
            return (number(node, context.findings),)
        case Blank():
            count = next(context.blanks)
            if context.inference.kind(node) is Kind.VECTOR:
                return symbol(Anonymous(count, 0, node.span)), symbol(Anonymous(count, 1, node.span))
            return (symbol(Anonymous(count, None, node.span)),)
        case Clock():
            return (_clock(node.name, context),)
        case _:
            return None


def _meant(node: Expression, meaning: Meaning, context: Context) -> Value | None:
    """The expression for a special node; None for an ordinary operation."""
    match meaning:
        case VariableUse(name):
            if context.inference.kind(node) is Kind.VECTOR:
                return symbol(VariableComponent(name, 0)), symbol(VariableComponent(name, 1))
            return (symbol(VariableComponent(name, None)),)
        case AnchorRef(thing, anchor):
            return symbol(AnchorCoordinate(thing, anchor, 0)), symbol(AnchorCoordinate(thing, anchor, 1))
        case AngleUse(thing):
            return (symbol(ThingAngle(thing)),)
        case GearPair():
            return (symbol(meaning),)
        case PropertyUse(thing, name):
            return (symbol(ThingProperty(thing, name)),)
        case KnownPlace():
            return meaning.value
        case _:
            return None


def _clock(name: str, context: Context) -> Expr:
    match name:
        case "t":
            return clock(context.step_time)
        case "T":
            return clock(Fraction(0))
        case "iv":
            return Expr("lifetime", (), context.constraint)
        case "s":
            return progress(context.step_time, context.step_end)
        case _:
            return PI


# --- operations -----------------------------------------------------------------------------------


def _operation(node: Expression, meanings: Meanings, values: dict[int, Value], context: Context) -> Value:
    def of(child: Expression) -> Value:
        return values[id(child)]

    match node:
        case Vector():
            if len(node.components) == 3 and of(node.components[2])[0] != ZERO:
                report_not_yet(node.components[2], context.findings)
            return of(node.components[0])[0], of(node.components[1])[0]
        case Member():
            meaning = meanings[id(node)]
            if isinstance(meaning, PassedOn):
                return of(node.operand)
            assert isinstance(meaning, ComponentUse)
            return (_component(of(node.operand), meaning.name),)
        case Rotate():
            x, y = of(node.operand)
            (angle,) = of(node.angle)
            c, s = call("cosd", angle), call("sind", angle)
            return sub(mul(x, c), mul(y, s)), add(mul(x, s), mul(y, c))
        case Negate():
            return tuple(neg(part) for part in of(node.operand))
        case Power():
            return _power(node, of(node.base)[0], of(node.exponent)[0], context)
        case Sum():
            signs = (Operator.PLUS, *node.operators)
            terms = [
                of(operand) if sign is Operator.PLUS else tuple(neg(part) for part in of(operand))
                for sign, operand in zip(signs, node.operands, strict=True)
            ]
            if len(terms) <= _LONG:
                return tuple(left_to_right(add, parts) for parts in zip(*terms, strict=True))
            return tuple(paired(add, parts) for parts in zip(*terms, strict=True))
        case Product():
            return _product(node, values, context)
        case Call():
            meaning = meanings.get(id(node))
            if isinstance(meaning, ContactPair):
                from movimentum.scene.contact import contact_value  # few scripts have any

                points = [values.get(id(argument)) for argument in node.arguments]
                return contact_value(node.function, meaning, points, context.things)
            if node.function in ("across", "along"):
                return _from_line(node, [of(argument) for argument in node.arguments], meanings, context)
            if node.function == CORD:
                return (cord_of(node, values, meanings, context.things, context.findings) or ONE,)
            return _call(node, [of(argument) for argument in node.arguments], context)
        case Range():
            return ranged(node, values)
        case Piecewise():
            return piecewise(node, values)
        case Transition():
            return transition(of(node.start), of(node.end), progress(context.step_time, context.step_end))
        case _:
            raise AssertionError(f"{type(node).__name__} is a leaf")


def _power(node: Power, base: Expr, exponent: Expr, context: Context) -> Value:
    if exponent.value is None:
        power_help = f".exp(({expression_text(node.exponent)}) * .ln({expression_text(node.base)}))"
        context.findings.error(
            "kind/not-constant",
            "an exponent must be a constant",
            node.exponent.span,
            helps=(replacement("write `.exp(n * .ln(s))` for a power that changes", node.span, power_help),),
        )
        return (ONE,)
    return (powered(base, exponent, exponent.value),)


def _from_line(node: Call, arguments: list[Value], meanings: Meanings, context: Context) -> Value:
    """``.across(P, A, B)``, ``.along(P, A, B)``; two anchors of one thing keep their distance."""
    first, second = (meanings.get(id(argument)) for argument in node.arguments[1:])
    drawn: tuple[Value, Value] | None = None
    if isinstance(first, AnchorRef) and isinstance(second, AnchorRef) and first.thing == second.thing:
        anchors = context.things[first.thing].anchors
        drawn = anchors[first.anchor].coordinates, anchors[second.anchor].coordinates
    found = from_line(arguments[0], arguments[1], arguments[2], drawn, across=node.function == "across")
    if found is None:
        span = Span(node.arguments[1].span.start, node.arguments[2].span.end)
        context.findings.error("kind/not-finite", "these two points are one: they give no line", span)
    return (ONE if found is None else found,)


def report_not_yet(node: Expression, findings: Findings) -> None:
    """A z that is not 0."""
    findings.error(
        "kind/not-yet",
        "a z other than 0 is not possible yet: things live in the plane",
        node.span,
        helps=(replacement("leave out the third component, or write 0", node.span, "0"),),
    )


def _component(vector: Value, name: str) -> Expr:
    match name:
        case "x":
            return vector[0]
        case "y":
            return vector[1]
        case "z":
            return ZERO
        case _:
            return length_of(vector)


def _call(node: Call, arguments: list[Value], context: Context) -> Value:
    match node.function:
        case "a":
            (ux, uy), (vx, vy) = arguments
            cross = sub(mul(ux, vy), mul(uy, vx))
            dot = add(mul(ux, vx), mul(uy, vy))
            return (call("atan2d", cross, dot),)
        case "table" if node.reads is not None:
            return (call("table", arguments[0][0], payload=node.reads.table),)
        case "i":
            return tuple(integral(part, context.step_time) for part in arguments[0])
        case "d":
            return tuple(derivative(part) for part in arguments[0])
        case "at" if context.stored_from is not None:
            return earlier_value(node, arguments, (context.stored_from, context.step_time), context.findings)
        case word if is_reduction(node) and (word in context.reduces or word not in ("min", "max")):
            return reduced(node, arguments, context.findings, allowed=word in context.reduces)
        case "min" | "max":
            return (paired(lambda a, b: call(node.function, a, b), [part for (part,) in arguments]),)
        case _:
            return (call(OPERATION_OF[node.function], *(part for (part,) in arguments)),)


def _product(node: Product, values: dict[int, Value], context: Context) -> Value:
    above: list[Value] = [values[id(node.operands[0])]]
    below: list[Value] = []
    for operator, operand in zip(node.operators, node.operands[1:], strict=True):
        value = values[id(operand)]
        if operator is Operator.TIMES:
            above.append(value)
            continue
        if value[0].value == 0.0:
            context.findings.error("kind/not-finite", "division by zero", operand.span, "this is 0")
            return (ONE,) * max(len(values[id(factor)]) for factor in node.operands)
        below.append(value)
    if len(node.operands) <= _LONG:
        result = above[0]
        for operator, operand in zip(node.operators, node.operands[1:], strict=True):
            value = values[id(operand)]
            if operator is Operator.TIMES:
                result = times(result, value)
            else:
                result = tuple(div(part, value[0]) for part in result)
        return result
    top = paired(times, above)
    if not below:
        return top
    bottom = paired(times, below)
    return tuple(div(part, bottom[0]) for part in top)


def _checked(node: Expression, value: Value, values: dict[int, Value], context: Context) -> Value:
    """``value``, or ones if constants have led out of the real numbers (which is reported once, where it happens)."""
    good = all(part.value is None or math.isfinite(part.value) for part in value)
    # of constants (the places of a cord, on a curve), and no constant itself
    made = isinstance(node, Call) and (node.function in {"i", CORD, *CONTACT} or is_reduction(node))
    grows = isinstance(node, Transition) or made
    if good and not grows and any(part.value is None for part in value):
        below = [values[id(child)] for child in children(node) if id(child) in values]
        constant = bool(below) and all(part.value is not None for parts in below for part in parts)
        by_zero = isinstance(node, Call) and node.function == "mod" and below[1][0].value == 0.0
        good = not by_zero and not constant
    if good:
        return value
    context.findings.error("kind/not-finite", "this has no finite value", node.span, helps=why_not_finite(node))
    return (ONE,) * len(value)
