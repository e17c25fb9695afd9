"""Syntax tree to canonical text: the printed text parses to an equal tree, and equal trees give equal text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal
from fractions import Fraction

from movimentum.syntax.expression_tree import (
    EXTREMES,
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
    AnchorDefinition,
    ClaimStatement,
    ConfigStatement,
    Copy,
    Definition,
    FilmLoop,
    Include,
    Item,
    Let,
    Loop,
    Option,
    PartDefinition,
    Purpose,
    Reference,
    ScriptTree,
    ShapeWord,
    Statement,
    StepHeader,
    Suffix,
    Text,
    Toward,
    ViewStatement,
)

_IN_TIMES = (Number, Constant, Name, Clock, Call, Negate, Sum, Product)
_IN_PLACES = (Number, Constant, Name, Vector, Element, Call, Clock, Negate, Product, Rotate)

# How tightly a node binds. A node gets parentheses where a tighter one is needed.
_SUM, _PRODUCT, _UNARY, _POWER, _POSTFIX, _ATOM = range(6)


def script_text(script: ScriptTree) -> str:
    """The script, one item on each line; ends with a newline unless it is empty."""
    return "".join(line + "\n" for line in _lines(script.items))


def _lines(items: Iterable[Item]) -> Iterator[str]:
    after_time = False
    for item in items:
        if isinstance(item, PartDefinition | Loop):
            yield _head_text(item) + " {"
            yield from ("  " + line for line in _lines(item.items))
            yield "}"
        else:
            line = item_text(item)
            if after_time and line.startswith("-") and isinstance(item, Statement):
                # After `@8` a minus would belong to the time.
                left = expression_text(item.left)
                line = f"({left})" + line.removeprefix(left)
            yield line
        after_time = isinstance(item, StepHeader)


def _head_text(item: PartDefinition | Loop) -> str:
    if isinstance(item, Loop):
        return f".for {item.name} = {_range_text(item.first, item.last)}"
    parameters = ", ".join(
        each.name if each.default is None else f"{each.name} = {_arguments((each.default,))}"
        for each in item.parameters
    )
    return f".part {item.name}({parameters})"


def _range_text(first: Expression, last: Expression) -> str:
    return f"{expression_text(first)}..{expression_text(last)}"


def item_text(item: Item) -> str:
    """One definition, step header or statement."""
    match item:
        case ConfigStatement():
            parts = [f".config({_arguments(item.arguments)})", *map(_option_text, item.options)]
        case ViewStatement():
            parts = [f".view({_arguments(item.arguments)})", *map(_option_text, item.options)]
        case Let():
            value = _value_text(item.value, bool(item.options))
            parts = [f".let {item.name} =", value, *map(_option_text, item.options)]
        case Include():
            parts = [".include", text_literal(item.path.text)]
        case FilmLoop():
            parts = [".loop"]
        case PartDefinition() | Loop():
            return _head_text(item) + " { " + " ".join(map(item_text, item.items)) + " }"
        case Copy():
            head = f"{item.name}{_suffixes_text(item.suffixes)} :"
            parts = [head, f"{item.part}({_arguments(item.arguments)})", *map(_option_text, item.options)]
        case Definition() if item.shape.word == "body":
            return _body_text(item)
        case Definition():
            head = f"{item.name}{_suffixes_text(item.suffixes)} :"
            parts = [head, _shape_text(item.shape), *map(_part_text, item.parts)]
        case StepHeader():
            time = expression_text(item.time)
            plain = all(_fits(node, _IN_TIMES) for node in postorder(item.time))
            return f"@{'+' if item.relative else ''}{time if plain else f'({time})'}"
        case ClaimStatement():
            parts = [f".{item.purpose}", expression_text(item.left), item.comparison]
            if item.comparison not in EXTREMES:
                parts.append(expression_text(item.right))
            if item.extent is not None:
                word = "weight" if item.purpose is Purpose.GOAL else "within"
                parts.append(f".{word}({expression_text(item.extent)})")
            parts += [".always"] if item.always else []
        case Statement():
            parts = [expression_text(item.left)]
            if item.toward is Toward.STAY:
                parts.append(item.toward)
            else:
                parts += [item.comparison, item.toward or _side_text(item.right)]
            parts += map(_option_text, item.options)
    return " ".join(parts) + ";"


_LIKE_OPTIONS = (".pushes", ".weak")


def _side_text(side: Expression) -> str:
    """A side of a statement; an anchor whose name is an option's stands in parentheses."""
    text = expression_text(side)
    return f"({text})" if text.endswith(_LIKE_OPTIONS) else text


