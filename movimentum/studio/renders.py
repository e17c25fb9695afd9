"""Films that a page requests, of its script or of a recording: in a thread, with progress and cancel.

The start page's pictures are made here too, first stills and then films, one by one while nothing else runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.cancellation import Cancelled, cancellable
from movimentum.diagnostics import Severity
from movimentum.drawing.picture_options import PictureOptions
from movimentum.encoding import write
from movimentum.errors import MovimentumError, usage_error
from movimentum.records import dataclass, replace
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses
from movimentum.source import SourceText
from movimentum.studio.dragging import Dragging
from movimentum.studio.messages import (
    RecordingBegun,
    RecordingRequest,
    RenderAdvanced,
    RenderRequest,
    ShotTaken,
    ThumbnailMade,
)
from movimentum.studio.security import OutsideFolder, inside, outside_files
from movimentum.studio.worker import TextWork, Worker, exact_time
from movimentum.workflow.choices import Choices, Picture, Progress
from movimentum.workflow.read import mentioned_files, read

if TYPE_CHECKING:
    from movimentum.workflow.engine import Revision


FORMATS = tuple(suffix for suffix in write.FORMATS if suffix != ".jpeg")
"""The formats of films and stills."""
OFTEN_S = 0.1
"""How often progress is reported."""

Work = Callable[[Path, Progress], str]
"""Writes a file, and says how it was."""


class Rendering:
    """One rendering. It writes ``name`` below ``folder``, whole or not at all; ``work`` does it."""

    def __init__(self, job: int, name: str, folder: Path, work: Work, send: Callable[[Any], None]) -> None:
        self._job, self._name, self._folder, self._make, self._send = job, name, folder, work, send
        self._given_up = Event()
        self._last_sent = 0.0
        self._thread = Thread(target=self._work, name="studio-render", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Cancels the rendering."""
        self._given_up.set()

    def join(self, seconds: float) -> None:
        """Wait until it has ended."""
        self._thread.join(seconds)

    def _work(self) -> None:
        state, words = "done", ""
        try:
            target = inside(self._folder, self._name)
            if target.suffix.lower() not in FORMATS:
                raise OutsideFolder(f"a film ends in one of {', '.join(FORMATS)}")
            with cancellable(self._given_up.is_set):
                words = self._make(target, self._advanced)
        except Cancelled:
            state = "cancelled"
        except OutsideFolder as problem:
            state, words = "failed", str(problem)
        except MovimentumError as error:
            first = next((d for d in error.diagnostics if d.severity is Severity.ERROR), error.diagnostics[0])
            state, words = "failed", first.message
        except Exception as problem:
            state, words = "failed", f"a bug in Movimentum: {type(problem).__name__}: {problem}"
        self._say(state, 0, 0, words)

    def _advanced(self, done: int, total: int) -> None:
        if self._given_up.is_set():
            raise Cancelled
        now = time.monotonic()
        if now - self._last_sent >= OFTEN_S:
            self._last_sent = now
            self._say("running", done, total)

    def _say(self, state: str, done: int, total: int, words: str = "") -> None:
        self._send(RenderAdvanced(self._job, state, done, total, self._name, words))


def film_work(wanted: RenderRequest, path: str, choices: Choices) -> Work:
    """Renders a script, which is read as ``path``."""

    def work(target: Path, progress: Progress) -> str:
        from movimentum.workflow.animate import animate

        source = SourceText(path, wanted.text)
        if outside_files(Path(path).parent, mentioned_files(source)):
            raise OutsideFolder("the script uses a file that is not below its folder")
        at = None if wanted.at is None else Fraction(wanted.at).limit_denominator(10**6)
        outcome = animate(source, target, choices, Picture(scale=wanted.scale, at=at), progress)
        warned = sum(item.severity is Severity.WARNING for item in outcome.diagnostics)
        return f"{outcome.frames} frames{f', {warned} warnings' if warned else ''}."

    return work


