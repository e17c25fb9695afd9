"""`run`: a film or pictures."""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import NoSolutionError, ScriptError, usage_error
from movimentum.records import dataclass, replace
from movimentum.settings import FailurePolicy
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices, Outcome, Picture, Progress
from movimentum.workflow.frames import PoseChunks, chosen_frames
from movimentum.workflow.read import reads
from movimentum.workflow.stages import Solution, afterwards, arranged, judged, solved, understand
from movimentum.workflow.ways import way_to

if TYPE_CHECKING:
    from movimentum.drawing.picture_options import FreeMark, PictureOptions
    from movimentum.encoding.runs import Elsewhere
    from movimentum.encoding.write import WriteReport
    from movimentum.rendering.stream import PoseSource
    from movimentum.scene.model import Scene
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses
    from movimentum.solver.solver_cache import SolverCache
    from movimentum.timeline.model import Timeline


def animate(
    source: SourceText,
    target: Path,
    choices: Choices,
    picture: Picture,
    progress: Progress,
    solution: Solution | None = None,
    known: SolverCache | None = None,
    elsewhere: Elsewhere | None = None,
    most: int | None = None,
) -> Outcome:
    """Render the script to ``target``, whose suffix names the format; a picture without ``%d`` is the first frame.

    ``solution``: where it has been solved with these ``choices`` already; ``known``: what was solved before;
    ``elsewhere``: who draws, other than this machine; ``most``: bytes of the file, of which no more are written
    (`TooHeavy`).
    """
    from movimentum.drawing.picture_options import Show
    from movimentum.encoding.gif_notes import AREA, FIRST, HEAVY, RASTER, only_first
    from movimentum.encoding.write import check_output, format_of
    from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file
    from movimentum.rendering.off_canvas import OUTSIDE

    kind, found = check_output(target, transparent=picture.transparent), format_of(target)
    background = None if picture.background is None else ground_color(picture.background)
    refuse_unwritable(target)
    timeline = solution.motion.timeline if solution else _arranged(source, choices, picture)
    scene, numbers = timeline.scene, range(timeline.frame_count + 1 if kind == "sequence" else 0)
    refuse_overwriting(target, reads(source, scene), numbers)
    options, frames = options_of(scene, picture, background), _frames(timeline, picture)
    drawn = frames[:1] if found.still and kind != "sequence" else frames
    shown, asked = (drawn, frames if picture.frames else drawn) if picture.at is None else ((picture.at,), drawn)
    if found.write is None:
        from movimentum.vector.write import refuse_too_long

        refuse_too_long(scene, len(shown), target)
    ready = way_to(found, scene, (), options, elsewhere) if _is_ready(scene, options) else None  # limits come first
    solution = solution or solved(timeline, choices, known)
    motion, skip = solution.motion, choices.on_failure is FailurePolicy.SKIP
    poses: PoseSource = PoseChunks(motion, shown, skip, drawn=True).in_memory()
    until = timeline.frame_time(drawn[-1]) if picture.at is None else picture.at
    options = replace(options, motion=motion.path, until=until)
    if Show.FREE in options.show:
        times = [picture.at] if picture.at is not None else [timeline.frame_time(frame) for frame in frames]
        options = replace(options, free=_free_marks(motion.path, times))
    if not any(len(chunk.frames) for chunk in poses):
        message = "none of the requested frames has a solution"
        raise NoSolutionError([*solution.diagnostics, Diagnostic("solve/unreachable", Severity.ERROR, message)])
    every = PoseChunks(motion, range(timeline.frame_count), skip, drawn=True)
    scene, poses, every, options = _on_backdrop(scene, poses, every, options)
    write = ready or way_to(found, scene, every, options, elsewhere)
    with ExitStack() as stack:
        # With --strict, a warning during writing must not leave a file: so it is written beside its place.
        doubtful = (choices.strict or most is not None) and kind != "sequence"
        place = stack.enter_context(whole_file(target)) if doubtful else target
        written = write(_repeated(poses, picture.repeats), place, timeline.fps, picture, progress)
        said, notes = afterwards(solution, choices)
        diagnostics = _accepted((*said, *only_first(asked, drawn, target)), written, place, target, choices, most)
    film_notes = tuple(item for item in diagnostics if item.code in (OUTSIDE, HEAVY, AREA, RASTER, FIRST))
    return Outcome(written.frames, solution.fault, diagnostics, (*notes, *film_notes), written.size)


def _accepted(
    said: tuple[Diagnostic, ...], written: WriteReport, place: Path, target: Path, choices: Choices, most: int | None
) -> tuple[Diagnostic, ...]:
    """All that is to be said of the file in ``place``, unless it is not to become ``target``."""
    diagnostics, warned = judged((*said, *(_about(item, place, target) for item in written.diagnostics)), choices)
    if warned:
        raise ScriptError(diagnostics)
    if most is not None and place.is_file() and (size := place.stat().st_size) > most:
        raise TooHeavy(size)
    return diagnostics


class TooHeavy(Exception):
    """A file has become so many bytes, which is too much; it is not left there."""

    def __init__(self, size: int) -> None:
        super().__init__(size)
        self.size = size


@dataclass(frozen=True, slots=True)
class _Again:
    """Poses several times, one after the other."""

    poses: PoseSource
    times: int

    def __iter__(self) -> Iterator[Poses]:
        from movimentum.rendering.stream import chunks

        for _ in range(self.times):
            yield from chunks(self.poses)


