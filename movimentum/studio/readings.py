"""What a page reads off a motion: how fast anchors are, and the picture as an SVG."""

from __future__ import annotations

import base64
from fractions import Fraction

import numpy as np

from movimentum.errors import MovimentumError
from movimentum.expressions import symbol
from movimentum.scene.model import AnchorCoordinate
from movimentum.studio.answers import RatesTold, StillMade
from movimentum.studio.desk import Desk, TextJob, exact_time
from movimentum.studio.hands import Hands
from movimentum.studio.messages import RatesAsked, StillAsked
from movimentum.studio.pictures import frames_shown

MOST_RATES = 20_000
"""Velocities in one answer: some tenths of a second."""


def rates(desk: Desk, message: RatesAsked) -> None:
    """Answer with the velocities of all anchors in the frames asked for, not too many at a time."""
    from movimentum.solver.rates.rates import rates_at

    job = desk.known(message.rev)
    if job is None or not job.moved:
        return
    timeline = job.motion.timeline
    anchors = [(thing.number, n) for thing in timeline.scene.things for n in range(len(thing.anchors))]
    expressions = [symbol(AnchorCoordinate(thing, n, axis)) for thing, n in anchors for axis in (0, 1)]
    first = min(max(0, message.first), frames_shown(timeline) - 1)
    count = min(frames_shown(timeline) - first, max(1, MOST_RATES // max(1, len(expressions))))
    times = [timeline.frame_time(frame) for frame in range(first, first + count)]
    values = np.ascontiguousarray(rates_at(job.motion, expressions, 1, times).T, dtype="<f4")
    desk.send(RatesTold(message.rev, first, count, base64.b64encode(values.tobytes()).decode("ascii")))


def still(desk: Desk, hands: Hands, message: StillAsked) -> None:
    """Answer with the picture on show as an SVG; without a hand in it, it is what ``run -o x.svg --at`` writes."""
    job = desk.known(message.rev)
    if job is None or not job.moved:
        desk.send(StillMade(message.rev, "", "the motion is not known yet"))
        return
    try:
        desk.send(StillMade(message.rev, _svg(job, hands, exact_time(message.time))))
    except MovimentumError as error:
        desk.send(StillMade(message.rev, "", error.diagnostics[0].message))


def _svg(job: TextJob, hands: Hands, instant: Fraction) -> str:
    from movimentum.drawing.options import PictureOptions
    from movimentum.rendering.prepare import prepare_drawing
    from movimentum.vector.film import make_film
    from movimentum.vector.svg import svg_document
    from movimentum.workflow.frames import PoseChunks

    motion, timeline = job.motion, job.motion.timeline
    every = PoseChunks(motion, range(timeline.frame_count), skip=False, drawn=True)
    prepared = prepare_drawing(timeline.scene, every, PictureOptions(motion=motion, until=instant))
    (poses,) = PoseChunks(motion, (instant,), skip=False, drawn=True)
    poses = hands.shown(job, instant) or poses
    title = job.film.title if job.film is not None else ""
    return "".join(svg_document(make_film(timeline.scene, prepared, poses, title, timeline.fps, 0)))
