"""``.mesh(A, B)`` and ``.belt(A, B)``: which two things, and whether they can run together."""

from __future__ import annotations

import re
from dataclasses import replace

from movimentum.diagnostics import Fix, Label, replacement
from movimentum.expressions import Expr, as_stated, const, div, mul
from movimentum.scene.findings import Findings
from movimentum.scene.model import GearPair, Thing
from movimentum.source import Span
from movimentum.syntax.expression_tree import Call, Expression, Member, Name, Negate, Power, Product, Sum
from movimentum.syntax.printer import float_text
from movimentum.syntax.tree import ClaimStatement, Statement
from movimentum.syntax.vocabulary import ENDING_WORDS
from movimentum.things.kinds.toothed import GEAR, RACK, Toothed
from movimentum.tolerances import SAME_MODULE

PAIRED = frozenset({"mesh", "belt"})
"""The functions whose arguments are things."""


def has_word(node: Expression) -> bool:
    """``.belt(A, B) .crossed`` and its like."""
    if not isinstance(node, Member) or not isinstance(node.operand, Call):
        return False
    return ENDING_WORDS.get(node.name) == node.operand.function


def without_word(statement: Statement | ClaimStatement) -> tuple[Expression, Expression, bool]:
    """Both sides without such a word, wherever it is written (``.belt(A, B) .crossed = 0``, ``.belt(A, B) = 0
    .crossed``), and whether there is one: it does not belong to the key.
    """
    left, right, worded = statement.left, statement.right, False
    if has_word(left):
        assert isinstance(left, Member)
        left, worded = left.operand, True
    if isinstance(left, Call) and (shorter := _shorter(right, left.function)) is not None:
        right, worded = shorter, True
    return left, right, worded


def _shorter(side: Expression, function: str) -> Expression | None:
    """A side without the word of the function, which a sum, a product and a sign have behind their last operand; None
    if it does not end so.
    """
    if isinstance(side, Member):
        return side.operand if ENDING_WORDS.get(side.name) == function else None
    if isinstance(side, Negate):
        inner = _shorter(side.operand, function)
        return None if inner is None else replace(side, operand=inner)
    if isinstance(side, Power):
        inner = _shorter(side.exponent, function)
        return None if inner is None else replace(side, exponent=inner)
    if isinstance(side, Sum | Product):
        inner = _shorter(side.operands[-1], function)
        return None if inner is None else replace(side, operands=(*side.operands[:-1], inner))
    return None


def pair_of(node: Call, known: dict[str, Thing], findings: Findings) -> GearPair | None:
    """The two things that a call names; None after an error.

    Errors: ``kind/mismatch``, ``name/unknown-thing``, ``mesh/module``, ``mesh/ring``.
    """
    things = [_thing(argument, node.function, known, findings) for argument in node.arguments]
    first, second = things
    if first is None or second is None:
        return None
    if first is second:
        message = f"`.{node.function}` joins two things, and this is one"
        findings.error("kind/mismatch", message, node.span)
        return None
    belt = node.function == "belt"
    if not belt and not _can_mesh(node, first, second, findings):
        return None
    return GearPair(first.number, second.number, belt)


def belt_radius(thing: Thing) -> float | None:
    """The radius at which a belt runs about a thing; None if it has none."""
    if thing.kind is GEAR and isinstance(thing.own, Toothed) and not thing.own.inner:
        return thing.own.pitch_radius
    return thing.radius


def stated_belt_radius(thing: Thing) -> Expr:
    """`belt_radius` as the script states it; 1 if there is none."""
    if thing.kind is GEAR and isinstance(thing.own, Toothed):
        return div(mul(as_stated(thing.own.module), const(thing.own.teeth)), const(2.0))
    return as_stated(thing.radius or 1.0)


