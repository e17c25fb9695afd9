"""The names of symbols and expressions in the script's own words, for messages."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from decimal import Decimal
from fractions import Fraction

from movimentum.expressions import Expr, walk
from movimentum.expressions.operations import BY_NAME
from movimentum.expressions.tables import Table
from movimentum.scene.leaves import Bearing, ContactPlace, Cord, Stop, Wheel
from movimentum.scene.model import (
    AnchorCoordinate,
    AnchorRef,
    Anonymous,
    GearPair,
    Scene,
    ThingAngle,
    ThingProperty,
    VariableComponent,
)
from movimentum.syntax.printer import number_text, text_literal

_AXES = "xyz"
_SUM, _PRODUCT, _UNARY, _POWER, _ATOM = range(5)


def anchor_name(scene: Scene, anchor: AnchorRef) -> str:
    """``Rod.A``."""
    thing = scene.things[anchor.thing]
    return f"{thing.name}.{thing.anchors[anchor.anchor].name}"


def symbol_name(scene: Scene, payload: Hashable) -> str:
    """The script's name for the payload of a symbol: ``Rod.A.x``, ``Wheel.angle``, ``v.y``, ``x``, ``_``.

    A payload that does not belong to the scene is shown as Python shows it.
    """
    match payload:
        case AnchorCoordinate():
            return f"{anchor_name(scene, AnchorRef(payload.thing, payload.anchor))}.{_AXES[payload.axis]}"
        case ThingAngle():
            thing = scene.things[payload.thing]
            taken = any(anchor.name == "angle" for anchor in thing.anchors)
            return f"{thing.name}.{'a' if taken else 'angle'}"
        case ThingProperty():
            return f"{scene.things[payload.thing].name}.{payload.name}"
        case GearPair():
            pair = f"({scene.things[payload.first].name}, {scene.things[payload.second].name})"
            return (f".belt{pair}" + ".crossed" * payload.crossed) if payload.belt else f".mesh{pair}"
        case ContactPlace():
            return "(place of contact)"
        case Bearing():
            match payload.about:
                case (Cord() as cord, int() as stop):
                    return f"the turn of {symbol_name(scene, cord)} at {_stop_name(scene, cord.stops[stop])}"
                case (AnchorRef() as start, AnchorRef() as end):
                    return f".a([1, 0], {anchor_name(scene, end)} - {anchor_name(scene, start)})"
        case Cord(stops, grips):
            return f".cord({', '.join(_stop_name(scene, stop) for stop in stops)})" + ".grips" * grips
        case VariableComponent():
            return payload.name if payload.axis is None else f"{payload.name}.{_AXES[payload.axis]}"
        case Anonymous():
            return "_" if payload.axis is None else f"_.{_AXES[payload.axis]}"
        case _:
            return str(payload)


def _stop_name(scene: Scene, stop: Stop) -> str:
    match stop:
        case Wheel(thing, side):
            return "-" * (side < 0) + scene.things[thing].name
        case AnchorRef():
            return anchor_name(scene, stop)
        case (x, y):
            return f"[{float_text(x.value or 0.0)}, {float_text(y.value or 0.0)}]"


def float_text(value: float) -> str:
    """A number as a script would spell it, with as many digits as are needed to read it back: ``0.5``, ``-3``."""
    return ("-" if value < 0 else "") + number_text(Decimal(repr(abs(value))))


def expression_name(scene: Scene, root: Expr) -> str:
    """An `Expr` in the script's words; every operation is one that a script could use (no recursion)."""
    done: dict[Expr, tuple[str, int]] = {}

    def tight(node: Expr, least: int) -> str:
        text, level = done[node]
        return text if level >= least else f"({text})"

    for node in walk(root):
        done[node] = _written(scene, node, tight)
    return done[root][0]


def vector_name(scene: Scene, components: tuple[Expr, ...]) -> str:
    """A value of one or two components: ``Rod.A`` for both coordinates of an anchor, else ``[x, y]``."""
    if len(components) == 2:
        x, y = (part.payload if part.op == "symbol" else None for part in components)
        if isinstance(x, AnchorCoordinate) and y == AnchorCoordinate(x.thing, x.anchor, 1) and x.axis == 0:
            return anchor_name(scene, AnchorRef(x.thing, x.anchor))
        if isinstance(x, VariableComponent) and y == VariableComponent(x.name, 1) and x.axis == 0:
            return x.name
        if isinstance(x, Anonymous) and isinstance(y, Anonymous) and x.number == y.number:
            return "_"
    names = [expression_name(scene, part) for part in components]
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _written(scene: Scene, node: Expr, tight: Callable[[Expr, int], str]) -> tuple[str, int]:
    args = node.args
    match node.op:
        case "const":
            value = node.value or 0.0
            return float_text(value), _UNARY if value < 0 else _ATOM
        case "symbol":
            return symbol_name(scene, node.payload), _ATOM
        case "clock":
            start = node.payload
            if start == 0:
                return ".T", _ATOM
            assert isinstance(start, Fraction)
            return f".T {'-' if start > 0 else '+'} {_fraction_text(abs(start))}", _SUM
        case "lifetime":
            return ".iv", _ATOM
        case "progress":
            return ".s", _ATOM
        case "add":
            if args[1].op == "neg":
                return f"{tight(args[0], _SUM)} - {tight(args[1].args[0], _PRODUCT)}", _SUM
            second = args[1].value
            if second is not None and second < 0:
                return f"{tight(args[0], _SUM)} - {float_text(-second)}", _SUM
            return f"{tight(args[0], _SUM)} + {tight(args[1], _PRODUCT)}", _SUM
        case "mul" | "div":
            return f"{tight(args[0], _PRODUCT)}{'*' if node.op == 'mul' else '/'}{tight(args[1], _UNARY)}", _PRODUCT
        case "neg":
            return f"-{tight(args[0], _UNARY)}", _UNARY
        case "pow":
            assert isinstance(node.payload, float)
            return f"{tight(args[0], _ATOM)}^{float_text(node.payload)}", _POWER
        case "le":
            e, bound, below, above = (tight(arg, _SUM) for arg in args)
            return f"{{ {e} : {below} > {bound} : {above} }}", _ATOM
        case "integral" | "derivative":
            return f".{node.op[0]}({tight(args[0], _SUM)})", _ATOM
        case "nearest" | "nearest-turned":
            return "(place of contact)", _ATOM
        case "table":
            assert isinstance(node.payload, Table)
            return _table_text(node.payload, tight(args[0], _SUM)), _ATOM
        case op:
            word = (op in BY_NAME and BY_NAME[op].word) or op
            return f".{word}({', '.join(tight(arg, _SUM) for arg in args)})", _ATOM


def _table_text(table: Table, argument: str) -> str:
    """A table as a script calls it; its derivative by its argument as a quotient of differentials."""
    file, column, rest = table.spelled
    text = f".table({text_literal(file)}, {text_literal(column)}, {argument}){rest}"
    for _ in range(table.order):
        text = f".d({text})/.d({argument})"
    return text


def _fraction_text(value: Fraction) -> str:
    if value.denominator == 1:
        return str(value.numerator)
    decimal = float_text(float(value))
    return decimal if Fraction(decimal) == value else f"{value.numerator}/{value.denominator}"
