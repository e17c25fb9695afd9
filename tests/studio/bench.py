"""A studio's server without a browser and without a socket: what a page says is done, and what it is told is kept."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

from movimentum.source import SourceText
from movimentum.studio.descriptions import whole_film
from movimentum.studio.dragging import Dragging
from movimentum.studio.messages import Grabbed, HandMoved, PartGrabbed, PlacesMoved
from movimentum.studio.worker import TextWork, Worker
from movimentum.workflow.engine import Engine


class Bench:
    """A worker without a thread's work in it: a text is known, and what is said is kept."""

    def __init__(self, text: str) -> None:
        self.said: list[Any] = []
        self.worker = Worker("x.mov", Path(), self.said.append)
        self.job = TextWork(1, Engine().revise(SourceText("x.mov", text)), Fraction(0), moved=True)
        self.job.film = whole_film(self.job.motion)[1]
        self.worker.shown = self.job
        self.dragging = Dragging(self.worker)

    def number(self, name: str) -> int:
        return next(thing.number for thing in self.job.motion.timeline.scene.things if thing.name == name)

    def drag(self, thing: str, anchor: str, to: tuple[float, float], moves: int = 60) -> PlacesMoved:
        self.dragging.grab(PartGrabbed(1, 1, self.number(thing), anchor, to, 0.0))
        grabbed = self.said.pop()
        assert isinstance(grabbed, Grabbed)
        assert grabbed.state == "free", grabbed
        for move in range(moves):
            self.dragging.move(HandMoved(1, move, to))
        found = self.said[-1]
        assert isinstance(found, PlacesMoved)
        return found
