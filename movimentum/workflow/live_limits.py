"""Checks what cannot be a living figure, and the conditions on its settings besides the equations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.analysis.diagnose.meshing import CENTRE_PLAY, Meshing, meshings
from movimentum.diagnostics import Diagnostic, Severity, real
from movimentum.errors import ScriptError
from movimentum.expressions import (
    ZERO,
    Expr,
    Occurring,
    StatedNumber,
    add,
    as_stated,
    call,
    const,
    div,
    mul,
    named_origins,
    sub,
    symbol,
)
from movimentum.records import fields, replace
from movimentum.scene.model import AnchorCoordinate, Scene, Thing
from movimentum.solver.motion import PathMotion
from movimentum.source import Span
from movimentum.things.kinds.toothed import RACK
from movimentum.workflow.equations import no_form

if TYPE_CHECKING:
    from movimentum.equations.program import NoProgram
    from movimentum.living.page import Slider
    from movimentum.solver.poses import Poses
    from movimentum.source import SourceText


CANNOT = "live/cannot"


def _uses(source: SourceText, name: str) -> Iterator[Span]:
    """Where the script names a constant, other than to give it a value; texts and comments left out."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/|'[^'\n]*'", lambda m: re.sub(r"[^\n]", " ", m[0]), source.text, flags=re.DOTALL)
    for match in re.finditer(rf"(?<!\w)(?<![^.]\.){re.escape(name)}(?!\w)", text):
        if not re.search(r"\.let\s*$", text[: match.start()]):
            yield Span(match.start(), match.end())


def _use(source: SourceText, name: str, inside: Span | None) -> Span | None:
    spans = list(_uses(source, name))
    within = [span for span in spans if inside is not None and inside.start <= span.start < inside.end]
    return within[0] if within else spans[0] if spans else None


def _error(scene: Scene, message: str, span: Span | None, *helps: str) -> ScriptError:
    return ScriptError([real(Diagnostic(CANNOT, Severity.ERROR, message, span, helps=helps), scene.source)])


def built(source: SourceText, scene: Scene, slider: Slider) -> ScriptError:
    """A constant that says how many things there are, when steps begin, or how large the canvas is."""
    headers = [step.span for step in scene.steps] + ([scene.config.span] if scene.config.span else [])
    spans = list(_uses(source, slider.name))
    span = next((s for s in spans if any(h.start <= s.start < h.end for h in headers)), spans[0] if spans else None)
    message = f"`{slider.name}` cannot be a slider: times, the canvas or the number of things depend on it"
    return _error(scene, message, span, "write the number here", Advised("leave it out of ", Choose.LIVE.to()))


def cannot(source: SourceText, scene: Scene, thing: Thing, sliders: Sequence[Slider]) -> ScriptError:
    """A thing that is drawn as it is now."""
    name = next(
        (s.name for s in sliders if any(thing.span.start <= u.start < thing.span.end for u in _uses(source, s.name))),
        sliders[0].name,
    )
    what = "its picture" if thing.picture is not None else "how it is drawn"
    message = f"`{thing.name}` does not follow the slider of `{name}`: {what} is made only once"
    return _error(
        scene,
        message,
        _use(source, name, thing.span),
        "write the number here",
        Advised("leave it out of ", Choose.LIVE.to()),
    )


def useless(source: SourceText, scene: Scene, slider: Slider) -> ScriptError:
    """A constant that nothing depends on."""
    message = f"nothing that is drawn or solved depends on `{slider.name}`"
    return _error(scene, message, _use(source, slider.name, None), Advised("leave it out of ", Choose.LIVE.to()))


def refuse_film_drawings(scene: Scene) -> None:
    """`ScriptError` for what is drawn from the whole film."""
    from movimentum.expressions import walk
    from movimentum.scene.shown import Shown

    for thing in scene.things:
        values = [piece.value for piece in thing.pieces if isinstance(piece, Shown)]
        kept = thing.kind.word in ("graph", "polode", "centre", "inflection", "velocities", "inset", "cord")
        if not thing.hidden and (kept or any(node.op == "derivative" for value in values for node in walk(value))):
            message = f"`{thing.name}` does not follow sliders: {thing.called} is made from the whole film"
            if not kept:
                message = f"`{thing.name}` does not follow sliders: it shows a rate"
            raise _error(scene, message, thing.span, f"write `.hidden` behind `{thing.name}`, or leave it out")


