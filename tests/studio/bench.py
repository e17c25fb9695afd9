"""A studio's server without a browser and without a socket: what a page says is done, and what it is told is kept."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

from movimentum.source import SourceText
from movimentum.studio.answers import Grabbed, PlacesMoved
from movimentum.studio.desk import Desk, TextJob
from movimentum.studio.hands import Hands
from movimentum.studio.messages import HandMoved, PartGrabbed
from movimentum.studio.pictures import whole_film
from movimentum.workflow.engine import Engine


class Bench:
    """A desk without a thread's work in it: a text is known, and what is said is kept."""

    def __init__(self, text: str) -> None:
        self.said: list[Any] = []
        self.desk = Desk("x.mov", Path(), self.said.append)
        self.job = TextJob(1, Engine().revise(SourceText("x.mov", text)), Fraction(0), moved=True)
        self.job.film = whole_film(self.job.motion)[1]
        self.desk.shown = self.job
        self.hands = Hands(self.desk)

    def number(self, name: str) -> int:
        return next(thing.number for thing in self.job.motion.timeline.scene.things if thing.name == name)

    def drag(self, thing: str, anchor: str, to: tuple[float, float], moves: int = 60) -> PlacesMoved:
        self.hands.grab(PartGrabbed(1, 1, self.number(thing), anchor, to, 0.0))
        grabbed = self.said.pop()
        assert isinstance(grabbed, Grabbed)
        assert grabbed.state == "free", grabbed
        for move in range(moves):
            self.hands.move(HandMoved(1, move, to))
        found = self.said[-1]
        assert isinstance(found, PlacesMoved)
        return found
