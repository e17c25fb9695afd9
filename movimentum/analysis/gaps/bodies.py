"""The visible things with an outline, and the pairs of them that may overlap."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from movimentum.analysis.diagnose.meshing import meshings
from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import symbols
from movimentum.geometry import hull
from movimentum.outlines.contour import Contour
from movimentum.outlines.cores import Core, core_of
from movimentum.outlines.dense_polygons import DensePolygon
from movimentum.outlines.facets import Facets
from movimentum.scene.model import AnchorCoordinate, Scene, Thing, ThingAngle, VariableComponent
from movimentum.scene.outlines import Circle, rings_of
from movimentum.solver.poses import Poses
from movimentum.things.kinds.body import Composite
from movimentum.things.kinds.disc import Round
from movimentum.things.kinds.toothed import ADDENDUM, DEDENDUM, RIM, Toothed
from movimentum.timeline.model import Segment
from movimentum.tolerances import STAYS_PINNED


class GapBody:
    """A thing with an outline. ``core``: what contains it, about its first anchor; ``solid``: the radius of a disc
    about that anchor which is in it wholly; ``hole``: that of one which is free, or None.
    """

    def __init__(self, thing: Thing, rings: tuple[Contour | Circle, ...] | None) -> None:
        self.thing, self._rings = thing, rings
        self.solid, self.hole = 0.0, None
        self.teeth = 1
        own, origin = thing.own, np.zeros((1, 2))
        if isinstance(own, Toothed) and thing.kind.word == "gear":  # without looking at any tooth
            self.teeth = own.teeth
            tip, root = (own.pitch_radius + each * own.module for each in (ADDENDUM, -DEDENDUM))
            if own.inner:
                self.hole = own.pitch_radius - ADDENDUM * own.module
                tip = own.pitch_radius + (DEDENDUM + RIM) * own.module
            else:
                self.solid = max(root, 0.0)
            self.core = Core(origin, tip, exact=False)
            return
        first = self.rings[0]
        if isinstance(first, Circle):
            self.core = Core(origin, first.radius, exact=len(self.rings) == 1)
            self.solid = first.radius if len(self.rings) == 1 else 0.0
            self.hole = None if len(self.rings) == 1 else float(own.inner)  # type: ignore[attr-defined]
        elif isinstance(own, Composite):
            points = np.concatenate([piece[0].facets.points for piece in own.pieces])
            simple = len(self.rings) == 1 and first.facets.convex
            self.core = core_of(first, Facets.of(np.array(hull(points))), simple=simple)
        else:
            self.core = core_of(first, first.facets)

    @cached_property
    def rings(self) -> tuple[Contour | Circle, ...]:
        """Its outline, and those of its holes."""
        return rings_of(self.thing) if self._rings is None else self._rings

    @property
    def single(self) -> bool:
        """Whether it has one outline; of a gear without looking at its teeth."""
        return self.hole is None if self.teeth > 1 else len(self.rings) == 1

    @cached_property
    def fine(self) -> tuple[DensePolygon, ...]:
        """The same as polygons of many corners."""
        return tuple(
            DensePolygon.disc(each.radius) if isinstance(each, Circle) else DensePolygon.of(each) for each in self.rings
        )

    @cached_property
    def pieces(self) -> tuple[tuple[DensePolygon, ...], ...]:
        """The same by connected pieces."""
        if not isinstance(self.thing.own, Composite):
            return (self.fine,)
        found: list[tuple[DensePolygon, ...]] = []
        place = 0
        for piece in self.thing.own.pieces:
            found.append(self.fine[place : place + len(piece)])
            place += len(piece)
        return tuple(found)

    @cached_property
    def filled(self) -> DensePolygon:
        """The circle about a gear's teeth."""
        return DensePolygon.disc(self.core.reach)

    @property
    def spacing(self) -> float:
        """How far it may go, at least, between two looks, if nothing shall be missed."""
        whole = self.core.radius
        return np.pi * whole / self.teeth / 4.0 if self.teeth > 1 else whole / 8.0

    @property
    def far(self) -> float:
        """How far from its first anchor it reaches."""
        return float(np.hypot(*self.core.points.T).max()) + self.core.reach

    def world(self, poses: Poses) -> FloatArray:
        """(F, 2) where its first anchor is."""
        return poses.world(self.thing.number, self.thing.anchors[0].local)