def refuse_changing(scene: Scene, film: Poses) -> None:
    """`ScriptError` for a camera, and for layers and sizes of things that change: only their colours follow."""
    from movimentum.expressions import symbols
    from movimentum.scene.shown import ARROW

    changing = {key for key in film.properties if not key[1].startswith("text ")}
    changing = {key for key in changing if key[1] not in (*ARROW, "opacity", "red", "green", "blue")}
    for thing, name in sorted(changing):
        spans = [
            constraint.span
            for constraint in scene.constraints()
            for one in symbols(*constraint.left, *constraint.right)
            if getattr(one, "name", None) == name or (thing < 0 and getattr(one, "thing", 0) == thing)
        ]
        what = f"the {name} of `{scene.things[thing].name}`" if thing >= 0 else "the camera"
        raise _error(scene, f"{what} does not follow sliders", spans[0] if spans else None, "leave the statement out")


def no_program(error: NoProgram, scene: Scene) -> ScriptError:
    """A motion without formulas, with the statement that is the reason."""
    found = no_form(error, scene).diagnostics[0]
    message = f"{found.message}: a living figure needs one for everything that moves"
    return ScriptError([replace(found, code=CANNOT, message=message, helps=("`movimentum run` makes a film of it",))])


def conditions(scene: Scene, motion: PathMotion) -> Iterator[Expr]:
    """Expressions of the scene that have a value, and are not negative, where `solve` begins: constants are finite,
    radii and the like positive, and gears that mesh all the time have the distance at which their teeth fit.
    """
    for constant in scene.constants:
        for each in constant.value:
            value = each.computed
            if isinstance(value, Expr) and named_origins(value) and _partial(value):
                yield mul(value, value)
    for thing in scene.things:
        for record in (thing.own, thing.look):
            for each in (getattr(record, one.name) for one in fields(record)):
                if isinstance(each, StatedNumber) and each.positive and named_origins(each.stated):
                    yield each.stated
    active = [{one.number for one in each.segment.active} for each in motion.segments]
    always = active[0].intersection(*active[1:])
    for item in meshings(scene):
        if item.constraint.number in always:
            play = mul(const(CENTRE_PLAY), _module(item.first))
            off = sub(_distance(item), _fitting(item))
            yield sub(mul(play, play), mul(off, off))


def _module(thing: Thing) -> Expr:
    return as_stated(thing.toothed.module)


def _fitting(item: Meshing) -> Expr:
    """See `Meshing.fitting`."""
    first, second = (
        mul(const(each.toothed.teeth / 2.0), _module(each)) if each.kind is not RACK else ZERO
        for each in (item.first, item.second)
    )
    return sub(first, second) if item.first.kind is not RACK and item.first.toothed.inner else add(first, second)


def _distance(item: Meshing) -> Expr:
    """See `Meshing.distances`."""
    (x, y), apart = _anchor(item.first, 0), _anchor(item.second, 0)
    dx, dy = sub(apart[0], x), sub(apart[1], y)
    if item.first.kind is not RACK:
        return call("sqrt", add(mul(dx, dx), mul(dy, dy)))
    along = _anchor(item.first, 1)
    ax, ay = sub(along[0], x), sub(along[1], y)
    return div(sub(mul(ax, dy), mul(ay, dx)), call("sqrt", add(mul(ax, ax), mul(ay, ay))))


def _anchor(thing: Thing, number: int) -> tuple[Expr, Expr]:
    x, y = (symbol(AnchorCoordinate(thing.number, number, axis)) for axis in (0, 1))
    return x, y


def _partial(constant: Expr) -> bool:
    """Whether a constant is made by an operation that has no value everywhere."""
    stack, seen = [constant], set[int]()
    while stack:
        node = stack.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if node.occurring & Occurring.PARTIAL:
            return True
        stack.extend(node.args if node.origin is None else (node.origin, *node.args))
    return False
