"""Pushing inequalities and lower-ranking wishes: the groups that they join, and the rows of such a block."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from math import inf
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import ZERO, Expr, add, const, mul, sub, substitute, symbol, walk
from movimentum.outlines.contour import Contour, derivative_by, substitute_place
from movimentum.outlines.moments import Moments, contour_moments, disc_moments, line_moments, summed
from movimentum.outlines.skin import Skin, disc_skin, gathered_skins, skin_of
from movimentum.planning.blocks.kinds import Block, Free, Pushing
from movimentum.planning.blocks.push_rows import GapRow, PullRows, PushRows, SkinBody
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.planning.lowering.equations import Inequality, Pull, Push, System
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, symbol_numbers
from movimentum.planning.structure.decompose import Group
from movimentum.planning.structure.graph import groups as connected
from movimentum.planning.structure.graph import strong_components
from movimentum.planning.structure.metric import metric_of
from movimentum.records import fields, replace
from movimentum.scene.model import AnchorCoordinate, GapSide, Relation, Thing, ThingAngle
from movimentum.scene.outlines import pieces_of, rings_of
from movimentum.things.kinds.sprite import SpriteImage

_POSE = (PoseX, PoseY, PoseCos, PoseSin)


def in_moving_unknowns(system: System, hanging: Mapping[Expr, Expr], moved: Callable[[Expr], Expr]) -> System:
    """``system`` with its pushes and pulls about what moves, and not about what is ``hanging`` from that; ``moved``: an
    expression in what draws anchors, directions instead of angles.
    """
    memo = dict(hanging)

    def plain(expr: Expr) -> Expr:
        return substitute(expr, lambda _: None, dict(memo))

    def reads(push: Push, value: Expr) -> frozenset[int]:
        return frozenset(symbol_numbers(value)) | (push.reads if push.pairs else frozenset[int]())

    pushes: list[Push] = []
    for push in system.pushes:
        value = plain(push.value)
        rate = None if push.rate is None else plain(push.rate)
        pushes.append(replace(push, value=value, rate=rate, reads=reads(push, value)))
    pulls = [
        replace(
            pull,
            values=tuple(map(plain, pull.values)),
            about=frozenset(symbol_numbers(*(moved(symbol(n)) for n in pull.about))),
            drawn=tuple(map(moved, pull.values)),
        )
        for pull in system.pulls
    ]
    return replace(system, pushes=tuple(pushes), pulls=tuple(pulls))


def with_pushed_groups(groups: Sequence[Group], system: System) -> tuple[Sequence[Group], bool]:
    """``groups`` in which what inequalities push, and what wishes below others draw, is together, and whether there is
    any. Their order is left to the caller.
    """
    of = {n: i for i, group in enumerate(groups) for n in group.unknowns}
    depends = [
        {of[n] for e in group.equations for n in system.equations[e].unknowns if n in of} - {i}
        for i, group in enumerate(groups)
    ]
    loose = _free_and_dependent(groups, depends)
    links: list[tuple[int, int]] = []
    seeds: set[int] = set()
    for reads in (
        *(push.reads for push in system.pushes),
        *(frozenset(_pulled_unknowns(pull)) for pull in system.pulls),
    ):
        own = {of[n] for n in reads if n in of and of[n] in loose}
        own |= _free_groups_behind(own, groups, depends, loose)
        order = sorted(own)
        seeds |= own
        links.extend((order[0], other) for other in order[1:])
    if not seeds:
        return groups, False
    members = list(range(len(groups)))
    part = {i: k for k, some in enumerate(connected(len(groups), links)) for i in some}
    for _ in members:  # what lies between two of one part belongs to it
        count = max(part.values()) + 1
        after: list[set[int]] = [set() for _ in range(count)]
        for i in members:
            after[part[i]] |= {part[k] for k in depends[i]} - {part[i]}
        loops = [some for some in strong_components([sorted(each) for each in after]) if len(some) > 1]
        if not loops:
            break
        for some in loops:
            inside = [i for i in members if part[i] in some]
            part.update(dict.fromkeys(inside, some[0]))
    whole: dict[int, list[int]] = {}
    for i in members:
        whole.setdefault(part[i], []).append(i)
    result: list[Group] = []
    for some in whole.values():
        if not seeds.intersection(some):
            result.extend(groups[i] for i in some)
            continue
        unknowns = tuple(sorted(n for i in some for n in groups[i].unknowns))
        equations = tuple(sorted(e for i in some for e in groups[i].equations))
        result.append(Group(unknowns, equations, free=True, pushed=True))
    return result, True


def unknowns_read_by(group: Group, system: System) -> set[int]:
    """The unknowns that the inequalities and the wishes of a pushed group read."""
    members = set(group.unknowns)
    found: set[int] = set()
    for push in system.pushes:
        if members & push.reads:
            found |= push.reads | (set() if push.rate is None else symbol_numbers(push.rate))
    for pull in system.pulls:
        if members & _pulled_unknowns(pull):
            found |= _pulled_unknowns(pull)
    return found


def _pulled_unknowns(pull: Pull) -> set[int]:
    return symbol_numbers(*pull.values, *pull.drawn)


def _free_and_dependent(groups: Sequence[Group], depends: Sequence[set[int]]) -> set[int]:
    """The groups with freedom, and those that depend on one."""
    loose = {i for i, group in enumerate(groups) if group.free}
    while True:
        more = {i for i, others in enumerate(depends) if i not in loose and others & loose}
        if not more:
            return loose
        loose |= more


def _free_groups_behind(
    own: set[int], groups: Sequence[Group], depends: Sequence[set[int]], loose: set[int]
) -> set[int]:
    """The loose groups that those of ``own`` depend on, as far as groups with freedom."""
    found: set[int] = set()
    stack = [i for i in own if not groups[i].free]
    while stack:
        for other in depends[stack.pop()] & loose:
            if other not in found:
                found.add(other)
                if not groups[other].free:
                    stack.append(other)
    return found


def with_selecting_pushes(system: System, groups: Sequence[Group]) -> System:
    """``system`` in which what pushes nothing, because it is about what is driven, is an inequality that must hold."""
    inside = {n for group in groups if group.pushed for n in group.unknowns}
    more = tuple(
        Inequality(value, push.constraint, pushes=True)
        for push in system.pushes
        if push.rate is None and inside.isdisjoint(push.reads)
        if (value := _distance(system, push) if push.pairs else push.value) is not None
    )
    return replace(system, selectors=(*system.selectors, *more)) if more else system


def _distance(system: System, push: Push) -> Expr | None:
    """What must not be negative of a gap of things that are driven, as one value; None if some of them are not there
    yet.
    """
    constraint = next(each for each in system.segment.active if each.number == push.constraint)
    if constraint.gaps != push.pairs:
        return None
    (gap,) = constraint.left if constraint.relation is Relation.ABOVE else constraint.right
    things = system.scene.things

    def pose(thing: int) -> tuple[Expr, ...]:
        numbers, frame = [system.number_of.get(part(thing)) for part in _POSE], system.frame(thing)
        (ox, oy), (ax, ay) = frame.origin, frame.axis
        still = ox - system.shift[0], oy - system.shift[1], ax, ay
        return tuple(const(v) if n is None else symbol(n) for n, v in zip(numbers, still, strict=True))

    def put(node: Expr) -> Expr | None:
        if isinstance(node.payload, AnchorCoordinate):
            (x, y, c, s), thing = pose(node.payload.thing), node.payload.thing
            dx, dy = map(const, system.frame(thing).local(things[thing].anchors[node.payload.anchor].local))
            if node.payload.axis == 0:
                return add(x, sub(mul(c, dx), mul(s, dy)))
            return add(y, add(mul(s, dx), mul(c, dy)))
        if node.op in ("cosd", "sind") and isinstance(node.args[0].payload, ThingAngle):
            thing = node.args[0].payload.thing
            return system.frame(thing).turn_of(*pose(thing)[2:])[node.op == "sind"]
        return None

    known = {node: value for node in walk(gap) if (value := put(node)) is not None}
    return add(substitute(gap, lambda _: None, known), push.value)


# --- a block


def with_push_rows(block: Block, system: System, clocks: Clocks, size: float) -> Block:
    """A free ``block`` with the inequalities that push it and the wishes that draw it; ``size``: the scene's. It is
    followed even if nothing moves: what is stated about it may contradict itself.
    """
    if not isinstance(block, Free):
        return block
    members = set(block.unknowns)
    pushes = [push for push in system.pushes if members & push.reads]
    pulls = sorted((pull for pull in system.pulls if members & _pulled_unknowns(pull)), key=lambda pull: pull.level)
    rows = _push_rows(pushes, block, system, clocks)
    drawn = _pull_rows(pulls, block, clocks)
    metric = metric_of(system, block.core, lambda t: _points(system, t, size))
    said = [push.value for push in pushes] + [push.rate for push in pushes if push.rate is not None]
    said += [value for pull in pulls for value in (*pull.values, *pull.drawn)]
    reads = symbol_numbers(*said) | {
        n for gap in rows.gaps for body in (gap.first, gap.second) for n in body.numbers if n is not None
    }
    known = (reads | set(metric.coupled)) - members
    given: dict[str, Any] = {each.name: getattr(block, each.name) for each in fields(block)}
    given |= {"metric": metric, "identity": 0, "inputs": block.inputs | known, "moving": True}
    return Pushing(**given, pushes=rows, pulls=drawn)


def _push_rows(pushes: Sequence[Push], block: Free, system: System, clocks: Clocks) -> PushRows:
    values = [push.value for push in pushes]
    entries, slopes = slopes_of(values, block.core)
    wanted = [ZERO if push.rate is None else push.rate for push in pushes]
    bodies: dict[GapSide, SkinBody] = {}

    def body(side: GapSide) -> SkinBody:
        if side not in bodies:
            bodies[side] = _body(system, side)
        return bodies[side]

    gaps = tuple(GapRow(k, body(first), body(second)) for k, push in enumerate(pushes) for first, second in push.pairs)
    known = [value.value for value in values]
    return PushRows(
        len(pushes),
        np.array([0.0 if value is None else value for value in known]),
        tuple(k for k, value in enumerate(known) if value is None),
        compiled([value for value in values if value.value is None], clocks),
        compiled(slopes, clocks),
        tuple(entries),
        tuple(push.constraint for push in pushes),
        gaps,
        frozenset(k for k, push in enumerate(pushes) if push.rate is not None),
        compiled(wanted, clocks),
        frozenset(k for k, push in enumerate(pushes) if push.rate is not None and push.rate.value == 0.0),
    )


def _pull_rows(pulls: Sequence[Pull], block: Free, clocks: Clocks) -> PullRows:
    values = [value for pull in pulls for value in pull.values]
    entries: list[tuple[int, int]] = []
    slopes: list[Expr] = []
    wishes: list[tuple[int, int, int, Any, bool, float, int]] = []
    levels = {level: k for k, level in enumerate(sorted({pull.level for pull in pulls}))}
    first = 0
    for pull in pulls:
        stop = first + len(pull.values)
        own, their = slopes_of(pull.drawn, block.core)
        for (i, j), rate in zip(own, their, strict=True):
            if block.core[j] in pull.about:
                entries.append((first + i, j))
                slopes.append(rate)
        wishes.append((levels[pull.level], first, stop, pull.toward, pull.turns, pull.speed or inf, pull.constraint))
        first = stop
    return PullRows(len(values), compiled(values, clocks), compiled(slopes, clocks), tuple(entries), tuple(wishes))


def _body(system: System, side: GapSide) -> SkinBody:
    """A side of a gap, in the frame of its thing."""
    thing = system.scene.things[side.thing]
    frame = system.frame(side.thing)
    get = system.number_of.get
    x, y, c, s = (get(part(side.thing)) for part in _POSE)
    ax, ay = frame.axis
    skin = anchor_skin(thing, side.anchor) if side.anchor is not None else thing_skin(thing)
    local = frame.local((0.0, 0.0))
    placed = _compiled_skin(skin.placed(*local, ax, -ay))
    ox, oy = frame.origin
    still = ox - system.shift[0], oy - system.shift[1], ax, ay
    return SkinBody(side, system.scene.things, frame, placed, (x, y, c, s), still)


def _compiled_skin(skin: Skin) -> Skin:
    """``skin`` with its curves' values as compiled code."""
    if not skin.bends:
        return skin
    bends = tuple(replace(bend, quick=_curve(bend.contour)) for bend in skin.bends)
    return replace(skin, bends=bends)


