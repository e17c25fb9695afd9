"""A picture from a file."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.options import (
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


@dataclass(frozen=True, slots=True)
class SpriteImage(Own):
    """``image``: the path as found from the script's folder; ``image_size``: (width, height) in image pixels, None if
    it could not be read. One image pixel is ``scale`` world pixels, and the image's lower-left corner is at the local
    origin.
    """

    image: str
    image_size: tuple[int, int] | None = None
    scale: float = 1.0


SPRITE = ThingKind(
    "sprite",
    place=0,
    called="a picture",
    anchors=0,
    options=(
        LAYER,
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
