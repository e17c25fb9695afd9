"""Reports contacts held at one place while the outlines overlap at another."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import permutations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import sub, symbols
from movimentum.outlines.contour import Contour
from movimentum.query import reader
from movimentum.scene.model import AnchorCoordinate, Constraint, Scene, ThingAngle
from movimentum.scene.outlines import Circle, outline_of
from movimentum.solver.motion import PathMotion
from movimentum.text import time_text
from movimentum.tolerances import OVERLAP_REPORTED

INSTANTS = 400
"""Of a step that are looked at."""


def overlapping_contacts(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for each equation about a gap while whose outlines are nearer at another place than at the one that is
    followed: with the time, and, if a roller is larger than a hollow, the radius that would do.
    """
    scene, reported = motion.timeline.scene, set[int]()
    for segment_motion in motion.segments:
        segment = segment_motion.segment
        for item in segment.active:
            if not item.touches or item.number in reported or not item.gap_side:
                continue
            end = min(segment.end, motion.timeline.end)
            steps = INSTANTS if end > segment.start else 0
            times = [segment.start + (end - segment.start) * Fraction(k, max(1, steps)) for k in range(steps + 1)]
            poses = motion.poses_at(times)
            (read,) = reader(scene, [sub(item.left[0], item.right[0])], motion)(poses)
            off: FloatArray = np.where(poses.solved, item.gap_side * read, np.nan)
            below: list[int] = np.nonzero(off < -OVERLAP_REPORTED * motion.segments[0].plan.size)[0].tolist()
            if below:
                reported.add(item.number)
                worst = int(np.argmin(np.where(np.isnan(off), np.inf, off)))
                when = f"from t = {time_text(float(times[below[0]]))} on"
                deep = f", by up to {-float(off[worst]):.3g} px at t = {time_text(float(times[worst]))}"
                yield _undercut(scene, item, f"they overlap {when}{deep}") or _second(item, f"{when}{deep}")
            elif segment_motion.failures:
                begin = time_text(float(min(failure.begin for failure in segment_motion.failures) + segment.start))
                if (
                    undercut := _undercut(scene, item, f"it cannot go through one at t = {begin}", corners=True)
                ) is not None:
                    reported.add(item.number)
                    yield undercut


def _undercut(scene: Scene, item: Constraint, what: str, *, corners: bool = False) -> Diagnostic | None:
    """A warning if one of a pair is round, and larger than a hollow of the other (a corner, if ``corners`` count)."""
    leaves = symbols(*item.left, *item.right)
    numbers = dict.fromkeys(leaf.thing for leaf in leaves if isinstance(leaf, AnchorCoordinate | ThingAngle))
    for one, other in permutations((scene.things[number] for number in numbers), 2):
        roller, curve = outline_of(one), outline_of(other)
        if (
            isinstance(roller, Circle)
            and isinstance(curve, Contour)
            and (least := hollow(curve, corners=corners)) < roller.radius
        ):
            message = (
                f"`{one.name}`, of radius {roller.radius:g}, is too large for the hollows of `{other.name}`: {what}"
            )
            diagnostic = Diagnostic("contact/undercut", Severity.WARNING, message, item.span)
            if least == 0.0:
                point = f"`.on({one.name}.{one.anchors[0].name}, {other.name}) = 0`"
                rounded = f"round it with {roller.radius:g} or more"
                return diagnostic.advised(f"no roller goes into a sharp corner: {rounded}, or let a point go: {point}")
            return diagnostic.advised(f"a radius of {least:.4g} or less would do, or less deep hollows")
    return None


def _second(item: Constraint, when: str) -> Diagnostic:
    message = f"these touch where they are followed, and overlap at another place {when}"
    diagnostic = Diagnostic("contact/second", Severity.WARNING, message, item.span)
    return diagnostic.advised("draw them nearer to that place, if it is the one that is meant")


def hollow(curve: Contour, *, corners: bool = False) -> float:
    """The least radius of the places where an outline is hollow (0 at a corner, if ``corners`` count); infinite if
    there are none.
    """
    breaks = np.array(curve.breaks)
    places = np.concatenate([np.linspace(curve.first, curve.last, 4001), (breaks[1:] + breaks[:-1]) / 2.0])
    _, _, tx, ty, dx, dy, rx, ry = curve.values(places)
    if corners and (curve.side * (tx * ry - ty * rx)[(dx == 0.0) & (dy == 0.0)] > 0.0).any():
        return 0.0
    with np.errstate(all="ignore"):
        bend = curve.side * (tx * ry - ty * rx) / (tx * tx + ty * ty) / np.hypot(dx, dy)
    bend = bend[np.isfinite(bend)]
    most = float(bend.max()) if len(bend) else 0.0
    return 1.0 / most if most > 0.0 else np.inf
