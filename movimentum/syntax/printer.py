"""Syntax tree to canonical text: the printed text parses to an equal tree, and equal trees give equal text."""

from __future__ import annotations

from decimal import Decimal

from movimentum.syntax.tree import (
    AnchorDefinition,
    Blank,
    Call,
    ClaimStatement,
    Clock,
    ConfigStatement,
    Definition,
    Expression,
    Item,
    Member,
    Name,
    Negate,
    Number,
    Option,
    Power,
    Product,
    Range,
    Reference,
    Rotate,
    ScriptTree,
    Statement,
    StepHeader,
    Sum,
    Text,
    Vector,
    postorder,
)

# How tightly a node binds. A node gets parentheses where a tighter one is needed.
_SUM, _PRODUCT, _UNARY, _POWER, _POSTFIX, _ATOM = range(6)


def script_text(script: ScriptTree) -> str:
    """The script, one item on each line; ends with a newline unless it is empty."""
    lines: list[str] = []
    after_time = False
    for item in script.items:
        line = item_text(item)
        if after_time and line.startswith("-") and isinstance(item, Statement):
            # After `@8` a minus would belong to the time.
            line = f"({expression_text(item.left)}) {item.comparison} {expression_text(item.right)};"
        after_time = isinstance(item, StepHeader)
        lines.append(line + "\n")
    return "".join(lines)


def item_text(item: Item) -> str:
    """One definition, step header or statement."""
    match item:
        case ConfigStatement():
            parts = [f".config({_arguments(item.arguments)})", *map(_option_text, item.options)]
        case Definition():
            parts = [f"{item.name} :", _shape_text(item), *map(_part_text, item.parts)]
        case StepHeader():
            return f"@{'+' if item.relative else ''}{expression_text(item.time)}"
        case ClaimStatement():
            parts = [".claim", expression_text(item.left), item.comparison, expression_text(item.right)]
            if item.tolerance is not None:
                parts.append(f".within({expression_text(item.tolerance)})")
        case Statement():
            parts = [expression_text(item.left), item.comparison, expression_text(item.right)]
            if item.speed is not None:
                parts.append(f".speed({expression_text(item.speed)})")
    return " ".join(parts) + ";"


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
            case Number():
                made = number_text(node.value), _UNARY  # not an atom: `2.x` could be misread
            case Name():
                made = node.name, _ATOM
            case Blank():
                made = "_", _ATOM
            case Clock():
                made = f".{node.name}", _ATOM
            case Vector():
                made = f"[{listed(node.components)}]", _ATOM
            case Member():
                made = f"{tight(node.operand, _POSTFIX)}.{node.name}", _POSTFIX
            case Rotate():
                made = f"{tight(node.operand, _POSTFIX)}.r({done[id(node.angle)][0]})", _POSTFIX
            case Call():
                made = f".{node.function}({listed(node.arguments)})", _ATOM
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
                pieces = [f"{{ {done[id(node.subject)][0]} : {done[id(node.values[0])][0]}"]
                for bound, value in zip(node.bounds, node.values[1:], strict=True):
                    pieces.append(f" > {done[id(bound)][0]} : {done[id(value)][0]}")
                made = "".join(pieces) + " }", _ATOM
        done[id(node)] = made
    return done[id(root)][0]


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


def _arguments(arguments: tuple[Expression | Text, ...]) -> str:
    return ", ".join(text_literal(item.text) if isinstance(item, Text) else expression_text(item) for item in arguments)


def _option_text(option: Option) -> str:
    return f".{option.name}({_arguments(option.arguments)})" if option.arguments else f".{option.name}"


def _shape_text(definition: Definition) -> str:
    shape = definition.shape
    arguments = () if shape.argument is None else (shape.argument,)
    if shape.word == "sprite":
        return _arguments(arguments)
    return f".{shape.word}({_arguments(arguments)})" if arguments else f".{shape.word}"


def _part_text(part: AnchorDefinition | Reference | Option) -> str:
    match part:
        case Option():
            return _option_text(part)
        case Reference():
            return f"{part.thing}.{part.anchor}"
        case AnchorDefinition():
            offsets = "".join(f" {operator} {expression_text(vector)}" for operator, vector in part.offsets)
            return f"{part.name} = {expression_text(part.base)}{offsets}"
