"""A film as one self-contained HTML file: the player, the display list, and the poses of all frames.

The page makes no request: its policy forbids all but its own script and style, identified by their hashes, and pictures
embedded in the file.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Callable, Iterator, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.cancellation import look
from movimentum.drawing.arrows import arrow_parts
from movimentum.drawing.camera import camera, detail, inset_frame, inset_lines
from movimentum.drawing.clips import clip_outline
from movimentum.drawing.figure_outlines import FigurePart, MovingPart
from movimentum.drawing.model import (
    DiscMark,
    FigureMark,
    FreeArrow,
    ImageMark,
    InsetMark,
    LinkMark,
    NoteMark,
    Point,
    PolylineMark,
    SymbolMark,
    TextMark,
)
from movimentum.drawing.motion import paint_over, scale_over
from movimentum.drawing.style import (
    ARROW_WIDTH,
    DOT_EDGE,
    FAINT,
    LONGEST,
    NOTE_HEIGHT,
    PAPER,
    TRACE_WIDTH,
    UNITS,
    color_of,
)
from movimentum.drawing.symbols import caption, moving_parts
from movimentum.drawing.texts import written
from movimentum.geometry import Affine
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.prepare import PreparedDrawing, Trace
from movimentum.text import unraised
from movimentum.vector.film import FARTHEST, Film
from movimentum.vector.images import embedded
from movimentum.vector.numbers import css, matrix, nine_digits
from movimentum.vector.words import lettering


def page_document(film: Film) -> Iterator[str]:
    """The parts of the file; the same each time."""
    script, style = shipped("painter.js", "player.js", "page.js"), shipped("page.css", "player.css")
    yield from document(film.title, script, style, film_data(film))


def document(title: str, script: str, style: str, data: Any) -> Iterator[str]:
    """A page with a player, which makes no request."""
    policy = (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; img-src data:;"
        " base-uri 'none'; form-action 'none'"
    )
    yield (
        "<!DOCTYPE html>\n"
        '<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="generator" content="Movimentum">\n'
        f"<title>{html.escape(title)}</title>\n"
        f"<style>{style}</style>\n</head>\n"
        '<body>\n<main><div id="film"></div></main>\n'
    )
    yield f'<script type="application/json" data-movimentum="film">{script_json(data)}</script>\n'
    yield f"<script>{script}</script>\n</body>\n</html>\n"


def script_json(value: Any) -> str:
    """JSON that may stand inside a script element: no text in it can end the element or begin a comment."""
    text = json.dumps(value, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def film_data(film: Film) -> dict[str, Any]:
    """The display list for the player, as JSON values; see `painter.js` for its frame of reference.

    ``poses`` are the numbers that change, as base64 of little-endian 32-bit floats; a number that changes refers to
    them as ``[offset]``.
    """
    return FilmData(film).all()


def shipped(*names: str) -> str:
    """The text of files that come with this stage, one after the other."""
    return "".join(files("movimentum.vector").joinpath(name).read_text(encoding="utf-8") for name in names)


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode('utf-8')).digest()).decode('ascii')}"


class FilmData:
    """Gathers the numbers of one film."""

    def __init__(self, film: Film) -> None:
        self.film = film
        self._poses: list[FloatArray] = []
        self._known: dict[bytes, int] = {}
        self._length = 0
        self._pictures, self._places = embedded(film.prepared)
        self._styles: dict[int, tuple[FigurePart, dict[str, Any]]] = {}  # by their ids, which supports share
        self._painted: dict[int, tuple[FloatArray, FloatArray]] = {}
        self.body_numbers = {body: number for number, body in enumerate(film.bodies)}

    def all(self) -> dict[str, Any]:
        """Everything (see `film_data`)."""
        film, prepared = self.film, self.film.prepared
        view, place = prepared.view, prepared.view.to_image
        background = prepared.drawing.background
        places = self._places
        bodies = [self.body(body) for body in film.bodies]
        marks = [self._mark(item, places.get(number)) for number, item in enumerate(prepared.things) if self.seen(item)]
        first = len(prepared.things)
        beside = [
            self._mark(item, places.get(number))
            for number, item in enumerate(prepared.beside, first)
            if self.seen(item)
        ]
        overlays = [self._mark(item, None) for item in prepared.overlays if self.seen(item)]
        traces = {name: [self.trace(item) for item in some] for name, some in _paths(prepared)}
        seen_through = self._camera(camera(film.poses, view))
        data = np.concatenate(self._poses) if self._poses else np.zeros(0)
        return {
            "version": 1,
            "title": film.title,
            "width": view.width,
            "height": view.height,
            "toImage": matrix(place),
            "background": None if background is None else css(background),
            "paper": css(PAPER),
            "traceWidth": TRACE_WIDTH,
            "frames": film.frames,
            "fps": float(film.fps),
            "loop": film.loop,
            "times": [nine_digits(time) for time in film.poses.times.tolist()],
            "bodies": bodies,
            "marks": marks,
            **traces,
            **({"beside": beside} if beside else {}),
            "overlays": overlays,
            **seen_through,
            "images": [each.data for each in self._pictures],
            "poses": base64.b64encode(data.astype("<f4").tobytes()).decode("ascii"),
        }

    def _camera(self, frame: FloatArray | None) -> dict[str, Any]:
        """A map of the world, see `drawing.camera`."""
        return {} if frame is None else {"camera": [self.number(column) for column in frame.T]}

    def seen(self, item: PreparedMark) -> bool:
        """Whether a mark is drawn in any frame."""
        return bool(self._paint(item)[0].any())

    def _paint(self, item: PreparedMark) -> tuple[FloatArray, FloatArray]:
        """See `Film.paint`, which is asked once only."""
        found = self._painted.get(id(item))
        if found is None:
            found = self._painted[id(item)] = self.film.paint(item)
        return found

    def body(self, body: int) -> dict[str, Any]:
        """A body and how it moves."""
        look()
        motion, thing = self.film.bodies[body], self.film.scene.things[body]
        return {
            "name": thing.name,
            "color": list(color_of(thing)),
            "x": self.number(motion.x),
            "y": self.number(motion.y),
            "angle": self.number(motion.angle),
            "visible": self.number(motion.visible.astype(np.float64)),
            "anchors": {anchor.name: self.local(body, anchor.local) for anchor in thing.anchors},
        }

    def _mark(self, item: PreparedMark, image: int | None) -> dict[str, Any]:
        look()
        found = self.unclipped(item, image)
        if item.group is not None:
            found["group"] = {
                "thing": item.group.thing,
                "opacity": self.number(paint_over(item.group, self.film.poses)[0]),
            }
        if item.clip is not None:
            found["clip"] = self._columns(clip_outline(item.clip, self.film.poses))
        if item.still:
            found["still"] = True
        return found

    def _columns(self, part: MovingPart) -> list[float | list[int]]:
        """The points of a part, x and y in turn."""
        return self._numbers(part.points.reshape(len(part.points), -1))

    def unclipped(self, item: PreparedMark, image: int | None) -> dict[str, Any]:
        """A mark, but for what it is cut off by."""
        mark = item.mark
        opacity, color = self._paint(item)
        paint = {"opacity": self.number(opacity), "color": self._numbers(color)}
        if isinstance(mark, LinkMark):
            through = [[self.body_numbers[thing], *self.local(thing, local)] for thing, local in mark.through]
            return {"kind": "link", **paint, "through": through, "width": mark.width}
        if isinstance(mark, SymbolMark):
            return {"kind": "symbol", **paint, **self._symbol(mark)}
        if isinstance(mark, InsetMark):
            return {"kind": "inset", **paint, **self._inset(mark)}
        paint["body"] = self.body_numbers[mark.body]
        if not isinstance(mark, FreeArrow | NoteMark) and mark.paint.about is not None:
            scale = scale_over(mark.paint, self.film.poses)
            if scale is not None:
                about = self.local(mark.body, mark.paint.about)
                paint |= {"scale": self.number(np.minimum(scale, FARTHEST)), "about": about}
        match mark:
            case PolylineMark():
                points = [self.film.bodies[mark.body].local(point) for point in mark.points]
                return {"kind": "line", **paint, **_line(points, mark.width, mark.arrow)}
            case DiscMark():
                centre = self.local(mark.body, mark.centre)
                return {"kind": "disc", **paint, "centre": centre, "radius": mark.radius, "width": mark.width}
            case FreeArrow():
                x, y = self.film.bodies[mark.body].local(mark.tail)
                tip = (x + mark.velocity[0] * LONGEST, y + mark.velocity[1] * LONGEST)
                return {"kind": "line", **paint, **_line([(x, y), tip], ARROW_WIDTH, True)}
            case NoteMark():
                letters = self._letters(mark.text, NOTE_HEIGHT, mark.offset)
                halo = 2.0 / (letters["matrix"][0] * self.film.prepared.view.scale * self.film.prepared.fineness)
                point = self.local(mark.body, mark.local)
                note = {"point": point, "dot": mark.dot, "edge": DOT_EDGE, "halo": nine_digits(halo)}
                return {"kind": "note", **paint, **letters, **note}
            case FigureMark():
                local = self.film.bodies[mark.body].local
                return {"kind": "figure", **paint, "parts": [self._part(part, local) for part in mark.parts]}
            case TextMark():
                words = written(mark.pieces, mark.body, self.film.poses) if mark.pieces else [mark.text]
                start = self.film.bodies[mark.body].local(mark.start)
                found = self.words(words, mark.height, mark.align, mark.italic, start)
                return (
                    {"kind": "words", **paint, **found}
                    if mark.pieces
                    else {"kind": "text", **paint, **found["texts"][0]}
                )
            case ImageMark():
                assert image is not None
                x, y = self.film.bodies[mark.body].pivot
                place = Affine(1.0, 0.0, -x, 0.0, 1.0, -y) @ self._pictures[image].to_local
                return {"kind": "image", **paint, "image": image, "matrix": matrix(place)}

    def _part(self, part: FigurePart, place: Callable[[Point], Point]) -> dict[str, Any]:
        """A part of a figure."""
        rings = [[[nine_digits(x), nine_digits(y)] for x, y in map(place, ring)] for ring in (part.points, *part.holes)]
        return {**_style(part), "rings": rings}

    def _inset(self, mark: InsetMark) -> dict[str, Any]:
        """A part of the film once more."""
        poses = self.film.poses
        lines = inset_lines(mark, poses, camera(poses, self.film.prepared.view))
        frame = inset_frame(mark, poses)
        return {
            **self._camera(detail(mark, poses)[0]),
            "paper": frame.style.color and css(frame.style.color),
            "frame": self._columns(frame),
            "parts": [self._moving(part) for part in lines],
        }

    def _moving(self, part: MovingPart) -> dict[str, Any]:
        shown = self.number(part.shown.astype(np.float64))
        style = self._styles.get(id(part.style))
        if style is None:
            style = self._styles[id(part.style)] = part.style, _style(part.style)
        return {**style[1], "shown": shown, "moving": self._columns(part)}

    def _symbol(self, mark: SymbolMark) -> dict[str, Any]:
        """The marks redrawn in every frame: numbers that may change, x and y in turn."""
        poses = self.film.poses
        parts = [self._moving(part) for part in moving_parts(mark, poses)]
        words = caption(mark, poses)
        if words is None:
            return {"parts": parts}
        written_at = {"x": self.number(words.place[:, 0]), "y": self.number(words.place[:, 1])}
        letters = self.words(words.texts, mark.size, words.align, mark.italic, (0.0, 0.0))
        return {"parts": parts, "caption": {**written_at, **letters}}

    def words(self, words: list[str], height: float, align: str, italic: bool, start: Point) -> dict[str, Any]:
        """A text that may be another one in every frame: each of them once, and which one is shown."""
        numbers = {text: number for number, text in enumerate(dict.fromkeys(words))}
        found: list[dict[str, Any]] = []
        for text in numbers:
            letters = lettering(text, height, align, italic)
            place = Affine(1.0, 0.0, start[0], 0.0, 1.0, start[1]) @ letters.place
            found.append({"text": unraised(text), "path": letters.path, "matrix": matrix(place)})
        which = np.array([numbers[text] for text in words], dtype=np.float64)
        return {"texts": found, "which": self.number(which)}

    def trace(self, trace: Trace) -> dict[str, Any]:
        """A trace, or the whole of a path."""
        mark = trace.mark
        path, ends = trace.through(self.film.poses)
        if mark.whole:
            path, ends = trace.path, np.full(self.film.frames, len(trace.path))
        opacity: FloatArray = np.ones(self.film.frames)
        colors: FloatArray = np.tile(np.array(mark.color, dtype=np.float64), (self.film.frames, 1))
        if mark.paint is not None:
            opacity, colors = paint_over(mark.paint, self.film.poses)
        return {
            "body": self.body_numbers[mark.body],
            "point": self.local(mark.body, mark.local),
            "color": [self.number(colors[:, channel]) for channel in range(3)],
            "opacity": self.number(opacity * (FAINT if mark.whole else 1.0)),
            "width": mark.width,
            "dash": list(mark.dash),
            "cap": mark.cap,
            "tail": mark.tail,
            "rows": len(path),
            "path": [self.number(column) for column in path.T],
            "ends": self.number(ends.astype(np.float64)),
            **({"still": True} if trace.still else {}),
        }

    def _letters(self, text: str, height: float, start: Point) -> dict[str, Any]:
        from movimentum.rendering.outlines import text_outline

        path = text_outline(text)
        size = nine_digits(height / UNITS)
        return {"text": text, "path": path, "matrix": [size, 0, 0, size, *map(nine_digits, start)]}

    def local(self, body: int, point: Point) -> list[float]:
        """A local point of a body, measured from its pivot."""
        return [nine_digits(value) for value in self.film.bodies[body].local(point)]

    def _numbers(self, columns: FloatArray) -> list[float | list[int]]:
        """`number` of each column."""
        if columns.dtype == np.float64:
            single = columns.astype("<f4")
            if (single == single[0]).all():
                return [nine_digits(value) for value in columns[0].tolist()]
        return [self.number(column) for column in columns.T]

    def number(self, values: FloatArray) -> float | list[int]:
        """A number, or where its values in all frames are to be found."""
        first = float(values[0])
        if len(values) == 1 and first == first:
            return nine_digits(first)
        single = values.astype("<f4")
        if (single == single[0]).all():
            return nine_digits(first)
        key = single.tobytes()
        if key not in self._known:
            self._known[key] = self._length
            self._length += len(values)
            self._poses.append(values)
        return [self._known[key]]


def _paths(prepared: PreparedDrawing) -> list[tuple[str, tuple[Trace, ...]]]:
    return [("paths", prepared.paths), ("traces", prepared.traces)]


def _style(part: FigurePart) -> dict[str, Any]:
    return {
        "form": str(part.form),
        "width": nine_digits(part.width),
        "radius": nine_digits(part.radius),
        "color": None if part.color is None else css(part.color),
        "closed": part.closed,
        "dash": list(part.dash),
        "cap": part.cap,
    }


def _line(points: Sequence[Point], width: float, arrow: bool) -> dict[str, Any]:
    parts = arrow_parts(points, width) if arrow else None
    shaft, head = parts if parts is not None else (points, None)
    shown = {"points": [[nine_digits(x), nine_digits(y)] for x, y in shaft], "width": width}
    return shown if head is None else {**shown, "head": [[nine_digits(x), nine_digits(y)] for x, y in head]}