def recording_work(wanted: RecordingRequest, shots: tuple[Shot, ...]) -> Work:
    """Renders what was recorded."""

    def work(target: Path, progress: Progress) -> str:
        return f"{write_recording(shots, wanted.at, target, Picture(scale=wanted.scale), progress)} frames."

    return work


# --- a film of what is done by hand: what a page has shown, moment after moment

MOST_SHOTS = 5000
MOST_POSES = 2_000_000
"""Things times shots: some 100 MB."""
LONGEST_PAUSE_MS = 1000.0
"""Where nothing happens for longer, the film goes on."""


@dataclass(frozen=True, slots=True)
class Shot:
    """The poses shown from ``at`` milliseconds on (F = 1)."""

    at: float
    job: TextWork
    poses: Poses


class Recorder:
    """One page's recording."""

    def __init__(self, worker: Worker, dragging: Dragging) -> None:
        self._worker, self._dragging = worker, dragging
        self._shots: list[Shot] = []
        self._on = False

    def begin(self, _: RecordingBegun) -> None:
        """Forget what was recorded, and record."""
        self._shots, self._on = [], True

    def shoot(self, message: ShotTaken) -> None:
        """Keep what is shown now."""
        job = self._worker.known(message.rev)
        if not self._on or job is None or not job.moved or len(self._shots) >= MOST_SHOTS:
            return
        if len(self._shots) * len(job.motion.timeline.scene.things) >= MOST_POSES:
            return
        from movimentum.analysis.shown_numbers import with_shown_numbers

        instant = exact_time(message.time)
        poses = self._dragging.shown(job, instant) if message.held else None
        if poses is None:
            poses = with_shown_numbers(job.motion, job.motion.poses_at([instant]), [instant])
        self._shots.append(Shot(message.at, job, poses))

    def end(self) -> tuple[Shot, ...]:
        """The recording."""
        self._on = False
        shots, self._shots = tuple(self._shots), []
        return shots


def write_recording(
    shots: Sequence[Shot], until: float, target: Path, picture: Picture, progress: Callable[[int, int], None]
) -> int:
    """Write a recording that ends at ``until`` milliseconds; returns the number of frames. `UsageError` if nothing was
    recorded, else as `run`.
    """
    from movimentum.rendering.stream import concatenate
    from movimentum.workflow.ways import way_to

    if not shots:
        raise usage_error("output/no-frames", "nothing was recorded", "drag something, or play, while it records")
    write.check_output(target)
    job = shots[-1].job
    timeline = job.motion.timeline
    scene, fps = timeline.scene, timeline.fps
    made = [_in_scene(shot, scene, shots[-1].poses) for shot in shots]
    numbers = shown_when([shot.at for shot in shots], until, fps)
    poses = concatenate([made[number] for number in numbers])
    frames = np.arange(len(numbers), dtype=np.int64)
    poses = replace(poses, frames=frames, times=frames / float(fps))
    draw = way_to(write.format_of(target), scene, (poses,), PictureOptions(scale=picture.scale or 1.0))
    return draw((poses,), target, fps, picture, progress).frames


def shown_when(begins: Sequence[float], until: float, fps: Fraction) -> list[int]:
    """Which shot each frame shows, with long pauses cut short; ``begins`` in milliseconds."""
    ends = [*begins[1:], max(until, begins[-1])]
    lengths = [min(max(0.0, b - a), LONGEST_PAUSE_MS) for a, b in zip(begins, ends, strict=True)]
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(1, int(float(starts[-1]) / 1000.0 * float(fps)))
    moments = (np.arange(count) + 0.5) * 1000.0 / float(fps)
    return [min(int(place), len(begins) - 1) for place in np.searchsorted(starts, moments, side="right") - 1]


