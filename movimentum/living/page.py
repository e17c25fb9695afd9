"""Writes a living figure as one HTML file: the player, the display list with places for live numbers, and the program
that computes them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from importlib.resources import files
from typing import Any

from movimentum.arrays import FloatArray
from movimentum.drawing.figures import body_parts, drawn_points, pins
from movimentum.drawing.model import FigureMark, Point
from movimentum.drawing.motion import paint_over
from movimentum.drawing.skeletons import joints_of
from movimentum.drawing.style import FAINT, MIDDLE, SLANT, UNITS
from movimentum.equations.program import ConstantSymbol
from movimentum.living.numbers import FILLING, FIRST_MARK, LiveNumber, spelled
from movimentum.living.program import LiveStage, javascript, picture_stage
from movimentum.living.scene import LiveScene, is_live
from movimentum.records import dataclass
from movimentum.rendering.layout import width_of
from movimentum.rendering.outlines import text_outline
from movimentum.rendering.prepare import PreparedMark, Trace
from movimentum.scene.model import Scene, Thing
from movimentum.things.kinds.plate import PLATE
from movimentum.things.kinds.toothed import GEAR, RACK
from movimentum.tolerances import DISCRIMINANT_ZERO, FRAME_SOLVED
from movimentum.vector.film import Film
from movimentum.vector.numbers import css, nine_digits
from movimentum.vector.page import FilmData, document, shipped

GROWN = 3
"""Decimals of the points of teeth, in pixels: there are thousands."""
LETTERS = "0123456789+-.,%eEinfa–_ "
"""What numbers are written with."""


@dataclass(frozen=True, slots=True, eq=False)
class LiveBody:
    """A body whose pose is live; its points are measured from its local origin."""

    x: Any
    y: Any
    angle: Any
    visible: Any
    pivot: Point = (0.0, 0.0)

    def local(self, point: Point) -> Point:
        """The point itself."""
        return point


def is_made_there(thing: Thing) -> bool:
    """Whether the outline of a plate is found anew in the page, or that of a gear or a rack grows there."""
    if thing.kind in (GEAR, RACK):
        return is_live(thing.anchors[0].local, thing.toothed.module)
    return thing.kind is PLATE and is_live(drawn_points(thing))


class LiveData(FilmData):
    """The data of a film of one moment. ``found``: the live numbers, each a place in what the page computes.
    ``plain``: the scene as it is with the constants' own values.
    """

    def __init__(self, film: Film, plain: Scene) -> None:
        super().__init__(film)
        self.plain = plain
        self.found: list[LiveNumber] = []
        self._marks: list[tuple[LiveNumber, str]] = []

    def all(self) -> dict[str, Any]:
        """See `FilmData`; a live number is ``{"live": k}``."""
        with spelled() as self._marks:
            return self._placed(super().all())

    def _placed(self, value: Any) -> Any:
        if isinstance(value, LiveNumber):
            self.found.append(value)
            return {"live": len(self.found) - 1}
        if isinstance(value, dict):
            rows: Any = value  # pyright: ignore[reportUnknownVariableType]
            return {key: self._placed(each) for key, each in rows.items()}
        if isinstance(value, list | tuple):
            parts: Any = value  # pyright: ignore[reportUnknownVariableType]
            return [self._placed(each) for each in parts]
        return value

    def seen(self, item: PreparedMark) -> bool:
        """All are, at some time."""
        return True

    def local(self, body: int, point: Point) -> list[float]:
        """A point with all digits: what the page tells of anchors is what `solve` finds."""
        return list(point)

    def number(self, values: FloatArray) -> Any:
        """The number itself: there is one moment."""
        value = values[0]
        return value if isinstance(value, LiveNumber) else nine_digits(float(value))

    def words(self, words: list[str], height: float, align: str, italic: bool, start: Point) -> dict[str, Any]:
        """A text; with numbers that change, its pieces."""
        (text,) = words
        if not any(ord(letter) >= FIRST_MARK for letter in text):
            return super().words(words, height, align, italic, start)
        pieces: list[dict[str, Any]] = []
        plain = ""
        for letter in [*text.replace(FILLING, ""), None]:
            if letter is not None and ord(letter) < FIRST_MARK:
                plain += letter
                continue
            if plain:
                pieces.append({"path": text_outline(plain), "width": nine_digits(width_of(plain))})
            plain = ""
            if letter is not None:
                value, spec = self._marks[ord(letter) - FIRST_MARK]
                pieces.append({"value": value, "spec": spec})
        return {"pieces": pieces, "height": height, "align": align, "italic": italic, "start": list(start)}

    def trace(self, trace: Trace) -> dict[str, Any]:
        """A path: the page follows it."""
        mark = trace.mark
        opacity: Any = [1.0]
        color: Any = [list(map(float, mark.color))]
        if mark.paint is not None:
            opacity, colors = paint_over(mark.paint, self.film.poses)
            color = colors.tolist()
        return {
            "body": self.body_numbers[mark.body],
            "point": list(mark.local),
            "color": color[0],
            "opacity": opacity[0] * (FAINT if mark.whole else 1.0),
            "width": mark.width,
            "dash": list(mark.dash),
            "cap": mark.cap,
            "tail": mark.tail,
            "whole": mark.whole,
            "path": None,
        }

    def unclipped(self, item: PreparedMark, image: int | None) -> dict[str, Any]:
        """A plate is what is within its radius of the hull of its points: the page paints it as wide strokes. Teeth
        grow with their module.
        """
        thing = self.film.scene.things[item.mark.body] if isinstance(item.mark, FigureMark) else None
        if thing is None or not is_made_there(thing) or not isinstance(item.mark, FigureMark):
            return super().unclipped(item, image)
        if thing.kind is not PLATE:
            return self._grown(thing, item.mark)
        look = thing.look
        points = [list(point) for point in drawn_points(thing)]
        edge = 0.0 if look.edge is None else look.edge_width
        hull = {"form": "hull", "radius": 0, "closed": True, "dash": [], "cap": "round", "rings": [points]}
        parts: list[dict[str, Any]] = [{**hull, "width": look.width - edge, "color": None}]
        if look.edge is not None:
            parts.insert(0, {**hull, "width": look.width + edge, "color": css(look.edge)})
        joints = pins(thing, joints_of(self.film.scene, thing)) if look.pins is not None else ()
        more = super().unclipped(PreparedMark(FigureMark(item.mark.paint, joints)), None)
        return {**more, "parts": [*parts, *more["parts"]]}

    def _grown(self, thing: Thing, mark: FigureMark) -> dict[str, Any]:
        plain = self.plain.things[thing.number]
        x, y = plain.anchors[0].local
        parts = body_parts(plain, joints_of(self.plain, plain))
        found = super().unclipped(PreparedMark(FigureMark(mark.paint, parts)), None)
        scale = thing.toothed.module / plain.toothed.module
        for part in found["parts"]:
            part["rings"] = [
                [[round(px - x, GROWN), round(py - y, GROWN)] for px, py in ring] for ring in part["rings"]
            ]
            part["centre"], part["scale"] = list(thing.anchors[0].local), scale
        return found


def glyphs() -> dict[str, list[Any]]:
    """The outlines and widths of what numbers are written with."""
    return {letter: [text_outline(letter), nine_digits(width_of(f"0{letter}") - width_of("0"))] for letter in LETTERS}


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
    names: dict[Hashable, str] = {ConstantSymbol(slider.name): slider.code for slider in figure.sliders}
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
