"""Vectors that show an acceleration where there is none: what follows a wish has a velocity and no more."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import symbol
from movimentum.scene.model import AnchorCoordinate
from movimentum.solver.motion import PathMotion
from movimentum.things.kinds.vector import VectorScale


def undefined_arrows(motion: PathMotion) -> Iterator[Diagnostic]:
    """A warning for each vector that is not drawn in some step because a wish draws what it is about."""
    things = motion.timeline.scene.things
    vectors = [thing for thing in things if isinstance(thing.own, VectorScale) and thing.own.acceleration is not None]
    if not vectors:
        return
    from movimentum.solver.rates.rates import UndefinedRate, rates_at  # only vectors need it

    timeline = motion.timeline
    times = [(segment.start + segment.end) / 2 for segment in timeline.segments]
    for thing in vectors:
        (ref,) = thing.through
        coordinates = [symbol(AnchorCoordinate(ref.thing, ref.anchor, axis)) for axis in (0, 1)]
        try:
            rates_at(motion, coordinates, 2, [time for time in times if timeline.start <= time <= timeline.end])
        except UndefinedRate as error:
            what = "it" if error.thing is None else f"`{things[error.thing].name}`"
            yield Diagnostic(
                "vector/undefined",
                Severity.WARNING,
                f"`{thing.name}` shows no acceleration: {what} follows a wish, which has a velocity and no more",
                thing.span,
            ).advised("show its `.velocity(…)`, or state an equation in place of the wish")