def _in_scene(shot: Shot, scene: Scene, last: Poses) -> Poses:
    """A shot's poses as those of another scene's things: by their names."""
    own = shot.job.motion.timeline.scene
    if own is scene:
        return shot.poses
    number_of = {thing.name: thing.number for thing in own.things}
    numbers = [number_of.get(thing.name) for thing in scene.things]
    there = np.array([number is not None for number in numbers], dtype=bool)
    taken = np.array([0 if number is None else number for number in numbers], dtype=np.intp)

    def either(before: np.ndarray, after: np.ndarray) -> np.ndarray:
        if not len(before):
            return after
        return np.where(there.reshape(-1, *[1] * (after.ndim - 1)), before[taken], after)

    found = shot.poses
    properties = {
        (thing, name): found.properties.get((int(taken[thing]), name), value) if there[thing] else value
        for (thing, name), value in last.properties.items()
    }
    return replace(
        last,
        origin=either(found.origin, last.origin),
        direction=either(found.direction, last.direction),
        angle=either(found.angle, last.angle),
        visible=either(found.visible, last.visible) & there[:, None],
        properties=properties,
        variables={name: found.variables.get(name, value) for name, value in last.variables.items()},
    )


MOST_FRAMES = 40
"""Frames of a thumbnail, spread over the film."""
MOST_THINGS = 2000
MOST_KEPT = 64

_made: dict[tuple[str, int], dict[str, Any]] = {}
"""Thumbnails by file and the time it was written, for the next page; the oldest are forgotten."""


class Thumbnails:
    """Pictures of scripts in lists (``lists``: "gallery" and "recent"), sent as they are made: first all as stills,
    from the top of the page down; then those that move, short scripts first.
    """

    def __init__(self, lists: dict[str, tuple[Path, ...]], send: Callable[[Any], None]) -> None:
        self._lists, self._send = lists, send
        self._given_up = False
        Thread(target=self._work, name="studio-thumbnails", daemon=True).start()

    def stop(self) -> None:
        """Somebody begins to work: that goes first."""
        self._given_up = True

    def _work(self) -> None:
        places = [(source, number, path) for source, paths in self._lists.items() for number, path in enumerate(paths)]
        down = sorted(places, key=lambda place: (place[0] == "gallery", place[1]))
        for make, those in ((still, down), (thumbnail, sorted(places, key=lambda place: _size(place[2])))):
            for source, number, path in those:
                try:
                    with cancellable(lambda: self._given_up):
                        film = make(path)
                except Cancelled:
                    return
                except Exception:  # there is a name without a picture: opening it tells what is wrong
                    continue
                if self._given_up:
                    return
                if film is not None:
                    self._send(ThumbnailMade(source, number, film, min(film["length"], 8.0)))
                time.sleep(0)


def still(path: Path) -> dict[str, Any] | None:
    """The beginning of a script, as a film of one frame; None where that has to be found with the whole motion, or is
    known with it.
    """
    from movimentum.studio.descriptions import some_pictures

    revision = None if _key(path) in _made else _revision(path)
    poses = None if revision is None else revision.preview(revision.timeline.start)
    return None if revision is None or poses is None else {**some_pictures(revision.timeline, poses), "length": 0.0}


def thumbnail(path: Path) -> dict[str, Any] | None:
    """The film of a script in few frames, as the page's painter takes it; None if it has no motion to show."""
    from movimentum.studio.descriptions import small_film

    key = _key(path)
    if key in _made:
        return _made[key]
    try:
        revision = _revision(path)
        film = None if revision is None else small_film(revision.motion, MOST_FRAMES)
    except MovimentumError:
        return None
    if film is None:
        return None
    while len(_made) >= MOST_KEPT:
        _made.pop(next(iter(_made)), None)
    _made[key] = film
    return film


def _key(path: Path) -> tuple[str, int]:
    return str(path), path.stat().st_mtime_ns


def _revision(path: Path) -> Revision | None:
    """A script that may be shown; None for one that is too large, or reads files elsewhere."""
    from movimentum.workflow.engine import Engine

    source = SourceText(str(path), read(str(path)).text)
    if outside_files(path.parent, mentioned_files(source)):
        return None
    revision = Engine().revise(source)
    return None if len(revision.scene.things) > MOST_THINGS else revision


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0
