"""Reuses solved motion for a timeline that is mostly the same.

A segment's motion depends on its constraints, its time, the things and variables of the scene, and the motion before
it: that is its key. If the key is known, nothing is solved: the motion is reused, and only references into the text are
exchanged. There are no warm starts, so a motion never depends on earlier solves.
"""

from __future__ import annotations

from collections.abc import Hashable

from movimentum.expressions import Expr, symbols
from movimentum.memo import Memo
from movimentum.planning.blocks.block_cache import BlockCache
from movimentum.planning.inequality_reuse import introduced_by_inequalities, is_selecting, with_inequalities_of
from movimentum.planning.lowering.body_frames import FrameCache, body_frames, scene_shift
from movimentum.planning.lowering.builder import Forms
from movimentum.planning.lowering.polynomial import Polynomial, from_expression
from movimentum.planning.plan import Plan
from movimentum.planning.planner import Structure, compile_structure, structure_of
from movimentum.records import dataclass, replace
from movimentum.scene.model import Anchor, Constraint, Scene, Thing, ThingProperty
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.source import Span
from movimentum.timeline.model import Segment

TIMELINES_KEPT = 4
"""Timelines after which what none of them has needed is forgotten."""


class SolverCache:
    """Motions and plans of segments solved before, by everything that they depend on. Threads may share it.

    ``memo`` has motions, structures and plans; ``blocks`` has blocks, and ``memory`` what `basis.block_memo` remembers.
    """

    def __init__(self) -> None:
        self.memo = self.blocks = self.memory = Memo(TIMELINES_KEPT)
        self._last: _OfScene | None = None

    def begin(self) -> None:
        """Another timeline is solved: forget what the last ones had no use for."""
        self.memo.begin()

    def segment_motion(self, key: Hashable, scene: Scene, segment: Segment) -> SegmentMotion | None:
        """The motion kept under ``key``, for a segment that differs in nothing but where it stands in the text."""
        found: SegmentMotion | None = self.memo.get("motion", key)
        return None if found is None else _motion_for(found, scene, segment)

    def keep(self, key: Hashable, segment_motion: SegmentMotion) -> None:
        """Keep a segment's motion."""
        self.memo.keep("motion", key, segment_motion)

    def structure(self, key: Hashable, scene: Scene, segment: Segment) -> Structure:
        """The equations of a segment in groups, as `structure_of`."""
        found: Structure | None = self.memo.get("structure", key)
        if found is not None:
            system, base = (replace(each, scene=scene, segment=segment) for each in (found.system, found.base))
            return replace(found, system=system, base=base)
        stated = self._equations_key(scene, segment)
        alike: Structure | None = self.memo.get("equations", stated)
        found = None if alike is None else with_inequalities_of(alike, scene, segment)
        if found is None:
            found = structure_of(scene, segment, self._of_scene(scene).frames, self._forms_in(scene))
            self.memo.keep("equations", stated, found)
        return self.memo.keep("structure", key, found)

    def plan(self, key: Hashable, structure: Structure, size: float) -> Plan:
        """The plan of a structure, as `compile_structure`; ``key`` is that of its segment."""

        def make() -> Plan:
            return compile_structure(structure, size, BlockCache(self.blocks))

        found = self.memo.of("plan", (key, structure.merged, size), make)
        return _plan_for(found, structure.system.scene, structure.system.segment)

    def _forms_in(self, scene: Scene) -> Forms:
        """Polynomials of what constraints say, by their words: a number keeps the operation that it comes from."""
        text, whole = scene.source.text, self._of_scene(scene).key

        def form(constraint: Constraint, residual: Expr) -> Polynomial | None:
            key = whole, _text_of(constraint.span, text), residual
            return self.memo.of("polynomial", key, lambda: (from_expression(residual),))[0]

        return form

    def _equations_key(self, scene: Scene, segment: Segment) -> Hashable:
        """Everything that a structure depends on but what inequalities compare, and the numbers of constraints."""
        text = scene.source.text
        known = self._of_scene(scene)
        frames = body_frames(scene, segment, known.frames)
        whole = known.key, known.shift, segment.number, segment.step
        stated = tuple(
            (constraint_key(c)[1:], c.paired, _text_of(c.span, text)) for c in segment.active if not is_selecting(c)
        )
        placed = tuple(frames.items()), introduced_by_inequalities(scene, segment, frames)
        return whole, segment.start, segment.end, segment.visible, stated, placed

    def _of_scene(self, scene: Scene) -> _OfScene:
        """What is the same for all segments of ``scene``, if it is the scene last asked for."""
        last = self._last
        if last is None or last.scene is not scene:
            last = self._last = _OfScene(scene, self.memo.number(scene_key(scene)), scene_shift(scene), {})
        return last