def _body_text(item: Definition) -> str:
    text = f".body {item.name}{_suffixes_text(item.suffixes)} ="
    for number, part in enumerate(item.parts):
        minus = isinstance(part, Reference) and isinstance(part.thing, Negate)
        sign = "" if number == 0 or not isinstance(part, Reference) else " -" if minus else " +"
        text += f"{sign} {_part_text(part).removeprefix('-')}"
    return text + ";"


def _value_text(value: Expression | Text, before_option: bool) -> str:
    """A constant's value; behind a number a word would be read as its member."""
    text = _arguments((value,))
    return f"({text})" if before_option and not isinstance(value, Number | Text) else text


def _suffixes_text(suffixes: tuple[Suffix, ...]) -> str:
    def inner(suffix: Suffix) -> str:
        if suffix.last is None:
            return expression_text(suffix.first)
        name = f"{suffix.name} = " if suffix.name else ""
        return name + _range_text(suffix.first, suffix.last)

    return "".join(f"[{inner(suffix)}]" for suffix in suffixes)


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
    """What stands behind ``.table(…)``; ``over`` is the literal of a column's name."""
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


def _arguments(arguments: tuple[Expression | Text, ...]) -> str:
    return ", ".join(text_literal(item.text) if isinstance(item, Text) else expression_text(item) for item in arguments)


def _option_text(option: Option) -> str:
    return f".{option.name}({_arguments(option.arguments)})" if option.arguments else f".{option.name}"


def _shape_text(shape: ShapeWord) -> str:
    if shape.word == "sprite":
        return _arguments(shape.arguments)
    if shape.word == "curve" and shape.arguments:
        return f".curve {_arguments(shape.arguments)}"
    return f".{shape.word}({_arguments(shape.arguments)})" if shape.arguments else f".{shape.word}"


def _part_text(part: AnchorDefinition | Reference | Option) -> str:
    match part:
        case Option():
            return _option_text(part)
        case Reference():
            index = "" if part.index is None else f"[{expression_text(part.index)}]"
            return f"{expression_text(part.thing)}.{part.anchor}{index}" if part.anchor else expression_text(part.thing)
        case AnchorDefinition(name=""):
            return expression_text(part.base)
        case AnchorDefinition():
            offsets = "".join(f" {operator} {_term_text(value)}" for operator, value in part.offsets)
            suffix = "" if part.suffix is None else _suffixes_text((part.suffix,))
            return f"{part.name}{suffix} = {_term_text(part.base)}{offsets}"


def _fits(node: Expression, kinds: tuple[type, ...]) -> bool:
    """Whether the grammar of times, or of places, has the node by itself; `.range` is an option's word there."""
    return isinstance(node, kinds) and not (isinstance(node, Call) and node.function == "range")


def _term_text(value: Expression) -> str:
    """A term of an anchor's place: what an anchor's grammar does not have by itself goes into parentheses."""
    text = expression_text(value)
    simple = all(_fits(node, _IN_PLACES) for node in postorder(value) if not isinstance(node, Number))
    inside = isinstance(value, Name | Vector | Element | Number | Call) and _fits(value, _IN_PLACES)
    return text if inside or (simple and not isinstance(value, Sum)) else f"({text})"
