"""Proposes remedies for a contradiction: another length, a pin at another anchor, one statement less.

Each remedy is tried before it is offered.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

from movimentum.diagnostics import Fix
from movimentum.expressions import Expr
from movimentum.scene.model import AnchorCoordinate, AnchorRef, Constraint, Relation, Scene, Thing
from movimentum.scene.text_edits import arguments, array_of, in_script, lengthened, of_one, removed, written_once
from movimentum.source import Edit, SourceText, Span
from movimentum.text import number

MOST_PINS = 8
"""Pins at other anchors that are tried."""
MOST_LEFT_OUT = 6
"""Of contradicting constraints, so many of the last ones are offered to be left out."""
_WORD = re.compile(r"(?<![\w.])[A-Za-z]\w*")
_LAST_WORD = re.compile(r"\.\s*([A-Za-z]\w*)\s*\Z")


def without_constraint(source: SourceText, constraint: Constraint) -> Fix:
    """The script without a constraint."""
    text = " ".join(source.slice(constraint.span).split())
    return Fix(f"leave out `{text}`", (removed(source.text, constraint.span),))


def without_each_constraint(scene: Scene, chosen: Sequence[Constraint]) -> Iterator[Fix]:
    """The script without each of the last of the ``chosen``; not those that a loop or a part states many times, which
    say much more than what contradicts.
    """
    for constraint in reversed(chosen[-MOST_LEFT_OUT:]):
        if written_once(scene, constraint.span):
            yield without_constraint(scene.source, constraint)


def with_length(scene: Scene, thing: Thing, wanted: float, now: float) -> Iterator[Fix]:
    """Another length for a thing: of one copy alone, where its definition is for several."""
    length = f"{number(wanted, 6)} long (it is {number(now, 6)})"
    edit = lengthened(thing, wanted / now)
    array = array_of(scene, thing)
    if array is not None:
        change = None if edit is None else in_script(scene, edit)
        edit = None if change is None else of_one(scene, array, change)
        yield Fix(f"give `{thing.name}` its own definition, {length}", () if edit is None else (edit,))
    elif written_once(scene, thing.span):
        yield Fix(f"make `{thing.name}` {length}", () if edit is None else (edit,))
    yield from _other_constants(scene, thing, wanted / now)
    yield from (Fix(title, (change,)) for title, change in arguments(scene, thing, wanted / now))


def _other_constants(scene: Scene, thing: Thing, factor: float) -> Iterator[Fix]:
    """Each constant that the thing's definition names, with the value that would make the thing as long as it has to
    be, if its length is proportional to it.
    """
    words = set(_WORD.findall(scene.source.slice(thing.span)))
    for constant in scene.constants:
        value = float(constant.value[0].value) if len(constant.value) == 1 else 0.0
        if constant.name not in words or not value:
            continue
        wanted = number(value * factor, 11)
        edit = in_script(scene, Edit(constant.expression, wanted))
        if edit is not None:  # one outside of its `.range` fails when it is tried
            yield Fix(f"set `{constant.name}` to {wanted} (it is {number(value, 6)})", (edit,))


def with_other_pins(scene: Scene, chosen: Sequence[Constraint], active: Sequence[Constraint]) -> list[Fix]:
    """Each pin of the ``chosen`` at another anchor of the same thing, the pins that are closest as drawn first; only if
    nothing that is ``active`` says where that anchor is, for it would be said no more.
    """
    stated = {item.anchor for item in active}
    found: dict[tuple[Span, str], tuple[float, Fix]] = {}
    for constraint in reversed(chosen):
        if constraint.relation is not Relation.EQUAL or constraint.anchor is None:
            continue
        text = " ".join(scene.source.slice(constraint.span).split())
        sides = [(constraint.anchor, constraint.left_span)]
        other = _one_anchor(constraint.right)
        if other is not None:
            sides.append((other, Span(constraint.left_span.end, constraint.span.end)))
        for side, (anchor, span) in reversed(list(enumerate(sides))):
            opposite = None if other is None else _drawn(scene, sides[1 - side][0])
            word = _LAST_WORD.search(scene.source.slice(span))
            body = scene.things[anchor.thing]
            if word is None or word[1] != body.anchors[anchor.anchor].name:
                continue
            place = Span(span.start + word.start(1), span.start + word.end(1))
            for n, each in enumerate(body.anchors):
                restated = span is constraint.left_span and AnchorRef(anchor.thing, n) in stated
                if not restated and math.dist(each.local, body.anchors[anchor.anchor].local) > 0.0:
                    edit = in_script(scene, Edit(place, each.name))
                    if edit is not None:
                        begin = place.start - constraint.span.start
                        after = scene.source.slice(constraint.span)
                        after = " ".join((after[:begin] + each.name + after[begin + len(word[1]) :]).split())
                        apart = math.inf if opposite is None else math.dist(each.local, opposite)
                        fix = Fix(f"`{after}` instead of `{text}`", (edit,))
                        found.setdefault((edit.span, each.name), (apart, fix))
    return [fix for _, fix in sorted(found.values(), key=lambda item: item[0])][:MOST_PINS]


def _drawn(scene: Scene, anchor: AnchorRef) -> tuple[float, float]:
    return scene.things[anchor.thing].anchors[anchor.anchor].local


def _one_anchor(sides: Sequence[Expr]) -> AnchorRef | None:
    """The anchor that two components are those of."""
    match [side.payload if side.op == "symbol" else None for side in sides]:
        case [AnchorCoordinate(thing, anchor, 0), AnchorCoordinate(other, same, 1)] if (thing, anchor) == (other, same):
            return AnchorRef(thing, anchor)
        case _:
            return None
