"""A living figure as one HTML file: the player, the display list with places for numbers, and what computes them."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from importlib.resources import files
from typing import Any

from movimentum.drawing.style import MIDDLE, SLANT, UNITS
from movimentum.equations.program import KeptConstant
from movimentum.living.data import LiveData, glyphs
from movimentum.living.program import LiveStage, javascript, picture_stage
from movimentum.living.scene import LiveScene
from movimentum.records import dataclass
from movimentum.tolerances import DISCRIMINANT_ZERO, FRAME_SOLVED
from movimentum.vector.film import Film
from movimentum.vector.page import document, shipped


@dataclass(frozen=True, slots=True)
class Slider:
    """A constant: its ``name`` in the script and in code, its ``value``, and what it may be."""

    name: str
    code: str
    value: float
    least: float
    most: float
    unit: str


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """Everything that a page is made of. ``film``: of one moment, with live numbers; ``rate``: frames a second;
    ``handle``: the thing and the anchor (by name) that drives it; ``times``: of all frames; ``end``: of the film.
    ``conditions``: how many of each stage's margins are no forks of the motion, and come first.
    """

    film: Film
    live: LiveScene
    stages: tuple[LiveStage, ...]
    sliders: tuple[Slider, ...]
    times: tuple[float, ...]
    end: float
    rate: float
    loop: int
    loops: bool
    size: float
    handle: tuple[str, str] | None
    places: dict[int, list[int]]
    conditions: int = 0


def figure_parts(figure: Figure) -> tuple[str, dict[str, Any]]:
    """The code that computes a figure, and its data."""
    drawn = LiveData(figure.film, figure.live.scene)
    data = drawn.all()
    names: dict[Hashable, str] = {KeptConstant(slider.name): slider.code for slider in figure.sliders}
    picture = picture_stage([each.expr for each in drawn.found], names)
    measures = picture_stage([each.expr for each in figure.live.measures], names)
    code = javascript(figure.stages, picture, measures, [slider.code for slider in figure.sliders])
    numbers = {number: body for body, number in drawn.body_numbers.items()}
    rates = sorted({(n, order) for n, order in _rates(code)})
    return code, {
        **data,
        "frames": len(figure.times),
        "times": list(figure.times),
        "fps": figure.rate,
        "loop": figure.loop,
        "live": {
            "sliders": [
                {"name": s.name, "code": s.code, "value": s.value, "least": s.least, "most": s.most, "unit": s.unit}
                for s in figure.sliders
            ],
            "stages": [
                {
                    "start": one.program.start,
                    "margins": one.margins,
                    "choices": one.choices,
                    "checks": one.checks,
                    "signs": one.signs,
                    "follows": one.follows,
                }
                for one in figure.stages
            ],
            "end": figure.end,
            "loops": figure.loops,
            "size": figure.size,
            "places": [list(figure.places.get(numbers[k], ())) for k in range(len(numbers))],
            "rates": [list(rate) for rate in rates],
            "handle": None if figure.handle is None else list(figure.handle),
            "glyphs": glyphs() if any("pieces" in text for text in _texts(data)) else {},
            "units": UNITS,
            "slant": SLANT,
            "middle": MIDDLE,
            "low": DISCRIMINANT_ZERO,
            "off": FRAME_SOLVED,
        },
    }


def figure_document(figure: Figure) -> Iterator[str]:
    """The parts of the file; the same each time."""
    code, data = figure_parts(figure)
    yield from document(figure.film.title, script(code, "page.js"), shipped("page.css") + style(), data)


def script(code: str, *more: str) -> str:
    """Everything that runs."""
    return shipped("painter.js", "player.js") + _own("live.js") + code + shipped(*more)


def style() -> str:
    """How a figure looks."""
    return shipped("player.css") + _own("live.css")


def _own(name: str) -> str:
    return files("movimentum.living").joinpath(name).read_text(encoding="utf-8")


def _rates(code: str) -> Iterator[tuple[int, int]]:
    import re

    for number, order in re.findall(r'rs_\["(\d+)_(\d)"\]', code):
        yield int(number), int(order)


def _texts(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for mark in data["marks"]:
        yield mark
        yield mark.get("caption") or {}