def bodies_of(scene: Scene) -> list[GapBody]:
    """The things that are drawn and have an outline."""
    found: list[GapBody] = []
    for thing in scene.things:
        if thing.hidden or not thing.is_body or not thing.anchors:
            continue
        if isinstance(thing.own, Toothed) and thing.kind.word == "gear":
            found.append(GapBody(thing, None))
        elif rings := rings_of(thing):
            found.append(GapBody(thing, rings))
    return found


def allowed_overlaps(
    scene: Scene, segment: Segment, bodies: Sequence[GapBody], poses: Poses, *, all_layers: bool
) -> BoolArray:
    """(N, N): which pairs may overlap in a segment: those that share a place of their anchors all along, that are
    meshed or kept in contact by a statement, or whose stated layers differ.
    """
    count = len(bodies)
    place = {body.thing.number: k for k, body in enumerate(bodies)}
    found = np.eye(count, dtype=np.bool_)
    for item in meshings(scene):
        if any(each.number == item.constraint.number for each in segment.active):
            _mark(found, place, {item.first.number, item.second.number})
    pinned = _pinned(bodies, poses)
    round_ones = {(body.thing.number, 0) for body in bodies if isinstance(body.thing.own, Round)}
    for constraint in segment.active:
        if constraint.touches and not isinstance(constraint.left[0].payload, VariableComponent):  # a variable reads
            leaves = symbols(*constraint.left, *constraint.right)
            _mark(found, place, {each.thing for each in leaves if isinstance(each, AnchorCoordinate | ThingAngle)})
            # a pin or a roller about a point that is held to an outline
            outlines = {each.thing for each in leaves if isinstance(each, ThingAngle)}
            points = {(each.thing, each.anchor) for each in leaves if isinstance(each, AnchorCoordinate)}
            held = {point for point in points if point[0] not in outlines}
            for group in pinned:
                if group & held:
                    for thing, _ in group & round_ones:
                        _mark(found, place, outlines | {thing})
    if not all_layers:
        layers = np.array([np.nan if body.thing.look.layer is None else body.thing.look.layer for body in bodies])
        found |= np.abs(layers[:, None] - layers[None]) > 0.0  # not a number differs from nothing
    for group in pinned:
        _mark(found, place, {thing for thing, _ in group})
    return found


def _mark(found: BoolArray, place: dict[int, int], things: set[int]) -> None:
    numbers = [place[thing] for thing in things if thing in place]
    found[np.ix_(numbers, numbers)] = True


def _pinned(bodies: Sequence[GapBody], poses: Poses) -> list[set[tuple[int, int]]]:
    """Anchors (thing, its number there) of several things that are at one and the same place in all these poses."""
    owners: list[tuple[int, int]] = []
    paths: list[FloatArray] = []
    some = slice(None, None, max(1, 2 * len(poses.times) // MOST_COMPARED))
    for body in bodies:
        for number, anchor in enumerate(body.thing.anchors):
            owners.append((body.thing.number, number))
            paths.append(poses.world(body.thing.number, anchor.local)[some].reshape(-1))
    if not paths:
        return []
    where = np.array(paths)
    near = STAYS_PINNED * max(1.0, float(np.abs(where).max()))
    # those that are near each other in one number, after it in the next, and so on
    groups = [np.arange(len(where))]
    for column in where.T:
        parted: list[np.ndarray[tuple[int], np.dtype[np.int64]]] = []
        for group in groups:
            order = group[np.argsort(column[group], kind="stable")]
            ends = np.nonzero(np.diff(column[order]) > near)[0] + 1
            parted += [own for own in np.split(order, ends) if len(own) > 1] if len(ends) else [group]
        groups = parted
    found = [{owners[k] for k in group.tolist()} for group in groups]
    return [anchors for anchors in found if len({thing for thing, _ in anchors}) > 1]


MOST_COMPARED = 60
"""Coordinates of anchors that are compared to tell whether they stay together."""
