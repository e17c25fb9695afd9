"""The moving pictures of the start page: made one after the other while nobody does anything else."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

from movimentum.cancellation import Cancelled, cancellable
from movimentum.errors import MovimentumError
from movimentum.source import SourceText
from movimentum.studio.messages import ThumbnailMade
from movimentum.studio.security import outside_files
from movimentum.workflow.read import mentioned_files, read

MOST_FRAMES = 40
"""Frames of a thumbnail, spread over the film."""
MOST_THINGS = 2000
MOST_KEPT = 64

_made: dict[tuple[str, int], dict[str, Any]] = {}
"""Thumbnails by file and the time it was written, for the next page; the oldest are forgotten."""


class Thumbnails:
    """Films of scripts in lists (``lists``: "gallery" and "recent"), sent as they are made; short scripts first."""

    def __init__(self, lists: dict[str, tuple[Path, ...]], send: Callable[[Any], None]) -> None:
        self._lists, self._send = lists, send
        self._given_up = False
        Thread(target=self._work, name="studio-thumbnails", daemon=True).start()

    def stop(self) -> None:
        """Somebody begins to work: that goes first."""
        self._given_up = True

    def _work(self) -> None:
        places = [(source, number, path) for source, paths in self._lists.items() for number, path in enumerate(paths)]
        for source, number, path in sorted(places, key=lambda place: _size(place[2])):
            try:
                with cancellable(lambda: self._given_up):
                    film = thumbnail(path)
            except Cancelled:
                return
            except Exception:  # there is a name without a picture: opening it tells what is wrong
                continue
            if self._given_up:
                return
            if film is not None:
                self._send(ThumbnailMade(source, number, film, min(film["length"], 8.0)))
            time.sleep(0)


def thumbnail(path: Path) -> dict[str, Any] | None:
    """The film of a script in few frames, as the page's painter takes it; None if it has no motion to show."""
    from movimentum.studio.pictures import small_film
    from movimentum.workflow.engine import Engine

    key = (str(path), path.stat().st_mtime_ns)
    if key in _made:
        return _made[key]
    source = SourceText(str(path), read(str(path)).text)
    if outside_files(path.parent, mentioned_files(source)):
        return None
    try:
        revision = Engine().revise(source)
        if len(revision.scene.things) > MOST_THINGS:
            return None
        film = small_film(revision.motion, MOST_FRAMES)
    except MovimentumError:
        return None
    while len(_made) >= MOST_KEPT:
        _made.pop(next(iter(_made)), None)
    _made[key] = film
    return film


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0