class _PlanCache(SolverCache):
    """Plans for those who keep nothing themselves. What a timeline finds beside its plans is forgotten with it."""

    def begin(self) -> None:
        super().begin()
        self.blocks = self.memory = Memo(TIMELINES_KEPT)


_PLANS = _PlanCache()
LARGEST_SHARED_SCENE = 200
"""Things of a scene whose plans are kept for the process."""


def process_plan_cache(scene: Scene) -> SolverCache:
    """Where plans of ``scene`` are kept: so a script that is solved again is not planned again. Large ones are not, as
    nobody could give their memory back.
    """
    return _PLANS if len(scene.things) <= LARGEST_SHARED_SCENE else SolverCache()


@dataclass(frozen=True, slots=True, eq=False)
class _OfScene:
    """The number that stands for a scene's key, its shift, and the frames that its segments have needed."""

    scene: Scene
    key: int
    shift: tuple[float, float]
    frames: FrameCache


def _plan_for(plan: Plan, scene: Scene, segment: Segment) -> Plan:
    """A plan for the same segment of another text."""
    return replace(plan, system=replace(plan.system, scene=scene, segment=segment))


def _motion_for(segment_motion: SegmentMotion, scene: Scene, segment: Segment) -> SegmentMotion:
    """A motion for the same segment of another text."""
    plans: dict[int, Plan] = {}

    def moved(piece: Piece | UnsolvedInterval) -> Piece | UnsolvedInterval:
        if isinstance(piece, UnsolvedInterval):
            return piece
        plan = plans.setdefault(id(piece.plan), _plan_for(piece.plan, scene, segment))
        # a piece's own notes (what is upstream, steppers) are made anew: two motions never share what can change
        return Piece(plan, piece.segment_start, piece.begin, piece.end, piece.tracks, piece.nodes, piece.resolved)

    plans[id(segment_motion.plan)] = _plan_for(segment_motion.plan, scene, segment)
    return replace(
        segment_motion,
        segment=segment,
        plan=plans[id(segment_motion.plan)],
        pieces=[moved(piece) for piece in segment_motion.pieces],
        beginnings=list(segment_motion.beginnings),
        failures=list(segment_motion.failures),
    )


# --- keys ---------------------------------------------------------------------------------------------------


def scene_key(scene: Scene) -> Hashable:
    """Everything of a scene that motion depends on: not where it stands in the text, nor how it is painted.

    Numbers are kept as they are written, too: 0 and -0 are equal, and 1.4 and 0.3 + 1.1 are the same float.
    """
    text = scene.source.text
    colors = any(_reads_property(constraint) for constraint in scene.constraints())
    things = tuple((*thing_key(thing, text), thing.look.paint if colors else None) for thing in scene.things)
    variables = tuple((variable.name, variable.is_vector) for variable in scene.variables.values())
    return things, variables, scene.config.size


def thing_key(thing: Thing, text: str) -> tuple[Hashable, ...]:
    """Everything of a thing that its motion depends on."""
    anchors = tuple(_anchor_key(anchor, text) for anchor in thing.anchors)
    return thing.number, thing.name, thing.kind.word, anchors, thing.radius, thing.through


def segment_key(scene: int, segment: Segment, text: str) -> Hashable:
    """Everything that the equations of a segment depend on; ``scene`` is the number of its scene's `scene_key`."""
    active = tuple((constraint_key(constraint), _text_of(constraint.span, text)) for constraint in segment.active)
    return scene, segment.number, segment.step, segment.start, segment.end, active, segment.visible


def constraint_key(constraint: Constraint) -> tuple[Hashable, ...]:
    """What a constraint says, not where; its number comes first."""
    return (
        constraint.number,
        constraint.step,
        constraint.relation,
        constraint.key,
        constraint.left,
        constraint.right,
        constraint.anchor,
        constraint.strict,
        constraint.speed,
        constraint.pushes,
        constraint.gaps,
        constraint.toward,
        constraint.weakness,
    )


def _anchor_key(anchor: Anchor, text: str) -> Hashable:
    return anchor.name, anchor.local, anchor.coordinates, _text_of(anchor.span, text)


def _text_of(span: Span, text: str) -> str:
    return " ".join(text[span.start : span.end].split())


def _reads_property(constraint: Constraint) -> bool:
    """Whether a constraint is about how something looks: what it looks like otherwise may then matter."""
    sides: tuple[Expr, ...] = (*constraint.left, *constraint.right)
    return any(isinstance(payload, ThingProperty) for payload in symbols(*sides))
