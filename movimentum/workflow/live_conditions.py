"""What the settings of a living figure have to keep to beside its equations: what `solve` refuses before it begins."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.analysis.diagnose.meshing import PLAY, Meshing, meshings
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
from movimentum.records import fields
from movimentum.scene.model import AnchorCoordinate, Scene, Thing
from movimentum.solver.motion import PathMotion
from movimentum.things.kinds.toothed import RACK


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
            play = mul(const(PLAY), _module(item.first))
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
