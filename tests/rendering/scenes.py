"""Scenes and poses made by hand: nothing of the parser or the solver."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from PIL import Image, ImageDraw

from movimentum.rendering import coverage
from movimentum.scene.looks import look_of
from movimentum.scene.model import Anchor, AnchorRef, Config, Scene, Thing
from movimentum.solver.poses import Poses
from movimentum.source import SourceText, Span
from movimentum.things.registry import kind_of

NOWHERE = Span(0, 0)
WHITE, BLACK = (255, 255, 255), (0, 0, 0)


def thing(word, *points, name=None, through=(), text=None, **stated):
    """A thing whose anchors are called A, B, C …, with what its definition says; its number is given by `scene`."""
    kind = kind_of(word)
    anchors = tuple(Anchor("ABCDEFGHIJ"[i], (float(x), float(y)), NOWHERE) for i, (x, y) in enumerate(points))
    flags = {name: value for name, value in stated.items() if value is not False}
    own = kind.made({"text": text, **stated} if kind.arguments else stated)
    more = {"name": name, "own": own, "look": look_of(kind, flags), "through": tuple(through), "text": text}
    return {"kind": kind, "anchors": anchors, "span": NOWHERE, "name_span": NOWHERE, **more}


def line(*refs, **fields):
    return thing("line", through=tuple(AnchorRef(*ref) for ref in refs), **fields)


def scene(*things, size=(100, 80), fps=25, background=WHITE):
    made = tuple(Thing(number=n, **{**item, "name": item["name"] or f"T{n}"}) for n, item in enumerate(things))
    return Scene(SourceText("test.mov", ""), Config(Fraction(fps), size, background), made, {}, ())


def poses(*paths, visible=None, properties=None, frames=None):
    """``paths``: for each thing (F, 3) x, y, degrees, or one such row for all frames."""
    rows = [np.atleast_2d(np.asarray(path, dtype=float)) for path in paths]
    count = frames or max(len(row) for row in rows)
    whole = np.stack([np.broadcast_to(row, (count, 3)) for row in rows])
    turn = np.radians(whole[..., 2])
    shown = np.ones((len(paths), count), dtype=bool) if visible is None else np.asarray(visible, dtype=bool)
    return Poses(
        frames=np.arange(count),
        times=np.arange(count) / 25.0,
        origin=np.ascontiguousarray(whole[..., :2]),
        direction=np.stack([np.cos(turn), np.sin(turn)], axis=-1),
        angle=np.ascontiguousarray(whole[..., 2]),
        visible=shown,
        properties={key: np.asarray(value, dtype=float) for key, value in (properties or {}).items()},
        variables={},
        solved=np.ones(count, dtype=bool),
    )


def covered(outline, size):
    """The coverage of one outline, where it is."""
    return coverage.covered([(outline, coverage.HERE)], size)[0]


def whole(coverages, size):
    """Coverages on a canvas, 0 to 1."""
    picture = np.zeros((size[1], size[0]))
    for left, top, values in coverages:
        picture[top : top + values.shape[0], left : left + values.shape[1]] += values / 255.0
    return picture


def pixels(image):
    return np.asarray(image).astype(int)


def disc_file(path, size=60, color=(200, 30, 30), hidden_color=(0, 0, 0)):
    """An anti-aliased disc on clear ground; clear pixels hold ``hidden_color``, as editors leave them."""
    large = Image.new("L", (size * 8, size * 8), 0)
    ImageDraw.Draw(large).ellipse((32, 32, size * 8 - 33, size * 8 - 33), fill=255)
    alpha = large.reduce(8)
    image = Image.new("RGBA", (size, size), (*hidden_color, 0))
    image.paste(Image.new("RGBA", (size, size), (*color, 255)), (0, 0), alpha.point(lambda v: 255 if v else 0))
    image.putalpha(alpha)
    image.save(path)
    return str(path)


def square_file(path, size=40, color=(20, 60, 200)):
    """A wholly opaque square."""
    Image.new("RGB", (size, size), color).save(path)
    return str(path)


def truth(draw_point, size, over=8):
    """A picture of coverage (rows, columns) in 0 … 1 from ``draw_point(x, y) -> bool`` at over² points a pixel."""
    width, height = size
    x = (np.arange(width * over) + 0.5) / over
    y = (np.arange(height * over) + 0.5) / over
    inside = draw_point(x[None, :], y[:, None])
    return inside.reshape(height, over, width, over).mean(axis=(1, 3))


def capsule(p, q, radius):
    """The points within ``radius`` of a segment."""

    def inside(x, y):
        dx, dy = q[0] - p[0], q[1] - p[1]
        length = math.hypot(dx, dy) or 1.0
        along = np.clip(((x - p[0]) * dx + (y - p[1]) * dy) / length**2, 0, 1)
        return np.hypot(x - p[0] - along * dx, y - p[1] - along * dy) <= radius

    return inside
