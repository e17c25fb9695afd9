"""What a page asks about a motion: why something is where it is, its formula, its other solutions, values, velocities,
and the picture as an SVG.
"""

from __future__ import annotations

import base64
import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.errors import MovimentumError
from movimentum.expressions import symbol
from movimentum.scene.model import AnchorCoordinate
from movimentum.studio.descriptions import why
from movimentum.studio.dragging import Dragging
from movimentum.studio.messages import (
    Answered,
    NameAsked,
    PlotAsked,
    Plotted,
    RatesAsked,
    RatesSent,
    StillAsked,
    StillMade,
)
from movimentum.studio.pictures import frames_shown, some_pictures
from movimentum.studio.worker import TextWork, Worker, exact_time
from movimentum.workflow.inspector import Inspector

if TYPE_CHECKING:
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses

MOST_PLOTTED = 2000
"""Frames that a plot has."""
MOST_SHOWN = 24
"""Solutions that are shown as pictures."""
MOST_RATES = 20_000
"""Velocities in one answer: some tenths of a second."""
PATIENCE_S = 1.4
"""The time for finding a formula: the user waits two seconds in all."""


def answer(worker: Worker, message: NameAsked) -> None:
    """Answer a question of a page."""
    job = worker.known(message.rev)
    words, choices, film = "the motion is not known yet", list[dict[str, Any]](), None
    if job is not None and job.moved:
        inspector = Inspector(job.revision, exact_time(message.time))
        try:
            match message.question:
                case "why":
                    words = why(inspector, message.name)
                case "formula":
                    words = _formula(inspector, message.name)
                case "solutions":
                    words, choices, film = _solutions(inspector)
                case _:
                    words = "there is no answer"
        except MovimentumError as error:
            words = error.diagnostics[0].message
    worker.send(Answered(message.rev, message.question, message.name, words, choices, film))


def _formula(inspector: Inspector, name: str) -> str:
    from movimentum.analysis.interactive.formula import UNREASONABLE, Obstacle

    formulas = inspector.formulas(name, PATIENCE_S)
    from movimentum.analysis.interactive.spelling import spelled

    lines: list[str] = []
    for label, found in formulas:
        if not isinstance(found, Obstacle):
            written = spelled(found)
            lines.append(f"{label} = {written}" if written else f"{label} has a formula that no statement can have")
        elif found.words == UNREASONABLE:
            lines.append(f"{label} has {found.words}")
        else:
            lines.append(f"{label} has no closed form: {found.words}")
    since = float(inspector.segment_motion.segment.start)
    begun = f" .t counts from {since:g}, where this step begins." if since else ""
    return "\n".join([*lines, f"Angles are in degrees, as in the script.{begun}"])


def _solutions(inspector: Inspector) -> tuple[str, list[dict[str, Any]], dict[str, Any] | None]:
    """Every solution, with its picture and what selects it."""
    parts = [part for part in inspector.solutions() if len(part.solutions) > 1]
    found = [solution for part in parts for solution in part.solutions][:MOST_SHOWN]
    if not found:
        return "there is one solution only at this moment", [], None
    film = some_pictures(inspector.work.timeline, inspector.poses_of([solution.pose for solution in found]))
    choices: list[dict[str, Any]] = [
        {"statement": solution.selects or "", "words": solution.words, "current": solution.current, "frame": frame}
        for frame, solution in enumerate(found)
    ]
    more = "" if all(part.complete for part in parts) else "; found by a search, there may be more"
    return f"{len(found)} solutions at this moment{more}", choices, film


# --- over the whole film ----------------------------------------------------------------------------------


def plot(worker: Worker, message: PlotAsked) -> None:
    """The values of an expression over the film."""
    job = worker.known(message.rev)
    if job is None or not job.moved:
        return
    try:
        query = Inspector(job.revision, job.motion.timeline.start).query(message.expression)
        poses = _spread(job.motion)
        values = query.values(poses)
    except MovimentumError as error:
        worker.send(Plotted(message.rev, message.expression, [], error.diagnostics[0].message))
        return
    values[~poses.solved] = np.nan
    rows = [[value if math.isfinite(value) else None for value in row] for row in values.tolist()]
    worker.send(Plotted(message.rev, message.expression, rows))


def _spread(motion: PathMotion) -> Poses:
    """The poses of every frame; of a long film, of some that are spread over it."""
    timeline = motion.timeline
    last = frames_shown(timeline) - 1
    if last < MOST_PLOTTED:
        return motion.poses(0, last + 1)
    chosen = [round(k * last / (MOST_PLOTTED - 1)) for k in range(MOST_PLOTTED)]
    return motion.poses_at([timeline.frame_time(frame) for frame in chosen])


def rates(worker: Worker, message: RatesAsked) -> None:
    """Answer with the velocities of all anchors in the frames asked for, not too many at a time."""
    from movimentum.solver.rates.rates import rates_at

    job = worker.known(message.rev)
    if job is None or not job.moved:
        return
    timeline = job.motion.timeline
    anchors = [(thing.number, n) for thing in timeline.scene.things for n in range(len(thing.anchors))]
    expressions = [symbol(AnchorCoordinate(thing, n, axis)) for thing, n in anchors for axis in (0, 1)]
    first = min(max(0, message.first), frames_shown(timeline) - 1)
    count = min(frames_shown(timeline) - first, max(1, MOST_RATES // max(1, len(expressions))))
    times = [timeline.frame_time(frame) for frame in range(first, first + count)]
    values = np.ascontiguousarray(rates_at(job.motion, expressions, 1, times).T, dtype="<f4")
    worker.send(RatesSent(message.rev, first, count, base64.b64encode(values.tobytes()).decode("ascii")))


# --- the picture ------------------------------------------------------------------------------------------


def still(worker: Worker, dragging: Dragging, message: StillAsked) -> None:
    """Answer with the picture on show as an SVG; without a hand in it, it is what ``run -o x.svg --at`` writes."""
    job = worker.known(message.rev)
    if job is None or not job.moved:
        worker.send(StillMade(message.rev, "", "the motion is not known yet"))
        return
    try:
        worker.send(StillMade(message.rev, _svg(job, dragging, exact_time(message.time))))
    except MovimentumError as error:
        worker.send(StillMade(message.rev, "", error.diagnostics[0].message))


def _svg(job: TextWork, dragging: Dragging, instant: Fraction) -> str:
    from movimentum.drawing.options import PictureOptions
    from movimentum.rendering.prepare import prepare_drawing
    from movimentum.vector.film import make_film
    from movimentum.vector.svg import svg_document
    from movimentum.workflow.frames import PoseChunks

    motion, timeline = job.motion, job.motion.timeline
    every = PoseChunks(motion, range(timeline.frame_count), skip=False, drawn=True)
    prepared = prepare_drawing(timeline.scene, every, PictureOptions(motion=motion, until=instant))
    (poses,) = PoseChunks(motion, (instant,), skip=False, drawn=True)
    poses = dragging.shown(job, instant) or poses
    title = job.film.title if job.film is not None else ""
    return "".join(svg_document(make_film(timeline.scene, prepared, poses, title, timeline.fps, 0)))
