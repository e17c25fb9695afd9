"""Edits of a script: a statement more or less, another number or sign. The rest of its layout stays as it is."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from movimentum.scene.model import Claim, Constraint, Relation, Scene, Thing
from movimentum.source import Edit, SourceText, Span
from movimentum.syntax.expression_tree import Name, postorder
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import ClaimStatement, Statement

_REST_OF_LINE = re.compile(r"[ \t]*(//[^\r\n]*|/\*(?:[^*\r\n]|\*(?!/))*\*/[ \t]*)?(?=\r|\n|\Z)")
_END = re.compile(r"(?:\s|//[^\r\n]*|/\*.*?\*/)*;", re.DOTALL)
_SIGN = re.compile(r"[\s)]*([<>]=?)")
_WITHIN = re.compile(r"\.within\s*\(.*\Z", re.DOTALL)
_CONFIG = re.compile(r"\.config\s*\([^(),]*(,[^(),]*,[^(),]*)\)")
_DIGITS = 11
"""Decimals of a coordinate that is written: enough for the solver to take it as exact."""
_BEGIN = 5
"""How far the statements of a step are indented, if nothing else shows it."""


def added(scene: Scene, step: int, statements: str) -> Edit:
    """``statements``, without the last ``;``, behind the last statement of step number ``step``: on a line of their
    own if that statement ends its line.
    """
    text, own = scene.source.text, len(scene.source.script.text)
    if scene.steps[step].span.end > own:  # a step that only parts have: the script gets one too
        statements = f"@{_plain(float(scene.steps[step].time))}  {statements}"
        step = max((each.number for each in scene.steps[:step] if each.span.end <= own), default=0)
    place, indent = _end_of_step(scene, step)
    statements = statements.strip().removesuffix(";").rstrip() + ";"
    rest = _REST_OF_LINE.match(text, place)
    if rest is None:
        return Edit(Span(place, place), " " + statements)
    return Edit(Span(rest.end(), rest.end()), scene.source.newline + indent + statements)


def removed(text: str, span: Span) -> Edit:
    """The statement in ``span`` with its ``;`` and without its line if nothing else is there."""
    start, stop = span.start, statement_end(text, span)
    line_start = _line_start(text, start)
    rest = _REST_OF_LINE.match(text, stop)
    if text[line_start:start].strip() == "" and rest is not None and not rest[1]:
        stop = rest.end()
        if text.startswith("\r\n", stop):
            stop += 2
        elif stop < len(text):
            stop += 1
        return Edit(Span(line_start, stop), "")
    if rest is not None and not rest[1]:  # nothing follows it on its line
        return Edit(Span(len(text[:start].rstrip(" \t")), stop), "")
    while stop < len(text) and text[stop] in " \t" and text[start - 1 : start] in ("", " ", "\t", "\n"):
        stop += 1
    return Edit(Span(start, stop), "")


def renamed(scene: Scene, variable: str, text: str) -> tuple[Edit, ...]:
    """``text`` in the place of every use of a variable."""
    items = [item for item in parse(scene.source.script).items if isinstance(item, Statement | ClaimStatement)]
    nodes = (node for item in items for side in (item.left, item.right) for node in postorder(side))
    return tuple(Edit(node.span, text) for node in nodes if isinstance(node, Name) and node.name == variable)


def turned_round(scene: Scene, item: Constraint) -> Edit | None:
    """An inequality with its sign the other way round."""
    sign = _SIGN.match(scene.source.text, item.left_span.end, item.span.end)
    other = {Relation.BELOW: ">", Relation.ABOVE: "<"}.get(item.relation)
    if sign is None or other is None:
        return None
    return Edit(Span(*sign.span(1)), other + sign[1][1:])


def tolerated(source: SourceText, claim: Claim, tolerance: str) -> Edit:
    """A claim with another tolerance."""
    text = source.slice(claim.span)
    given = _WITHIN.search(text) if claim.tolerance is not None else None
    if given is None:
        return Edit(Span(claim.span.end, claim.span.end), f" .within({tolerance})")
    return Edit(Span(claim.span.start + given.start(), claim.span.end), f".within({tolerance})")


def lengthened(thing: Thing, factor: float) -> Edit | None:
    """The second of a thing's two anchors, ``factor`` times as far from the first; None where its definition does not
    say that plainly.
    """
    if len(thing.anchors) != 2 or thing.picture is not None or not math.isfinite(factor):
        return None
    first, second = thing.anchors
    dx, dy = (round(factor * (b - a), _DIGITS) + 0.0 for a, b in zip(first.local, second.local, strict=True))
    return Edit(second.span, f"{second.name} = {first.name} + [{_plain(dx)}, {_plain(dy)}]")


def resized(scene: Scene, size: tuple[int, int] | None) -> Edit | None:
    """``.config`` with another size of the canvas, or without one."""
    if scene.config.span is None:
        return None
    text = scene.source.slice(scene.config.span)
    given = _CONFIG.match(text)
    if given is None:
        return None
    start = scene.config.span.start
    return Edit(Span(start + given.start(1), start + given.end(1)), "" if size is None else f", {size[0]}, {size[1]}")


def _plain(value: float) -> str:
    return repr(int(value)) if value == int(value) else repr(value)


def statement_end(text: str, span: Span) -> int:
    """The offset behind the ``;`` of the statement in ``span``."""
    end = _END.match(text, span.end)
    return span.end if end is None else end.end()


def _line_start(text: str, place: int) -> int:
    return max(text.rfind("\n", 0, place), text.rfind("\r", 0, place)) + 1


def _end_of_step(scene: Scene, step: int) -> tuple[int, str]:
    """The offset behind the last statement of a step, and the indentation of its lines."""
    text, header = scene.source.text, scene.steps[step].span
    own = len(scene.source.script.text)
    last = max((span for span in _stated(scene, step) if span.end <= own), default=header)
    line = text[_line_start(text, last.start) : last.start]
    indented = last is not header and not line.lstrip().startswith("@")
    indent = line[: len(line) - len(line.lstrip())] if indented else " " * _BEGIN
    return (last.end if last is header else statement_end(text, last)), indent


def _stated(scene: Scene, step: int) -> Iterator[Span]:
    for item in (*scene.steps[step].statements, *scene.steps[step].claims, *scene.steps[step].aims):
        yield item.span
