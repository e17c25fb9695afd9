"""A picture from a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import (
    CLIP,
    HIDDEN,
    JOINTS,
    LAYER,
    OFFSTAGE,
    OPACITY,
    STILL,
    OptionForm,
    OptionRule,
    flag,
)

if TYPE_CHECKING:  # it needs NumPy
    from movimentum.outlines.contour import Contour


@dataclass(frozen=True, slots=True)
class SpriteImage(Own):
    """``image``: the path as found from the script's folder; ``image_size``: (width, height) in image pixels, None if
    it could not be read. One image pixel is ``scale`` world pixels, and the image's lower-left corner is at the local
    origin. ``border``: its outline, measured from the first anchor, if it has one.
    """

    image: str
    image_size: tuple[int, int] | None = None
    scale: float = 1.0
    border: Contour | None = None


SPRITE = ThingKind(
    "sprite",
    place=0,
    called="a picture",
    anchors=0,
    options=(
        LAYER,
        OptionRule("outline", OptionForm.OUTLINE, "the outline of a picture", most=1000, field="border"),
        OptionRule("scale", OptionForm.POSITIVE, "the scale"),
        flag("topleft"),
        HIDDEN,
        OFFSTAGE,
        OPACITY,
        *JOINTS,
        CLIP,
        STILL,
    ),
    own=SpriteImage,
    ink=(255, 255, 255),
    plain=False,
)
