"""A film as one SVG file: a still, or animated with SMIL, without a script.

Everything is in world pixels, y up, inside one group that turns the picture over. Every frame's value holds until the
next frame, as in a GIF: at each frame's time the picture is exactly that frame's, and nothing turns the long way round.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.arrows import arrow_parts
from movimentum.drawing.model import (
    DiscMark,
    FreeArrow,
    ImageMark,
    LinkMark,
    NoteMark,
    Point,
    PolylineMark,
    TextMark,
)
from movimentum.drawing.motion import link_points
from movimentum.drawing.style import ARROW_WIDTH, DOT_EDGE, LONGEST, NOTE_HEIGHT, PAPER
from movimentum.geometry import Affine
from movimentum.rendering.prepare import PreparedMark, Trace
from movimentum.rendering.sprites import Sprite
from movimentum.vector.film import Film
from movimentum.vector.images import embedded
from movimentum.vector.numbers import Clock, held, joined, short, texts

_FAR = 99999  # world pixels: a gap that no path is longer than (times the scale of the picture)


def svg_document(film: Film) -> Iterator[str]:
    """The lines of the file; the same each time."""
    view = film.prepared.view
    title = escaped(film.title)
    size = f'width="{view.width}" height="{view.height}" viewBox="0 0 {view.width} {view.height}"'
    yield f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{title}">\n'
    yield f"<title>{title}</title>\n"
    writer = _Writer(film)
    yield from writer.definitions()
    background = film.prepared.drawing.background
    if background is not None:
        yield f'<rect width="100%" height="100%" fill="{_hex(background)}"/>\n'
    place = view.to_image
    turned = joined(*(place.a, place.d, place.b, place.e, place.c, place.f), decimals=6)
    yield f'<g transform="matrix({turned})" fill="none" stroke-linecap="round" stroke-linejoin="round">\n'
    for number, item in enumerate(film.prepared.things):
        yield writer.thing(number, item)
    for trace in film.prepared.traces:
        yield from writer.trace(trace)
    for item in film.prepared.overlays:
        yield writer.overlay(item)
    yield "</g>\n</svg>\n"


def escaped(text: str) -> str:
    """A text as XML holds it, in an attribute too; characters that XML cannot hold are replaced."""
    text = re.sub("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", text)
    for character, entity in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;")):
        text = text.replace(character, entity)
    return text


@dataclass(slots=True)
class _Element:
    """An element while it is written: its attributes, and what stands inside it."""

    tag: str
    attributes: list[str] = field(default_factory=list[str])
    inside: list[str] = field(default_factory=list[str])

    def __str__(self) -> str:
        start = " ".join([self.tag, *self.attributes])
        return f"<{start}>{''.join(self.inside)}</{self.tag}>" if self.inside else f"<{start}/>"


class _Writer:
    """Writes the marks of one film."""

    def __init__(self, film: Film) -> None:
        self.film = film
        view = film.prepared.view
        self._clock = Clock(film.frames, film.fps, film.loop)
        self._timing = self._clock.timing()
        self._decimals = max(0, 2 + math.ceil(math.log10(view.scale)))
        # so that what is far from the pivot is not off by more than a point of the picture is
        self._turns = max(1, math.ceil(math.log10(max(view.width, view.height) / 6.0)))
        self._pictures, self._places = embedded(film.prepared.things)

    def definitions(self) -> Iterator[str]:
        """The pictures, each once, and the filters of things that are tinted."""
        for number, (sprite, data) in enumerate(self._pictures):
            width, height = sprite.image.size
            picture = f'<image id="i{number}" width="{width}" height="{height}" href="{data}"/>'
            yield f"<defs>{picture}</defs>\n"
        for number, item in enumerate(self.film.prepared.things):
            if isinstance(item.mark, ImageMark):
                tint = self.film.paint(item)[1]
                if (tint != 255.0).any():
                    yield f"<defs>{self._tint(number, tint)}</defs>\n"

    def _tint(self, number: int, tint: FloatArray) -> str:
        functions: list[str] = []
        for column, channel in enumerate("RGB"):
            function = _Element(f"feFunc{channel}", ['type="linear"'])
            self._animate(function, "slope", texts([tint[:, column] / 255.0], 4))
            functions.append(str(function))
        transfer = f"<feComponentTransfer>{''.join(functions)}</feComponentTransfer>"
        return f'<filter id="t{number}" color-interpolation-filters="sRGB">{transfer}</filter>'

    def thing(self, number: int, item: PreparedMark) -> str:
        """One line of the file."""
        mark = item.mark
        opacity, colors = self.film.paint(item)
        if not opacity.any():
            return ""
        if isinstance(mark, ImageMark):
            place = self._places[number]
            tinted = (colors != 255.0).any()
            shape = _Element("use", [f'href="#i{place}"', *([f'filter="url(#t{number})"'] if tinted else [])])
            group = _Element("g", inside=[self._put(shape, self._from_pivot(mark.body, self._pictures[place][0]))])
        else:
            ink = _hex(colors[0]) if (colors == colors[0]).all() else "currentColor"
            group = self._shape(item, ink, opacity)
            if ink == "currentColor":
                self._animate(group, "color", [_hex(row) for row in held(colors, opacity)])
        if not isinstance(mark, LinkMark):
            self._move(group, mark.body, opacity)
        self._fade(group, opacity)
        return f"{group}\n"

    def _shape(self, item: PreparedMark, ink: str, opacity: FloatArray) -> _Element:
        mark, decimals = item.mark, self._decimals
        match mark:
            case PolylineMark():
                points = [self.film.bodies[mark.body].local(point) for point in mark.points]
                return self._line(points, mark.width, ink, mark.arrow)
            case LinkMark():
                return self._link(mark, ink, opacity)
            case DiscMark():
                body = self.film.bodies[mark.body]
                return self._circle(body.local(mark.centre), mark.radius, mark.width, ink)
            case TextMark():
                pivot = self.film.bodies[mark.body].local(mark.start)
                path = self._letters(mark.text, mark.height, pivot, [f'fill="{ink}"'])
                return _Element("g", [f'role="img" aria-label="{escaped(mark.text)}"'], [path])
            case _:
                raise TypeError(f"no shape of a thing: {type(mark).__name__}; {decimals}")

    def _line(self, points: Sequence[Point], width: float, ink: str, arrow: bool) -> _Element:
        parts = arrow_parts(points, width) if arrow else None
        shaft, head = parts if parts is not None else (points, ())
        dots = [points[0], points[0]] if len(points) == 1 else shaft
        drawn = [f'stroke="{ink}"', f'stroke-width="{short(width, self._decimals + 1)}"']
        line = _Element("polyline", [f'points="{self._points(dots)}"', *drawn])
        if not head:
            return line
        tip = _Element("polygon", [f'points="{self._points(head)}"', f'fill="{ink}"'])
        return _Element("g", inside=[str(line), str(tip)])

    def _link(self, mark: LinkMark, ink: str, opacity: FloatArray) -> _Element:
        drawn = [f'stroke="{ink}"', f'stroke-width="{short(mark.width, self._decimals + 1)}"']
        line = _Element("polyline", drawn)
        where = link_points(mark, self.film.poses)
        if len(mark.through) == 1:
            where = np.concatenate([where, where], axis=1)
        flat = held(where.reshape(self.film.frames, -1), opacity)
        self._animate(line, "points", texts(list(flat.T), self._decimals))
        return line

    def _circle(self, centre: Point, radius: float, width: float | None, ink: str) -> _Element:
        decimals = self._decimals + 1
        at = [f'{name}="{text}"' for name, value in zip("xy", centre, strict=True) if (text := short(value, decimals))]
        at = [f"c{text}" for text in at if not text.endswith('"0"')]
        drawn = [f'fill="{ink}"'] if width is None else [f'stroke="{ink}"', f'stroke-width="{short(width, decimals)}"']
        return _Element("circle", [*at, f'r="{short(radius, decimals)}"', *drawn])

    def _letters(self, text: str, height: float, start: Point, drawn: Sequence[str]) -> str:
        from movimentum.rendering.outlines import UNITS, text_outline

        view = self.film.prepared.view
        path = text_outline(text, max(1.0, height * view.scale * self.film.prepared.fineness))
        size = height / UNITS
        place = joined(*(size, 0.0, 0.0, size, *start), decimals=6)
        return f'<path transform="matrix({place})" fill-rule="evenodd" {" ".join(drawn)} d="{path}"/>'

    def overlay(self, item: PreparedMark) -> str:
        """One line of the file."""
        mark = item.mark
        opacity, _ = self.film.paint(item)
        if not opacity.any():
            return ""
        group = _Element("g")
        if isinstance(mark, FreeArrow):
            x, y = self.film.bodies[mark.body].local(mark.tail)
            tip = (x + mark.velocity[0] * LONGEST, y + mark.velocity[1] * LONGEST)
            group = self._line([(x, y), tip], ARROW_WIDTH, _hex(mark.color), True)
            self._move(group, mark.body, opacity)
        elif isinstance(mark, NoteMark):
            group.attributes.append(f'role="img" aria-label="{escaped(mark.text)}"')
            if mark.dot:
                edge = [f'stroke="{_hex(mark.color)}"', f'stroke-width="{DOT_EDGE}"', f'fill="{_hex(PAPER)}"']
                group.inside.append(str(_Element("circle", [f'r="{short(mark.dot, 3)}"', *edge])))
            # the halo is one pixel of the picture wide
            halo = 2.0 / (NOTE_HEIGHT / 1000.0 * self.film.prepared.view.scale * self.film.prepared.fineness)
            edge = [f'stroke="{_hex(PAPER)}"', f'stroke-width="{short(halo, 1)}"', 'paint-order="stroke"']
            drawn = [*edge, f'fill="{_hex(mark.color)}"']
            group.inside.append(self._letters(mark.text, NOTE_HEIGHT, mark.offset, drawn))
            where = self.film.poses.world(mark.body, mark.local)
            self._translate(group, texts(list(held(where, opacity).T), self._decimals))
        self._fade(group, opacity)
        return f"{group}\n"

    def trace(self, trace: Trace) -> Iterator[str]:
        """A path for each interval in which the body is visible: a dash that becomes longer."""
        news = trace.points(self.film.poses)
        past = np.zeros((0, 3)) if trace.past is None else trace.past
        points = np.concatenate([past, news])
        points[:, :2] = np.round(points[:, :2], self._decimals)
        shown = points[:, 2] > 0.0
        edges = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]]).astype(np.int8)))
        for first, end in edges.reshape(-1, 2).tolist():
            where = points[first:end, :2]
            steps = np.hypot(*np.diff(where, axis=0).T)
            far = np.concatenate([[0.0], np.cumsum(steps)])
            now = np.arange(len(past), len(points))  # the frames drawn
            kept = np.concatenate([[True], steps > 0.0])
            corners = where[kept]
            line = self._points([(x, y) for x, y in corners.tolist()])
            path = _Element("path", [f'd="M{line}{"h0" if len(corners) == 1 else ""}"'])
            width = short(trace.mark.width, self._decimals + 1)
            path.attributes += [f'stroke="{_hex(trace.mark.color)}"', f'stroke-width="{width}"']
            if far[-1] > 0.0:
                long = far[np.clip(now - first, 0, end - first - 1)]
                gap = short(max(_FAR, 2.0 * float(far[-1])), 0)
                dashes = [f"{short(value, self._decimals + 2)} {gap}" for value in long.tolist()]
                self._animate(path, "stroke-dasharray", dashes)
            self._fade(path, (now >= first).astype(np.float64))
            yield f"{path}\n"

    def _points(self, points: Sequence[Point]) -> str:
        return joined(*(value for point in points for value in point), decimals=self._decimals + 1)

    def _put(self, element: _Element, place: Affine) -> str:
        """The element, its own frame mapped by ``place``."""
        numbers = joined(*(place.a, place.d, place.b, place.e, place.c, place.f), decimals=6)
        element.attributes.append(f'transform="matrix({numbers})"')
        return str(element)

    def _from_pivot(self, body: int, sprite: Sprite) -> Affine:
        x, y = self.film.bodies[body].pivot
        return Affine(1.0, 0.0, -x, 0.0, 1.0, -y) @ sprite.to_local

    def _move(self, element: _Element, body: int, shown: FloatArray) -> None:
        """Let an element, measured from a body's pivot, move with the body."""
        motion = self.film.bodies[body]
        where = held(np.stack([motion.x, motion.y], axis=1), shown)
        places = texts(list(where.T), self._decimals)
        turns = texts([held(motion.angle, shown)], self._turns)
        if any(turn != "0" for turn in turns):
            if _still(turns):
                element.attributes.append(f'transform="translate({places[0]})rotate({turns[0]})"')
                if not _still(places):  # an animation would replace the turn
                    element.attributes.pop()
                    inner = _Element(element.tag, element.attributes, element.inside)
                    inner.attributes = [*inner.attributes, f'transform="rotate({turns[0]})"']
                    element.tag, element.attributes, element.inside = "g", [], [str(inner)]
                    self._translate(element, places)
                return
            self._translate(element, places)
            element.inside.append(self._transform("rotate", turns, added=True))
        else:
            self._translate(element, places)

    def _translate(self, element: _Element, places: list[str]) -> None:
        if _still(places):
            if places[0] != "0 0":
                element.attributes.append(f'transform="translate({places[0]})"')
        else:
            element.inside.append(self._transform("translate", places, added=False))

    def _transform(self, kind: str, values: list[str], *, added: bool) -> str:
        how = f'attributeName="transform" type="{kind}"{" additive=" + chr(34) + "sum" + chr(34) if added else ""}'
        return f"<animateTransform {how} {self._timing} {self._clock.values(values)}/>"

    def _animate(self, element: _Element, name: str, values: list[str]) -> None:
        """An attribute with a text for each frame."""
        element.attributes.append(f'{name}="{values[0]}"')
        if not _still(values):
            moving = f'<animate attributeName="{name}" {self._timing} {self._clock.values(values)}/>'
            element.inside.append(moving)

    def _fade(self, element: _Element, opacity: FloatArray) -> None:
        values = texts([opacity], 3)
        if not _still(values) or values[0] != "1":
            self._animate(element, "opacity", values)


def _still(values: Sequence[str]) -> bool:
    return all(value == values[0] for value in values)


def _hex(color: Sequence[float] | FloatArray | BoolArray) -> str:
    text = "".join(f"{int(value):02x}" for value in color)
    return f"#{text[0]}{text[2]}{text[4]}" if text[0::2] == text[1::2] else f"#{text}"
