"""The pictures of the start page, first still and then moving, made one by one while nobody does anything else."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from movimentum.cancellation import Cancelled, cancellable
from movimentum.errors import MovimentumError
from movimentum.source import SourceText
from movimentum.studio.messages import ThumbnailMade
from movimentum.studio.security import outside_files
from movimentum.workflow.read import mentioned_files, read

if TYPE_CHECKING:
    from movimentum.workflow.engine import Revision

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
    from movimentum.studio.pictures import some_pictures

    revision = None if _key(path) in _made else _revision(path)
    poses = None if revision is None else revision.glimpse(revision.timeline.start)
    return None if revision is None or poses is None else {**some_pictures(revision.timeline, poses), "length": 0.0}


def thumbnail(path: Path) -> dict[str, Any] | None:
    """The film of a script in few frames, as the page's painter takes it; None if it has no motion to show."""
    from movimentum.studio.pictures import small_film

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