@lru_cache(maxsize=64)
def _curve(contour: Contour) -> Callable[[FloatArray], FloatArray]:
    place = symbol(0)
    roots = [
        *contour.position,
        *contour.direction,
        *map(derivative_by, contour.position),
        *map(derivative_by, contour.direction),
    ]
    function = compiled([substitute_place(root, place) for root in roots], Clocks())

    def values(places: FloatArray) -> FloatArray:
        found = np.empty((8, *places.shape))
        with np.errstate(all="ignore"):
            for k, value in enumerate(function({0: places}, ())):
                found[k] = value
        return found

    return values


def thing_skin(thing: Thing) -> Skin:
    """What of a thing may touch, in its local frame."""
    x, y = thing.anchors[0].local
    skins: list[Skin] = []
    for ring in (ring for rings in pieces_of(thing) for ring in rings):
        if isinstance(ring, Contour):
            skins.append(skin_of(ring).placed(x, y, 1.0, 0.0))
        else:
            skins.append(disc_skin(ring.radius, (x, y)))
    return gathered_skins(skins)


def anchor_skin(thing: Thing, anchor: int) -> Skin:
    """One of its anchors, in its local frame."""
    return disc_skin(0.0, thing.anchors[anchor].local)


SMALL_THING_SIZE = 0.02
"""Of the scene's size: how large a thing counts that has neither an outline nor two anchors."""


