"""Finds the things that are shapes of a ``.body``, before any statement is expanded."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.diagnostics import Label, replacement
from movimentum.records import replace
from movimentum.scene.expansion.declaring import Body, Made
from movimentum.scene.expansion.rewriting import Rewriter
from movimentum.scene.expansion.scopes import ShapeEntry
from movimentum.scene.findings import Findings
from movimentum.source import Span
from movimentum.syntax.expression_tree import Expression, Name, Negate
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import Reference

BODY = "body"


def join_shapes(body: Body, rewriter: Rewriter, findings: Findings) -> dict[str, list[str]]:
    """The shapes of each body, by names in the whole script. From now on `rewriter` knows that their anchors are those
    of the body.
    """
    found: dict[str, list[str]] = {}
    bodies = list(_bodies(body))
    names = {made.name for made in bodies}
    for made in bodies:
        errors = findings.errors
        own = found[made.name] = []
        anchors: set[str] = set()
        for part in made.definition.parts:
            if not isinstance(part, Reference):
                continue
            minus = isinstance(part.thing, Negate)
            node = part.thing.operand if isinstance(part.thing, Negate) else part.thing
            span = made.scope.place(node.span)
            for each in rewriter.all_named(node, made.scope):
                name = _shape(each, span, made, names, rewriter, findings)
                if name is None:
                    break
                prefix = name.removeprefix(made.scope.owner.prefix) + "." if own else ""
                rewriter.shapes[name] = ShapeEntry(made.name, prefix, minus)
                anchors |= {prefix + anchor for anchor in rewriter.things[name].anchors}
                own.append(name)
        entry = rewriter.things[made.name]
        rewriter.things[made.name] = replace(entry, anchors=frozenset(anchors))
        if findings.errors > errors:
            findings.broken.add(made.name)
    return found


def _bodies(body: Body) -> Iterator[Made]:
    for item in body.items:
        if isinstance(item, Body):
            yield from _bodies(item)
        elif isinstance(item, Made) and item.definition.shape.word == BODY:
            yield item


def _shape(
    node: Expression, span: Span, made: Made, bodies: set[str], rewriter: Rewriter, findings: Findings
) -> str | None:
    """The name of a thing that can be a shape of a body; None after an error."""
    name = node.name if isinstance(node, Name) else expression_text(node)
    if name not in rewriter.things:
        guess = findings.nearest(name, rewriter.things)
        helps = (replacement(f"did you mean `{guess}`?", span, guess),) if guess else ()
        findings.error("name/unknown-thing", f"there is no thing called `{name}`", span, helps=helps)
        return None
    if name in bodies:
        message = f"`{name}` is a body itself" if name != made.name else f"`{name}` is made of itself"
        findings.error("body/shape", message, span, helps=("name its shapes instead",))
        return None
    if name in rewriter.shapes:
        message = f"`{name}` is a shape of `{rewriter.shapes[name].body}` already"
        labels = (Label(rewriter.things[name].span, f"`{name}` is defined here"),)
        findings.error("body/shape", message, span, labels=labels, helps=("define it once more, under another name",))
        return None
    return name
