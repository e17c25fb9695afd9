"""A film as one SVG file: a still, or animated with SMIL, without a script.

Everything is in world pixels, y up, inside one group that flips the picture. Every value holds until the next frame, as
in a GIF: at each frame's time the picture is exactly that frame's, and nothing turns the long way round.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import count, groupby

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.drawing.arrows import arrow_parts
from movimentum.drawing.camera import camera, detail, inset_frame, inset_lines
from movimentum.drawing.clips import clip_outline
from movimentum.drawing.figure_outlines import MovingPart
from movimentum.drawing.model import (
    BodyMark,
    DiscMark,
    FigureMark,
    FreeArrow,
    ImageMark,
    InsetMark,
    LinkMark,
    NoteMark,
    Paint,
    Point,
    PolylineMark,
    SymbolMark,
    TextMark,
    ThingMark,
)
from movimentum.drawing.motion import link_points, paint_over, scale_over
from movimentum.drawing.style import ARROW_WIDTH, DOT_EDGE, LONGEST, NOTE_HEIGHT, PAPER, UNITS
from movimentum.drawing.symbols import caption, moving_parts
from movimentum.drawing.texts import written
from movimentum.geometry import Affine
from movimentum.rendering.changing import runs
from movimentum.rendering.marks import PreparedMark
from movimentum.text import listed
from movimentum.vector.drawings import group
from movimentum.vector.film import FARTHEST, Film
from movimentum.vector.images import embedded
from movimentum.vector.numbers import FilmClock, XmlElement, escaped, hex_color, joined, last_shown, short, texts
from movimentum.vector.parts import moving_part, still_part, tinted
from movimentum.vector.paths import PathWriter
from movimentum.vector.words import WordWriter, lettering, matrix, spoken

LONG = 240
"""Characters of a shape that is written once, even if it is drawn twice."""


def svg_document(film: Film) -> Iterator[str]:
    """The lines of the file; the same each time."""
    view = film.prepared.view
    title = escaped(film.title)
    size = f'width="{view.width}" height="{view.height}" viewBox="0 0 {view.width} {view.height}"'
    yield f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{title}">\n'
    yield f"<title>{title}</title>\n<desc>{escaped(_description(film))}</desc>\n"
    writer = _SvgWriter(film)
    yield from writer.definitions()
    background = film.prepared.drawing.background
    if background is not None:
        yield f'<rect width="100%" height="100%" fill="{hex_color(background)}"/>\n'
    drawn = f'{matrix(view.to_image)} fill="none" stroke-linecap="round" stroke-linejoin="round"'
    lines = [*writer.marks()]
    if not any("<animate" in line for line in lines):
        yield from (f"<g {drawn}>\n", *lines, "</g>\n</svg>\n")
        return
    # who wants less motion sees the first frame; readers that do not know of this see the film
    yield "<style>@media (prefers-reduced-motion:reduce){#film{display:none}#still{display:inline}}</style>\n"
    yield from (f'<g id="film" {drawn}>\n', *lines, "</g>\n")
    still = _SvgWriter(film.frame(0), writer)
    yield from (f'<g id="still" display="none" {drawn}>\n', *still.definitions(), *still.marks(), "</g>\n</svg>\n")


def _description(film: Film) -> str:
    names = [thing.name for thing in film.scene.things if thing.is_body and not thing.hidden]
    what = listed([*dict.fromkeys(names)], 5) or "nothing"
    if film.frames == 1:
        return f"A drawing of {what}."
    times = "again and again" if film.loop == 0 else "once" if film.loop == 1 else f"{film.loop} times"
    return f"A film of {what}: {short(float(film.frames / film.fps), 2)} s, {times}."


class _SvgWriter:
    """Writes the marks of one film. ``moving``: who wrote the film of which this is one frame, in the same file."""

    def __init__(self, film: Film, moving: _SvgWriter | None = None) -> None:
        self.film = film
        self._moving_one = moving
        self._shapes: dict[str, str] = {} if moving is None else moving._shapes
        self._prefix = "" if moving is None else "s"
        view = film.prepared.view
        self._clock = FilmClock(film.frames, film.fps, film.loop)
        self._timing = self._clock.timing()
        self._decimals = max(0, 2 + math.ceil(math.log10(view.scale * film.prepared.closest)))
        # so that what is far from the pivot is not off by more than a point of the picture is
        self._turns = max(1, math.ceil(math.log10(max(view.width, view.height) * film.prepared.closest / 6.0)))
        self._fineness = view.scale * film.prepared.fineness
        self._clips = 0
        self._letters_of = WordWriter(film, self._prefix, self._animate)
        self._look = camera(film.poses, view)
        self._runs: list[str] = []
        self._pictures, self._places = embedded(film.prepared) if moving is None else (moving._pictures, moving._places)

    def marks(self) -> Iterator[str]:
        """All that is drawn, back to front."""
        prepared = self.film.prepared
        number = count()
        still_always = self._look is None and not prepared.beside
        for still, run in groupby(self._under(number), lambda each: each[0]):
            lines = [line for _, line in run]
            yield from lines if still or still_always else [self._seen(lines)]
        for item in prepared.beside:
            yield self.mark(item, next(number))
        overlays = [self.mark(item) for item in prepared.overlays]
        yield from overlays if self._look is None or not overlays else [self._seen(overlays)]

    def _under(self, number: Iterator[int]) -> Iterator[tuple[bool, str]]:
        """Marks that insets show too: whether the camera leaves it, and its text. ``number`` counts marks."""
        prepared = self.film.prepared
        paths = PathWriter(self.film, self._decimals, self._animate)
        for path in prepared.paths:
            yield from ((path.still, line) for line in paths.whole(path))
        for together, numbers in runs(prepared.things):
            items = [prepared.things[place] for place in numbers]
            lines = [(item.still, self.mark(item, next(number))) for item in items]
            if together is None:
                yield from lines
            else:
                yield all(still for still, _ in lines), self._together(together, [line for _, line in lines])
        for trace in prepared.traces:
            yield from ((trace.still, line) for line in paths.trace(trace))

    def _seen(self, lines: Sequence[str]) -> str:
        """The group that the camera moves."""
        self._runs.append(f"{self._prefix}l{len(self._runs)}")
        attributes = [f'id="{self._runs[-1]}"'] if self.film.prepared.beside else []
        return f"{self._mapped(XmlElement('g', attributes, [''.join(lines)]), self._look)}\n"

    def _mapped(self, element: XmlElement, look: FloatArray | None) -> XmlElement:
        """An element under a map of the world, see `drawing.camera`."""
        if look is None:
            return element
        zoom, x, y = look.T
        inner = XmlElement("g", inside=[str(element)])
        self._transform(inner, "scale", texts([zoom], 6))
        outer = XmlElement("g", inside=[str(inner)])
        self._transform(outer, "translate", texts([x, y], self._decimals))
        return outer

    def _together(self, group: Paint, lines: Sequence[str]) -> str:
        """Marks that are faded as one."""
        values = texts([paint_over(group, self.film.poses)[0]], 3)
        if set(values) == {"1"}:
            return "".join(lines)
        element = XmlElement("g", inside=[*lines])
        self._animate(element, "opacity", values)
        return f"{element}\n" if any(lines) else ""

    def definitions(self) -> Iterator[str]:
        """The pictures, each once, and the filters of things that are tinted."""
        for number, each in enumerate(self._pictures if self._moving_one is None else ()):
            name, (width, height) = f'id="i{number}"', each.size
            if each.drawn is None:
                inside = f'<image {name} width="{width}" height="{height}" href="{each.data}"/>'
            else:
                inside = group(each.drawn.text, name)
            yield f"<defs>{inside}</defs>\n"
        for number, item in enumerate((*self.film.prepared.things, *self.film.prepared.beside)):
            if isinstance(item.mark, ImageMark):
                tint = self.film.paint(item)[1]
                if (tint != 255.0).any():
                    yield f"<defs>{tinted(f'{self._prefix}t{number}', tint, self._animate)}</defs>\n"

    def mark(self, item: PreparedMark, number: int = -1) -> str:
        """One line of the file; ``number`` is that of a thing's mark."""
        mark = item.mark
        opacity, colors = self.film.paint(item)
        if not opacity.any():
            return ""
        ink = hex_color(colors[0]) if (colors == colors[0]).all() else "currentColor"
        match mark:
            case LinkMark():
                group = self._link(mark, ink, opacity)
            case SymbolMark():
                group = self._symbol(mark, ink, opacity)
            case NoteMark():
                group = self._note(mark, ink, opacity)
            case InsetMark():
                group = self._inset(mark, ink, opacity)
            case ImageMark():
                group = self._image(mark, number, (colors != 255.0).any())
                group = self._moving(self._scaled(group, mark, opacity), mark.body, opacity)
            case FreeArrow():
                group = self._moving(self._shared(self._shape(mark, ink)), mark.body, opacity)
            case _:
                group = self._scaled(self._shared(self._shape(mark, ink)), mark, opacity)
                group = self._moving(group, mark.body, opacity)
        if ink == "currentColor" and not isinstance(mark, ImageMark):  # which has a filter for its tint
            self._animate(group, "color", [hex_color(row) for row in last_shown(colors, opacity)])
        values = texts([opacity], 3)
        if not _still(values) or values[0] != "1":
            self._animate(group, "opacity", values)
        return f"{group}\n" if item.clip is None else f"{self._clipped(group, item.clip, opacity)}\n"

    def _inset(self, mark: InsetMark, ink: str, opacity: FloatArray) -> XmlElement:
        """A part of the film once more."""
        poses = self.film.poses
        look, shown = detail(mark, poses)
        frame = inset_frame(mark, poses)

        def part(each: MovingPart, color: str) -> XmlElement:
            return moving_part(each, color, opacity, self._decimals, self._animate)

        uses = XmlElement("g", inside=[f'<use href="#{run}"/>' for run in self._runs])
        seen = self._inside(self._mapped(uses, np.where(shown[:, None], look, look[:1])), part(frame, "#000"))
        lines = [part(each, ink) for each in inset_lines(mark, poses, self._look)]
        return XmlElement("g", inside=[str(each) for each in (part(frame, ink), seen, *lines)])

    def _inside(self, group: XmlElement, outline: XmlElement) -> XmlElement:
        """A group that is seen only inside an outline."""
        self._clips += 1
        name = f"{self._prefix}c{self._clips}"
        clip = XmlElement("clipPath", [f'id="{name}"'], [str(outline)])
        return XmlElement("g", [f'clip-path="url(#{name})"'], [str(clip), str(group)])

    def _clipped(self, group: XmlElement, by: ThingMark, opacity: FloatArray) -> XmlElement:
        """A mark that is seen only inside another one."""
        outline = moving_part(clip_outline(by, self.film.poses), "#000", opacity, self._decimals, self._animate)
        return self._inside(group, outline)

    def _shared(self, shape: XmlElement) -> XmlElement:
        """A shape that takes much room, so that the film and its first frame both use it."""
        text = str(shape)
        if (self.film.frames == 1 and self._moving_one is None) or len(text) < LONG or "<animate" in text:
            return shape
        if text in self._shapes:
            return XmlElement("g", inside=[f'<use href="#{self._shapes[text]}"/>'])
        if self._moving_one is not None:
            return shape
        name = self._shapes[text] = f"f{len(self._shapes)}"
        return XmlElement("g", inside=[f'<g id="{name}">{text}</g>'])

    def _image(self, mark: ImageMark, number: int, tinted: np.bool_) -> XmlElement:
        place = self._places[number]
        x, y = self.film.bodies[mark.body].pivot
        to_pivot = Affine(1.0, 0.0, -x, 0.0, 1.0, -y) @ self._pictures[place].to_local
        tint = [f'filter="url(#{self._prefix}t{number})"'] if tinted else []
        return XmlElement("g", inside=[str(XmlElement("use", [f'href="#i{place}"', *tint, matrix(to_pivot)]))])

    def _symbol(self, mark: SymbolMark, ink: str, opacity: FloatArray) -> XmlElement:
        """A mark redrawn in every frame."""
        group = XmlElement("g")
        for part in moving_parts(mark, self.film.poses):
            group.inside.append(str(moving_part(part, ink, opacity, self._decimals, self._animate)))
        words = caption(mark, self.film.poses)
        if words is not None:
            letters = self._letters_of.changing(words.texts, mark.size, words.align, mark.italic, f'fill="{ink}"')
            place = last_shown(np.clip(words.place, -FARTHEST, FARTHEST), opacity)
            self._translate(letters, texts(list(place.T), self._decimals))
            group.inside.append(str(letters))
        return group

    def _shape(self, mark: TextMark | PolylineMark | DiscMark | FigureMark | FreeArrow, ink: str) -> XmlElement:
        local = self.film.bodies[mark.body].local
        match mark:
            case PolylineMark():
                return self._line([local(point) for point in mark.points], mark.width, ink, mark.arrow)
            case DiscMark():
                return self._circle(local(mark.centre), mark.radius, mark.width, ink)
            case FreeArrow():
                x, y = local(mark.tail)
                tip = (x + mark.velocity[0] * LONGEST, y + mark.velocity[1] * LONGEST)
                return self._line([(x, y), tip], ARROW_WIDTH, ink, True)
            case FigureMark():
                parts = [still_part(part, ink, local, self._decimals + 1) for part in mark.parts]
                return XmlElement("g", inside=[str(part) for part in parts])
            case TextMark():
                drawn, (x, y) = f'fill="{ink}"', local(mark.start)
                if mark.pieces:
                    words = written(mark.pieces, mark.body, self.film.poses)
                    inside = self._letters_of.changing(words, mark.height, mark.align, mark.italic, drawn)
                    inside.attributes.append(f'transform="translate({joined(x, y, decimals=self._decimals)})"')
                    return XmlElement("g", inside=[str(inside)])
                if self.film.live:
                    words = self._letters_of.live([mark.text], mark.height, mark.align, mark.italic, drawn)
                    words.attributes.append(f'transform="translate({joined(x, y, decimals=self._decimals)})"')
                    return XmlElement("g", inside=[str(words)])
                letters = lettering(mark.text, mark.height, mark.align, mark.italic)
                place = matrix(Affine(1.0, 0.0, x, 0.0, 1.0, y) @ letters.place)
                path = f'<path {place} fill-rule="evenodd" {drawn} d="{letters.path}"/>'
                return XmlElement("g", [spoken(mark.text)], [path])

    def _note(self, mark: NoteMark, ink: str, opacity: FloatArray) -> XmlElement:
        group = XmlElement("g", [spoken(mark.text)])
        paper = hex_color(PAPER)
        if mark.dot:
            edge = [f'stroke="{ink}"', f'stroke-width="{DOT_EDGE}"', f'fill="{paper}"']
            group.inside.append(str(XmlElement("circle", [f'r="{short(mark.dot, 3)}"', *edge])))
        # the halo is one pixel of the picture wide
        halo = short(2.0 / (NOTE_HEIGHT / UNITS * self._fineness), 1)
        drawn = f'stroke="{paper}" stroke-width="{halo}" paint-order="stroke" fill="{ink}"'
        group.inside.append(self._letters(mark.text, NOTE_HEIGHT, mark.offset, drawn))
        where = np.clip(self.film.poses.world(mark.body, mark.local), -FARTHEST, FARTHEST)
        self._translate(group, texts(list(last_shown(where, opacity).T), self._decimals))
        return group

    def _line(self, points: Sequence[Point], width: float, ink: str, arrow: bool) -> XmlElement:
        parts = arrow_parts(points, width) if arrow else None
        shaft, head = parts if parts is not None else (points, ())
        dots = [points[0], points[0]] if len(points) == 1 else shaft
        drawn = [f'stroke="{ink}"', f'stroke-width="{short(width, self._decimals + 1)}"']
        line = XmlElement("polyline", [f'points="{self._points(dots)}"', *drawn])
        if not head:
            return line
        tip = XmlElement("polygon", [f'points="{self._points(head)}"', f'fill="{ink}"'])
        return XmlElement("g", inside=[str(line), str(tip)])

    def _link(self, mark: LinkMark, ink: str, opacity: FloatArray) -> XmlElement:
        drawn = [f'stroke="{ink}"', f'stroke-width="{short(mark.width, self._decimals + 1)}"']
        line = XmlElement("polyline", drawn)
        where = link_points(mark, self.film.poses)
        if len(mark.through) == 1:
            where = np.concatenate([where, where], axis=1)
        flat = last_shown(np.clip(where, -FARTHEST, FARTHEST).reshape(self.film.frames, -1), opacity)
        self._animate(line, "points", texts(list(flat.T), self._decimals))
        return line

    def _circle(self, centre: Point, radius: float, width: float | None, ink: str) -> XmlElement:
        decimals = self._decimals + 1
        places = [f'c{axis}="{short(value, decimals)}"' for axis, value in zip("xy", centre, strict=True) if value]
        drawn = [f'fill="{ink}"'] if width is None else [f'stroke="{ink}"', f'stroke-width="{short(width, decimals)}"']
        return XmlElement("circle", [*places, f'r="{short(radius, decimals)}"', *drawn])

    def _letters(self, text: str, height: float, start: Point, drawn: str) -> str:
        from movimentum.rendering.outlines import text_outline

        path = text_outline(text)
        size = height / UNITS
        place = matrix(Affine(size, 0.0, start[0], 0.0, size, start[1]))
        return f'<path {place} fill-rule="evenodd" {drawn} d="{path}"/>'

    def _points(self, points: Sequence[Point]) -> str:
        return joined(*(value for point in points for value in point), decimals=self._decimals + 1)

    def _scaled(self, element: XmlElement, mark: BodyMark, shown: FloatArray) -> XmlElement:
        """The element, measured from a body's pivot, as large as its scale says."""
        scale = scale_over(mark.paint, self.film.poses)
        if scale is None or mark.paint.about is None:
            return element
        size = np.minimum(last_shown(scale, shown), FARTHEST)
        rest = (1.0 - size)[:, None] * np.array(self.film.bodies[mark.body].local(mark.paint.about))
        self._transform(element, "scale", texts([size], self._turns + 2))
        element = XmlElement("g", inside=[str(element)])
        self._translate(element, texts(list(np.clip(rest, -FARTHEST, FARTHEST).T), self._decimals))
        return XmlElement("g", inside=[str(element)])

    def _moving(self, element: XmlElement, body: int, shown: FloatArray) -> XmlElement:
        """The element, measured from a body's pivot, as it moves with the body."""
        motion = self.film.bodies[body]
        where = last_shown(np.stack([motion.x, motion.y], axis=1), shown)
        places = texts(list(where.T), self._decimals)
        turns = texts([last_shown(motion.angle, shown)], self._turns)
        if set(turns) != {"0"}:
            self._transform(element, "rotate", turns)
            if set(places) != {"0 0"}:
                element = XmlElement("g", inside=[str(element)])
        self._translate(element, places)
        return element

    def _translate(self, element: XmlElement, places: list[str]) -> None:
        if set(places) != {"0 0"}:
            self._transform(element, "translate", places)

    def _transform(self, element: XmlElement, kind: str, values: list[str]) -> None:
        """A transformation with a text for each frame, the first of them also for readers that do not animate."""
        element.attributes.append(f'transform="{kind}({values[0]})"')
        if not _still(values):
            how = f'attributeName="transform" type="{kind}"'
            element.inside.append(f"<animateTransform {how} {self._timing} {self._clock.values(values)}/>")

    def _animate(self, element: XmlElement, name: str, values: list[str]) -> None:
        """An attribute with a text for each frame."""
        element.attributes.append(f'{name}="{values[0]}"')
        if not _still(values):
            moving = f'<animate attributeName="{name}" {self._timing} {self._clock.values(values)}/>'
            element.inside.append(moving)


def _still(values: Sequence[str]) -> bool:
    return all(value == values[0] for value in values)
