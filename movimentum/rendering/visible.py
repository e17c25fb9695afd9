"""What is to be seen of a thing that is more than its anchors: the letters of a text, an element of a drawing."""

from __future__ import annotations

from movimentum.drawing.model import Point
from movimentum.errors import ScriptError
from movimentum.rendering.images import is_drawing
from movimentum.scene.model import Thing
from movimentum.things.kinds.label import LABEL


def visible_corners(thing: Thing) -> list[Point] | None:
    """The local corners of what is drawn of a label or a drawing, as it is drawn; None for other things, and for what
    cannot be drawn.
    """
    try:
        if thing.kind is LABEL and thing.anchors:
            from movimentum.rendering.text import aligned, text_sprite

            text, height, look = thing.text or "", thing.look.size, thing.look
            sprite = aligned(text_sprite(text, height, 1.0), text, height, look.align, look.italic)
            return None if sprite is None else sprite.moved(*thing.anchors[0].local).local_corners()
        if (picture := thing.picture) is not None and is_drawing(picture.image):
            from movimentum.rendering.rasters import load_drawing
            from movimentum.rendering.sprites import framed

            found = framed(*load_drawing(picture.image, picture.scale), picture.scale)
            return None if found is None else [thing.placement.affine.apply(*at) for at in found.local_corners()]
    except ScriptError:
        pass  # it is told where it is drawn
    return None
