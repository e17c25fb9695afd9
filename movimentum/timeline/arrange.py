"""Scene to Timeline: when and for how long each constraint holds, and the times of the frames."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from fractions import Fraction
from typing import cast

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.expressions import ONE, ZERO, Expr, Occurring, call, clock, div, ratio, substitute, walk
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import StoredValue, cords_of, stored_values_in
from movimentum.scene.model import Claim, Constraint, Ending, Relation, Scene
from movimentum.text import fraction_text
from movimentum.timeline.model import Segment, TimedClaim, Timeline
from movimentum.timeline.trains import Trains

Sides = tuple[Expr, ...]

MAX_FRAMES = 1_000_000
"""How many frames a film may have, unless the caller says otherwise."""


@dataclass(frozen=True, slots=True)
class _StepState:
    """The statements that hold from a step onwards."""

    step: int
    time: Fraction
    active: tuple[Constraint, ...]


def arrange(scene: Scene, *, fps: Fraction | int | None = None, max_frames: int = MAX_FRAMES) -> Timeline:
    """The scene in time, at ``fps`` frames per time unit (None: the script's).

    A step that states a key replaces everything that earlier steps stated under it. All statements of one step under
    one key hold together. An ending ends them; the relation's direction belongs to the key. Steps at one time make one
    segment. ``.iv`` is replaced by the time a constraint stays stated; if that is 0 (stated in the last step, or
    replaced at the same time), it is replaced by 1, so that ``.t/.iv`` is 0 and no division fails.

    Raises ScriptError: ``timeline/no-step`` for a scene without steps, ``limit/frames`` if there would be more than
    ``max_frames`` frames (before anything else is done), ``timeline/order`` for steps that go back in time.
    """
    if not scene.steps:
        raise _refusal("timeline/no-step", "the script has no step, so there is no moment to show")
    rate = Fraction(scene.config.fps if fps is None else fps)
    start, end = scene.steps[0].time, scene.steps[-1].time
    frames = int((end - start) * rate) + 1
    if frames > max_frames:
        span = f"from {fraction_text(start)} to {fraction_text(end)}"
        raise ScriptError(
            [
                Diagnostic(
                    "limit/frames",
                    Severity.ERROR,
                    f"the film would have {_counted(frames)} frames, more than the limit of {max_frames:,}",
                    scene.steps[-1].span,
                    notes=(f"{span} at {fraction_text(rate)} frames per time unit",),
                    helps=(
                        Advised.of(
                            "raise the limit with `{}`, or lower the rate with `{}`",
                            Choose.MAX_FRAMES.to(_counted(frames, "")),
                            Choose.FPS.to(),
                        ),
                    ),
                )
            ]
        )
    moments = _with_storing_times(_moments(scene), scene)
    lifetimes = _lifetimes(scene, moments)
    segments: list[Segment] = []
    lowered: dict[int, Constraint] = {}
    trains, cords = Trains(scene), _cords(scene)
    shares = _Shares()
    for number, moment in enumerate(moments):
        until = moments[number + 1].time if number + 1 < len(moments) else moment.time
        active = tuple(shares.placed(_with_lifetime(item, lifetimes, lowered), moment.time) for item in moment.active)
        active = cords(trains.placed(active, moment.time))
        segments.append(Segment(number, moment.step, moment.time, until, active, _visible(scene, moment.step)))
    return Timeline(
        scene,
        tuple(segments),
        rate,
        lifetimes,
        *(_claim_intervals(scene, segments, trains, aims=aims) for aims in (False, True)),
        stored_values=_earlier_values(segments),
    )


def _earlier_values(segments: Sequence[Segment]) -> tuple[StoredValue, ...]:
    """The values that statements keep; one that another one needs is before it."""
    sides = (side for segment in segments for item in segment.active for side in (*item.left, *item.right))
    return tuple(sorted(stored_values_in(*dict.fromkeys(sides)), key=lambda kept: kept.time))


def _with_storing_times(moments: list[_StepState], scene: Scene) -> list[_StepState]:
    """With one more moment wherever a value is kept that is between steps."""
    sides = (side for item in scene.constraints() for side in (*item.left, *item.right))
    for time in {kept.time for kept in stored_values_in(*sides)} - {moment.time for moment in moments}:
        before = next(k for k in reversed(range(len(moments))) if moments[k].time < time)
        moments.insert(before + 1, replace(moments[before], time=time))
    return moments


def _cords(scene: Scene) -> Callable[[tuple[Constraint, ...]], tuple[Constraint, ...]]:
    """Makes the constraints of a moment ones without cords."""
    if not any(map(cords_of, scene.constraints())):
        return lambda active: active
    from movimentum.timeline.cords import Cords  # few scripts have any

    return Cords(scene).placed


def _moments(scene: Scene) -> list[_StepState]:
    """One for each instant with a step: the last step there, and everything that holds then."""
    held: dict[tuple[str, Relation], list[Constraint]] = {}
    moments: list[_StepState] = []
    for step in scene.steps:
        if moments and step.time < moments[-1].time:
            raise _refusal("timeline/order", "the steps' times must not decrease")
        for item in step.statements:  # earlier statements under these keys have ended
            held.pop((item.key, item.relation), None)
        for item in step.statements:
            if isinstance(item, Constraint):
                held.setdefault((item.key, item.relation), []).append(item)
        active = sorted((item for items in held.values() for item in items), key=lambda item: item.number)
        moment = _StepState(step.number, step.time, tuple(active))
        if moments and moments[-1].time == step.time:
            moments[-1] = moment
        else:
            moments.append(moment)
    return moments


def _lifetimes(scene: Scene, moments: list[_StepState]) -> dict[int, Fraction]:
    """Constraint number -> how long it stays stated; 0 for one that a step at the same time replaces."""
    end = scene.steps[-1].time
    began = {item.number: scene.steps[item.step].time for item in scene.constraints()}
    ended = dict(began)
    alive: set[int] = set()
    for moment in moments:
        now = {item.number for item in moment.active}
        for number in alive - now:
            ended[number] = moment.time
        alive = now
    ended.update(dict.fromkeys(alive, end))
    return {number: ended[number] - start for number, start in began.items()}


def _claim_intervals(
    scene: Scene, segments: Sequence[Segment], trains: Trains, *, aims: bool
) -> tuple[TimedClaim, ...]:
    """How long each claim (or aim) holds: until a later step restates or ends its key, as with constraints."""
    end = scene.steps[-1].time
    over: dict[int, Fraction] = {}
    held: dict[Hashable, list[Claim]] = {}
    made: list[Claim] = []
    for step in scene.steps:
        items = step.aims if aims else step.claims
        for item in items:
            over.update((claim.number, step.time) for claim in held.pop(_key(item), ()))
        for item in items:
            if isinstance(item, Claim):
                made.append(item)
                held.setdefault(_key(item), []).append(item)
    result: list[TimedClaim] = []
    for claim in made:
        start, until = scene.steps[claim.step].time, over.get(claim.number, end)
        left, right = _lasting((claim.left, claim.right), {claim.number: until - start})
        left, right = _replaced((left, right), lambda node: _whole(node) if node.op == "progress" else None)
        active = next((s.active for s in segments if s.start >= start), ())
        left, right = (trains.read(side, active, start, aims=aims) for side in (left, right))
        lasting = replace(claim, left=left, right=right)
        result.append(TimedClaim(lasting, start, until, claim.number not in over))
    return tuple(result)


def _key(item: Claim | Ending) -> Hashable:
    """Under which it is restated or ended; `= _` also ends a goal to be largest."""
    extreme = item.relation in (Relation.LARGEST, Relation.SMALLEST)
    return item.key, Relation.EQUAL if extreme else item.relation, item.purpose


def _with_lifetime(constraint: Constraint, lifetimes: dict[int, Fraction], done: dict[int, Constraint]) -> Constraint:
    found = done.get(constraint.number)
    if found is None:
        found = done[constraint.number] = _substituted(constraint, lifetimes)
    return found


def _substituted(constraint: Constraint, lifetimes: dict[int, Fraction]) -> Constraint:
    left, right = _lasting((constraint.left, constraint.right), lifetimes)
    return constraint if left is constraint.left else replace(constraint, left=left, right=right)


def _lasting(sides: tuple[Sides, Sides], lifetimes: Mapping[int, Fraction]) -> tuple[Sides, Sides]:
    """Both sides with every ``lifetime`` leaf replaced by its constant; unchanged if there is none."""

    def constant(node: Expr) -> Expr | None:
        if node.op != "lifetime":
            return None
        number = node.payload
        assert isinstance(number, int)
        return ratio(lifetimes[number] or Fraction(1))

    return _replaced(sides, constant)


class _Shares:
    """Replaces ``progress`` leaves; a constraint has one form during its step and one from then on."""

    def __init__(self) -> None:
        self._ends: dict[int, tuple[Fraction | None, ...]] = {}
        self._done: dict[tuple[int, tuple[bool, ...]], Constraint] = {}

    def placed(self, constraint: Constraint, start: Fraction) -> Constraint:
        """``constraint`` in the segment that begins at ``start``."""
        ends = self._ends.get(constraint.number)
        if ends is None:
            lasting = (side for side in (*constraint.left, *constraint.right) if side.occurring & Occurring.LASTING)
            leaves = {node for node in walk(*lasting) if node.op == "progress"}
            ends = self._ends[constraint.number] = tuple({_step_of(node)[1] for node in leaves})
        if not ends:
            return constraint
        key = constraint.number, tuple(end is not None and start >= end for end in ends)
        if key not in self._done:
            self._done[key] = _with_progress(constraint, start)
        return self._done[key]


def _with_progress(constraint: Constraint, start: Fraction) -> Constraint:
    """``constraint`` in the segment that begins at ``start``: how far through its step it is, is a constant or linear
    in a clock. An integral remembers earlier segments, so what it integrates stays one function for all of them.
    """

    def value(node: Expr) -> Expr | None:
        if node.op == "integral":
            return substitute(node, lambda leaf: _whole(leaf) if leaf.op == "progress" else None)
        if node.op != "progress":
            return None
        begin, end = _step_of(node)
        if end is None:
            return ZERO
        return ONE if start >= end else _part(begin, end)

    left, right = _replaced((constraint.left, constraint.right), value)
    return constraint if left is constraint.left else replace(constraint, left=left, right=right)


def _whole(node: Expr) -> Expr:
    """A ``progress`` leaf as one function of time, from its step's time on."""
    begin, end = _step_of(node)
    if end is None:
        return ZERO
    return ONE if end <= begin else call("min", _part(begin, end), ONE)


def _part(begin: Fraction, end: Fraction) -> Expr:
    return div(clock(begin), ratio(end - begin))


def _step_of(node: Expr) -> tuple[Fraction, Fraction | None]:
    return cast(tuple[Fraction, Fraction | None], node.payload)


def _replaced(sides: tuple[Sides, Sides], value: Callable[[Expr], Expr | None]) -> tuple[Sides, Sides]:
    """Both sides with the leaves replaced for which there is a ``value``; unchanged if there is no such leaf."""
    if not any(part.occurring & Occurring.LASTING for part in (*sides[0], *sides[1])):
        return sides
    memo: dict[Expr, Expr] = {}
    left, right = (tuple(substitute(part, value, memo) for part in side) for side in sides)
    return left, right


def _visible(scene: Scene, step: int) -> frozenset[int]:
    there = (t.number for t in scene.things if t.kind.gathers or scene.mentioned.get(t.number, 0) <= step)
    return frozenset(there)


def _counted(number: int, separator: str = ",") -> str:
    return format(number, separator) if number < 10**15 else f"{float(number):.1e}"


def _refusal(code: str, message: str) -> ScriptError:
    return ScriptError([Diagnostic(code, Severity.ERROR, message)])
