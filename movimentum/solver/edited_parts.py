"""The connected parts of a scene in which an edit changed a statement."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence

from movimentum.expressions import symbols
from movimentum.planning.structure.graph import groups
from movimentum.records import replace
from movimentum.scene.model import AnchorCoordinate, Anonymous, Constraint, Scene, Thing, ThingAngle, VariableComponent
from movimentum.solver.solver_cache import constraint_key
from movimentum.timeline.model import Segment


def edited_part(before: tuple[Scene, Segment], after: tuple[Scene, Segment]) -> Segment | None:
    """The second segment with only the constraints of those parts that are not the same in the first; None where its
    scene has other things, or where more than anchors, angles and variables may connect its parts.
    """
    (old, then), (scene, now) = before, after
    if then.start != now.start or [thing.name for thing in old.things] != [thing.name for thing in scene.things]:
        return None
    nodes: dict[Hashable, int] = {}
    links: list[tuple[int, int]] = []
    members: list[list[int]] = []
    keys = [[constraint_key(constraint)[1:] for constraint in segment.active] for segment in (then, now)]
    same = set(keys[0]).intersection(keys[1])
    drawn = zip(old.things, scene.things, strict=True)
    changed = [nodes.setdefault(b.number, len(nodes)) for a, b in drawn if _drawn_key(a) != _drawn_key(b)]
    gone = [constraint for constraint, key in zip(then.active, keys[0], strict=True) if key not in same]
    for constraint in (*now.active, *gone):
        found = _things_and_variables(constraint)
        if found is None:
            return None
        members.append([nodes.setdefault(each, len(nodes)) for each in found])
    stated = members[: len(now.active)]
    for own, key in zip(stated, keys[1], strict=True):
        links += [(own[0], other) for other in own[1:]]
        changed += own if key not in same else []
    changed += [node for own in members[len(stated) :] for node in own]
    part_of = {node: i for i, part in enumerate(groups(len(nodes), links)) for node in part}
    dirty = {part_of[node] for node in changed}
    active = (c for c, own in zip(now.active, stated, strict=True) if not own or part_of[own[0]] in dirty)
    return replace(now, active=tuple(active))


def connected_parts_of(
    scene: Scene, segments: Sequence[Segment], things: Iterable[int]
) -> tuple[list[Segment], list[Thing]] | None:
    """The segments with only those constraints that what is stated anywhere connects with some ``things`` (by number),
    and all things that are connected; None where more than anchors, angles and variables may connect them.
    """
    nodes: dict[Hashable, int] = {}
    links: list[tuple[int, int]] = []
    members: list[list[list[int]]] = []
    for segment in segments:
        members.append([])
        for constraint in segment.active:
            found = _things_and_variables(constraint)
            if found is None:
                return None
            own = [nodes.setdefault(each, len(nodes)) for each in found]
            links += [(own[0], other) for other in own[1:]]
            members[-1].append(own)
    wanted = {nodes[each] for each in things if each in nodes}
    part = {node for group in groups(len(nodes), links) if wanted.intersection(group) for node in group}
    remaining = [
        replace(segment, active=tuple(c for c, own in zip(segment.active, each, strict=True) if own and own[0] in part))
        for segment, each in zip(segments, members, strict=True)
    ]
    numbers = {each for each, node in nodes.items() if node in part} | set(things)
    return remaining, [thing for thing in scene.things if thing.number in numbers]


def _drawn_key(thing: Thing) -> tuple[Hashable, ...]:
    return thing.kind.word, tuple(anchor.local for anchor in thing.anchors), thing.radius, thing.through


def _things_and_variables(constraint: Constraint) -> list[Hashable] | None:
    """The numbers of the things and the names of the variables that a constraint is about; None where there is more."""
    if constraint.pushes or constraint.gaps or constraint.weakness:
        return None
    found: list[Hashable] = []
    for payload in symbols(*constraint.left, *constraint.right):
        match payload:
            case AnchorCoordinate(thing=thing) | ThingAngle(thing=thing):
                found.append(thing)
            case VariableComponent(name=name):
                found.append(name)
            case Anonymous():
                pass
            case _:
                return None
    return found
