"""Syntax trees as scripts: the text parses to an equal tree, and equal trees give equal text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from movimentum.syntax.expression_tree import (
    EXTREMES,
    Call,
    Clock,
    Constant,
    Element,
    Expression,
    Name,
    Negate,
    Number,
    Product,
    Rotate,
    Sum,
    Vector,
    postorder,
)
from movimentum.syntax.printer import expression_text, text_literal
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
