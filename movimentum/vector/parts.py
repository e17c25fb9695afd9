"""Parts of figures and symbols as SVG elements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm, Point
from movimentum.vector.film import FARTHEST
from movimentum.vector.numbers import XmlElement, hex_color, joined, last_shown, short, texts


class Animator(Protocol):
    """Gives an element an attribute with a text for each frame."""

    def __call__(self, element: XmlElement, name: str, values: list[str]) -> None:
        """Set ``name``, and animate it where ``values`` change."""
        ...


def still_part(part: FigurePart, ink: str, place: Callable[[Point], Point], decimals: int) -> XmlElement:
    """A part whose points stay where ``place`` puts them."""
    rings = [[place(point) for point in ring] for ring in (part.points, *part.holes)]
    match part.form:
        case PartForm.DOT | PartForm.RING:
            (x, y), *_ = rings[0]
            radius = part.width if part.form is PartForm.DOT else part.radius
            where = [f'c{axis}="{short(value, decimals)}"' for axis, value in (("x", x), ("y", y)) if value]
            return XmlElement("circle", [*where, f'r="{short(radius, decimals)}"', *painted(part, ink, decimals)])
        case PartForm.FILL:
            outline = "".join(f"M{_points(ring, decimals)}z" for ring in rings)
            return XmlElement("path", [f'd="{outline}"', *painted(part, ink, decimals)])
        case PartForm.STROKE:
            tag = "polygon" if part.closed else "polyline"
            return XmlElement(tag, [f'points="{_points(rings[0], decimals)}"', *painted(part, ink, decimals)])


def moving_part(part: MovingPart, ink: str, opacity: FloatArray, decimals: int, animate: Animator) -> XmlElement:
    """A part with its points in every frame."""
    style, count = part.style, len(part.points)
    shown = (part.shown & (opacity > 0.0)).astype(np.float64)
    where = last_shown(np.clip(part.points, -FARTHEST, FARTHEST).reshape(count, -1), shown)
    if style.form is PartForm.DOT:
        element = XmlElement("circle", [f'r="{short(style.width, decimals + 1)}"', *painted(style, ink, decimals + 1)])
        for name, column in zip(("cx", "cy"), where.T, strict=True):
            animate(element, name, texts([column], decimals))
        if not part.shown[opacity > 0.0].all():
            animate(element, "opacity", texts([shown], 0))
        return element
    closed = style.closed or style.form is PartForm.FILL
    element = XmlElement("polygon" if closed else "polyline", painted(style, ink, decimals + 1))
    animate(element, "points", texts(list(where.T), decimals))
    if not part.shown[opacity > 0.0].all():
        animate(element, "opacity", texts([shown], 0))
    return element


def tinted(name: str, tint: FloatArray, animate: Animator) -> str:
    """The filter ``name`` that multiplies colours by ``tint`` (F, 3), of 255."""
    functions: list[str] = []
    for column, channel in enumerate("RGB"):
        function = XmlElement(f"feFunc{channel}", ['type="linear"'])
        animate(function, "slope", texts([tint[:, column] / 255.0], 4))
        functions.append(str(function))
    transfer = f"<feComponentTransfer>{''.join(functions)}</feComponentTransfer>"
    return f'<filter id="{name}" color-interpolation-filters="sRGB">{transfer}</filter>'


def painted(part: FigurePart, ink: str, decimals: int) -> list[str]:
    """The attributes of a part's colour and line; what the group around all marks says is left out."""
    color = ink if part.color is None else hex_color(part.color)
    if part.form not in (PartForm.STROKE, PartForm.RING):
        return [f'fill="{color}"']
    found = [f'stroke="{color}"', f'stroke-width="{short(part.width, decimals)}"']
    if part.dash:
        found.append(f'stroke-dasharray="{" ".join(short(length, decimals) for length in part.dash)}"')
    if part.cap != "round":
        found.append(f'stroke-linecap="{part.cap}"')
    return found


def _points(points: Sequence[Point], decimals: int) -> str:
    return joined(*(value for point in points for value in point), decimals=decimals)
