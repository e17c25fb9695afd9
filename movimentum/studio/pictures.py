"""What a page draws of a script: its motion as films for the page's painter."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.cancellation import look
from movimentum.drawing.model import SymbolMark, TextMark
from movimentum.drawing.options import PictureOptions
from movimentum.records import replace
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.prepare import prepare_drawing
from movimentum.rendering.stream import concatenate
from movimentum.scene.model import Scene
from movimentum.vector.film import Film, make_film
from movimentum.vector.page import FilmData, film_data
from movimentum.workflow.frames import PoseChunks

if TYPE_CHECKING:
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses
    from movimentum.timeline.model import Timeline

MOST_EXACT = 100_000
"""Poses whose places are sent with all digits; of more, only what is drawn."""
SOON_FRAMES, SOON_TEXTS, MOST_POSES = 20_000, 1_000, 1_500_000
"""Frames of a film that are shown at once (where every frame has texts of its own, those take a millisecond each), and
poses (things times frames) that are shown at all: some 30 MB.
"""


def whole_film(motion: PathMotion, frames: int | None = None) -> tuple[dict[str, Any], Film]:
    """The film of a motion, as the page's painter takes it; of its first ``frames`` (None: `frames_shown`)."""
    timeline = motion.timeline
    shown = frames_shown(timeline) if frames is None else frames
    chunks: list[Poses] = []
    for some in PoseChunks(motion, range(shown), False, drawn=True):
        look()  # another text gives this up, wherever it is
        chunks.append(some)
    film = _film(timeline.scene, chunks, timeline.fps, PictureOptions(motion=motion))
    return _data(film), film


def moved_marks(film: Film, poses: Poses) -> dict[str, Any] | None:
    """What is drawn anew in every pose, springs and texts with numbers, in ``poses`` (F = 1): a film of one frame with
    these marks alone. None if there are none.
    """
    marks = tuple(item for item in film.prepared.things if _is_live(item))
    if not marks:
        return None
    prepared = replace(film.prepared, things=marks, traces=(), overlays=(), paths=(), beside=())
    there = make_film(film.scene, prepared, poses, film.title, film.fps, 0)
    # texts are measured from the pivots that the page knows
    pivots = {body: replace(motion, pivot=film.bodies[body].pivot) for body, motion in there.bodies.items()}
    there = replace(there, bodies=pivots)
    numbers = [number for number, item in enumerate(film.prepared.things) if _is_live(item)]
    return {**film_data(there), "live": _seen(there, numbers)}


def _is_live(item: PreparedMark) -> bool:
    return isinstance(item.mark, SymbolMark) or (isinstance(item.mark, TextMark) and bool(item.mark.pieces))


def _seen(film: Film, numbers: Sequence[int]) -> list[int]:
    """The numbers of those marks that a film's data have, in their order."""
    pairs = zip(numbers, film.prepared.things, strict=True)
    return [number for number, item in pairs if film.paint(item)[0].any()]


def frames_shown(timeline: Timeline) -> int:
    """How many frames of a film the page has in the end."""
    return min(timeline.frame_count, max(1, MOST_POSES // max(1, len(timeline.scene.things))))


def frames_soon(timeline: Timeline, time: Fraction) -> int:
    """How many frames of a film the page has at first, those up to ``time`` among them."""
    looked_at = int(max(Fraction(0), time - timeline.start) * timeline.fps) + 1
    soon = SOON_TEXTS if timeline.scene.shows_numbers else SOON_FRAMES
    return min(frames_shown(timeline), max(soon, looked_at))


def small_film(motion: PathMotion, frames: int) -> dict[str, Any]:
    """The film of a motion in at most so many frames; ``length``: how long it takes, in time units."""
    timeline = motion.timeline
    count = min(frames, timeline.frame_count)
    chosen = [round(k * (timeline.frame_count - 1) / max(1, count - 1)) for k in range(count)]
    chunks = tuple(PoseChunks(motion, tuple(timeline.frame_time(frame) for frame in chosen), False, drawn=True))
    film = film_data(_film(timeline.scene, chunks, timeline.fps, PictureOptions()))
    return {**film, "length": float(timeline.frame_count / timeline.fps)}


def some_pictures(timeline: Timeline, poses: Poses) -> dict[str, Any]:
    """Several poses as the frames of a film."""
    return _data(_film(timeline.scene, (poses,), timeline.fps, PictureOptions()))


def _film(scene: Scene, chunks: Sequence[Poses], fps: Fraction, options: PictureOptions) -> Film:
    look()
    prepared = prepare_drawing(scene, chunks, options)
    look()
    poses = concatenate(list(chunks))
    title = Path(scene.source.path).stem
    return make_film(scene, prepared, poses, title, fps, 0, everything=True)


def _data(film: Film) -> dict[str, Any]:
    found = FilmData(film)
    data = found.all()
    data["live"] = [number for number, item in enumerate(film.prepared.things) if found.seen(item)]
    data["numbers"] = list(film.bodies)
    data["pivots"] = [motion.pivot for motion in film.bodies.values()]
    data["exact"] = ""
    data["solved"] = film.poses.solved.astype(int).tolist()
    if film.poses.origin.size // 2 <= MOST_EXACT:
        places = np.concatenate([film.poses.origin, film.poses.direction], axis=2)  # (N, F, 4)
        data["exact"] = base64.b64encode(np.ascontiguousarray(places, dtype="<f8").tobytes()).decode("ascii")
    return data