def _thing(argument: Expression, function: str, known: dict[str, Thing], findings: Findings) -> Thing | None:
    wanted = "discs or gears" if function == "belt" else "gears or racks"
    if isinstance(argument, Member) and isinstance(argument.operand, Name) and argument.operand.name in known:
        name = argument.operand.name
        findings.error(
            "kind/mismatch",
            f"`.{function}` takes things, not their anchors",
            argument.span,
            helps=(replacement(f"write `{name}`", argument.span, name),),
        )
        return None
    if not isinstance(argument, Name):
        findings.error("kind/mismatch", f"`.{function}` takes the names of two {wanted}", argument.span)
        return None
    thing = known.get(argument.name)
    fitting = [name for name, each in known.items() if _fits(each, function)]
    if thing is None and findings.is_lost(argument.name):
        return None
    if thing is None:
        guess = findings.nearest(argument.name, fitting) or findings.nearest(argument.name, known)
        helps = (replacement(f"did you mean `{guess}`?", argument.span, guess),) if guess else ()
        message = f"there is no thing called `{argument.name}`"
        findings.error("name/unknown-thing", message, argument.span, helps=helps)
        return None
    if not _fits(thing, function):
        findings.error(
            "kind/mismatch",
            f"`.{function}` is for {wanted}, and `{thing.name}` is {'a ring' if _is_ring(thing) else 'neither'}",
            argument.span,
            labels=(Label(thing.name_span, f"`{thing.name}` is defined here"),),
            helps=_remedy(thing, function, findings),
        )
        return None
    return thing


def _fits(thing: Thing, function: str) -> bool:
    if function == "belt":
        return belt_radius(thing) is not None
    return isinstance(thing.own, Toothed)


def _is_ring(thing: Thing) -> bool:
    return isinstance(thing.own, Toothed) and thing.own.inner


def _remedy(thing: Thing, function: str, findings: Findings) -> tuple[str | Fix, ...]:
    """The definition as it should be."""
    if _is_ring(thing):
        return ()
    if function == "belt":
        return (f"define it as a wheel: `{thing.name} : .disc(30) …`",)
    if thing.radius is None:
        return (f"define it as a gear: `{thing.name} : .gear(20, 4) …`",)
    gear = f".gear(20, {float_text(round(thing.radius / 10.0, 6))})"
    title = f"define it as a gear: `{thing.name} : {gear} …` is as large"
    written = re.search(r"\.disc\s*\([^()]*\)", findings.source.slice(thing.span))
    if written is None:
        return (title,)
    start = thing.span.start
    return (replacement(title, Span(start + written.start(), start + written.end()), gear),)


def _can_mesh(node: Call, first: Thing, second: Thing, findings: Findings) -> bool:
    """Whether the teeth of two things fit into each other; what is wrong is reported."""
    teeth, others = first.toothed, second.toothed
    places = (Label(first.name_span, _described(first)), Label(second.name_span, _described(second)))
    if first.kind is RACK and second.kind is RACK:
        findings.error("kind/mismatch", "two racks cannot mesh", node.span, labels=places)
        return False
    rings = [thing for thing in (first, second) if thing.toothed.inner]
    inside = [thing for thing in (first, second) if not thing.toothed.inner]
    if len(rings) == 2 or (rings and inside[0].kind is RACK):
        message = "two rings cannot mesh" if len(rings) == 2 else "a ring cannot mesh with a rack"
        findings.error("mesh/ring", message, node.span, labels=places)
        return False
    if abs(teeth.module - others.module) > SAME_MODULE * teeth.module:
        findings.error(
            "mesh/module",
            f"teeth of modules {float_text(teeth.module)} and {float_text(others.module)} do not fit into each other",
            node.span,
            labels=places,
            helps=(_same_module(first, second),),
        )
        return False
    if rings and rings[0].toothed.teeth <= inside[0].toothed.teeth:
        findings.error(
            "mesh/ring",
            f"the ring `{rings[0].name}` has {rings[0].toothed.teeth} teeth, and `{inside[0].name}`, which would be"
            f" inside, has {inside[0].toothed.teeth}",
            node.span,
            labels=places,
            helps=(f"a ring needs more teeth than what runs in it: `.gear({inside[0].toothed.teeth * 3}, …) .inner`",),
        )
        return False
    return True


def _same_module(first: Thing, second: Thing) -> str:
    module = float_text(first.toothed.module)
    return f"give both one module: `{second.name} : .{second.kind}({second.toothed.teeth}, {module}) …`"


def _described(thing: Thing) -> str:
    kind = "ring" if thing.toothed.inner else thing.kind.word
    return f"a {kind} of {thing.toothed.teeth} teeth, module {float_text(thing.toothed.module)}"