def _points(system: System, t: int, size: float) -> list[tuple[float, float, float]]:
    """Points of a thing, in its frame, that have the mass and the moments of its outline: by them its motion counts."""
    thing = system.scene.things[t]
    frame = system.frame(t)
    return [(*frame.local((x, y)), weight / size**2) for x, y, weight in as_points(moments_of(thing, size))]


def moments_of(thing: Thing, size: float) -> Moments:
    """How much the motion of a thing counts: the area of its outline, or of its picture, or of the line through its
    anchors.
    """
    if rings_of(thing):
        found = _outline_moments(thing)
        if found[0] > 0.0:
            return found
    if isinstance(thing.own, SpriteImage) and thing.own.image_size is not None:
        w, h = (side * thing.own.scale for side in thing.own.image_size)
        return w * h, w / 2.0, h / 2.0, w * h * w * w / 12.0, 0.0, w * h * h * h / 12.0
    places = [anchor.local for anchor in thing.anchors] or [(0.0, 0.0)]
    return line_moments(np.array(places), 0.0 if len(set(places)) > 1 else SMALL_THING_SIZE * size)


def _outline_moments(thing: Thing) -> Moments:
    """Those of its outline without its holes; what is in a hole does not count."""
    pieces: list[Moments] = []
    for rings in pieces_of(thing):
        some = [contour_moments(ring) if isinstance(ring, Contour) else disc_moments(ring.radius) for ring in rings]
        pieces.append(summed(some, [1.0, *(-1.0 for _ in some[1:])]))
    area, x, y, *second = summed(pieces, [1.0] * len(pieces))
    dx, dy = thing.anchors[0].local
    return area, x + dx, y + dy, second[0], second[1], second[2]


# --- points that move as a whole area does


def as_points(moments: Moments) -> list[tuple[float, float, float]]:
    """Four points (x, y, weight) with the same area, centre and second moments."""
    area, x, y, xx, xy, yy = moments
    squares, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]) / area)
    found: list[tuple[float, float, float]] = []
    for square, (ux, uy) in zip(squares, axes.T, strict=True):
        away = float(np.sqrt(2.0 * max(float(square), 0.0)))
        found += [(x + sign * away * float(ux), y + sign * away * float(uy), area / 4.0) for sign in (-1.0, 1.0)]
    return found