def _repeated(poses: PoseSource, times: int) -> PoseSource:
    return poses if times == 1 else _Again(poses, times)


def _about(item: Diagnostic, place: Path, target: Path) -> Diagnostic:
    """A message that names the file as it will be called."""
    if place == target:
        return item
    before, after = place.stem, target.stem
    return replace(
        item,
        message=item.message.replace(before, after),
        helps=tuple(advice.replace(before, after) for advice in item.helps),
    )


def natural_size(solution: Solution, picture: Picture) -> tuple[float, float]:
    """The width and height of the picture at scale 1."""
    from movimentum.rendering.prepare import prepare_drawing

    motion, scene = solution.motion, solution.motion.timeline.scene
    if scene.config.size is not None:
        return float(scene.config.size[0]), float(scene.config.size[1])
    every = PoseChunks(motion, range(motion.timeline.frame_count), False, drawn=True)
    options = options_of(scene, replace(picture, scale=1.0, max_pixels=sys.maxsize), None)
    view = prepare_drawing(scene, every, replace(options, motion=motion.path)).view
    return float(view.width), float(view.height)


def _is_ready(scene: Scene, options: PictureOptions) -> bool:
    """Whether a picture needs no other poses than its own."""
    from movimentum.drawing.picture_options import Show
    from movimentum.rendering.prepare import needs_film

    alone = not (options.traces or needs_film(scene))
    return scene.config.size is not None and alone and not options.show & {Show.FREE, Show.GRID, Show.AXES}


def _on_backdrop(
    scene: Scene, poses: PoseSource, every: PoseSource, options: PictureOptions
) -> tuple[Scene, PoseSource, PoseSource, PictureOptions]:
    """The same with the grid and the axes that are asked for; the canvas does not become larger for them."""
    from movimentum.drawing.picture_options import Show

    if not options.show & {Show.GRID, Show.AXES}:
        return scene, poses, every, options
    from movimentum.drawing.backdrop import with_backdrop
    from movimentum.rendering.prepare import prepare_drawing
    from movimentum.rendering.stream import StillPoses

    view = prepare_drawing(scene, every, replace(options, scale=1.0, canvas=None)).view
    room = (view.left, view.bottom, view.left + view.width, view.bottom + view.height)
    whole = with_backdrop(scene, options.show, room)
    more = len(whole.things) - len(scene.things)
    return whole, StillPoses(poses, more), StillPoses(every, more), replace(options, room=room)


def _arranged(source: SourceText, choices: Choices, picture: Picture) -> Timeline:
    return arranged(understand(source, choices, picture.max_pixels), choices)


def options_of(scene: Scene, picture: Picture, background: tuple[int, int, int] | None) -> PictureOptions:
    """The display list of a scene, with the user's choices."""
    from movimentum.drawing.picture_options import PictureOptions, Quality, Show, trace_anchors

    return PictureOptions(
        quality=Quality(picture.quality),
        scale=1.0 if picture.scale is None else picture.scale,
        background=background,
        transparent=picture.transparent,
        traces=trace_anchors(scene, picture.traces),
        show=frozenset(Show(word) for word in picture.show),
        max_pixels=picture.max_pixels,
        canvas=picture.canvas,
    )


def _frames(timeline: Timeline, picture: Picture) -> range:
    """The frames asked for; for a still at an instant, those from that instant on. `UsageError` if there is none."""
    start, stop = chosen_frames(timeline, picture.frames)
    if picture.at is None:
        return range(start, stop)
    if not timeline.start <= picture.at <= timeline.end:
        message = f"time {picture.at} is outside the film, from {timeline.start} to {timeline.end}"
        raise usage_error("usage/at", message, Choose.AT.to(0))
    return range(math.ceil((picture.at - timeline.start) * timeline.fps), stop)


FREE_MOMENTS = 24
"""Moments of a film at which its free motions are found again; in between, arrows turn with their things."""


def _free_marks(motion: PathMotion, times: Sequence[Fraction]) -> tuple[FreeMark, ...]:
    """Arrows for all free motions at ``times`` (ascending): one for each moving anchor, numbered by motion."""
    from movimentum.analysis.freedom.motions import free_motions_at
    from movimentum.drawing.picture_options import FreeMark

    if len(times) > FREE_MOMENTS:
        times = [times[round(k * (len(times) - 1) / (FREE_MOMENTS - 1))] for k in range(FREE_MOMENTS)]
    edges = [-math.inf, *(float((a + b) / 2) for a, b in itertools.pairwise(times)), math.inf]
    things = motion.timeline.scene.things
    marks: list[FreeMark] = []
    for time, (begin, end) in zip(times, itertools.pairwise(edges), strict=True):
        poses = motion.poses_at([time])
        for number, found in enumerate(free_motions_at(motion, time)):
            for ref, (vx, vy) in found.velocities:
                c, s = poses.direction[ref.thing, 0].tolist()
                local = things[ref.thing].anchors[ref.anchor].local
                marks.append(FreeMark(ref.thing, local, (c * vx + s * vy, c * vy - s * vx), number, begin, end))
    return tuple(marks)


def ground_color(text: str) -> tuple[int, int, int]:
    """A colour as a user spells it; `UsageError` for one that there is not."""
    from movimentum.things.colors import color, color_names

    found = color(text)
    if found is None:
        from difflib import get_close_matches

        near = get_close_matches(text.lower(), color_names(), 3) or ["white", "'#ffcc00'"]
        raise usage_error("usage/color", f"there is no colour `{text}`", *(Choose.BACKGROUND.to(name) for name in near))
    return found
