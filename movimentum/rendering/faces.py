"""Fonts for texts: Pillow's own, DejaVu Sans, which is included, and those of the system.

Pillow's font has only Latin letters. A text is drawn with it if it has all the letters; otherwise with the first face
that has all of them; otherwise each character with the first face that has it.
"""

from __future__ import annotations

import io
import os
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from PIL import ImageFont

SHIPPED = "DejaVuSans.ttf"
SYSTEM = (
    "NotoSans-Regular.ttf", "arial.ttf", "segoeui.ttf", "Arial Unicode.ttf", "FreeSans.ttf",
    "LiberationSans-Regular.ttf",
    "NotoSansCJK-Regular.ttc", "NotoSansCJKsc-Regular.otf", "NotoSansSC-Regular.otf", "DroidSansFallbackFull.ttf",
    "DroidSansFallback.ttf", "wqy-microhei.ttc", "wqy-zenhei.ttc", "msyh.ttc", "simsun.ttc", "msgothic.ttc",
    "malgun.ttf",
    "YuGothR.ttc", "PingFang.ttc", "Hiragino Sans GB.ttc", "AppleSDGothicNeo.ttc", "STHeiti Light.ttc",
    "NotoSansSymbols2-Regular.ttf", "NotoSansSymbols-Regular.ttf", "NotoSansMath-Regular.ttf", "seguisym.ttf",
    "Symbola.ttf", "NotoSansDevanagari-Regular.ttf", "NotoSansThai-Regular.ttf", "Nirmala.ttf", "leelawui.ttf",
    "NotoEmoji-Regular.ttf", "unifont.ttf", "unifont.otf",
)  # fmt: skip
"""Files that systems commonly have, searched by name if the two others are not enough."""
PROBE = 24.0
"""The size used to find out which characters a face has."""
NOWHERE = ("\U0010ffff", "\ufff0", "\u0378")
"""Characters that no font has: a face draws the same sign for them as for all characters that it lacks."""
REPLACEMENT = "\ufffd"


@dataclass(frozen=True, slots=True)
class Face:
    """A font file by name; "" is Pillow's own."""

    name: str

    def at(self, size: float) -> Any:
        """The font at a size in pixels; OSError if the system does not have it."""
        return _opened(self.name, size)

    def has(self, character: str) -> bool:
        """Whether the face draws a character, and not its sign for missing characters."""
        return _has(self.name, character)


@cache
def _opened(name: str, size: float) -> Any:
    if not name:
        return ImageFont.load_default(size)
    if name == SHIPPED:
        return ImageFont.truetype(io.BytesIO(_shipped()), size)
    return ImageFont.truetype(name, size)


@cache
def _shipped() -> bytes:
    """The font beside this module, also where the package is not in a folder."""
    from movimentum import rendering

    loader: Any = rendering.__loader__
    data: bytes = loader.get_data(os.path.join(os.path.dirname(__file__), "fonts", SHIPPED))
    return data


@cache
def _lacking(name: str) -> frozenset[tuple[tuple[int, int], bytes]]:
    return frozenset(_drawn(name, character) for character in NOWHERE)


def _drawn(name: str, character: str) -> tuple[tuple[int, int], bytes]:
    mask = _opened(name, PROBE).getmask(character)
    return tuple(mask.size), bytes(mask)


@cache
def _has(name: str, character: str) -> bool:
    if character.isspace() or unicodedata.category(character) in ("Cf", "Mn", "Me"):
        return True  # they are invisible by themselves
    try:
        return _drawn(name, character) not in _lacking(name)
    except OSError:
        return False


def faces() -> Iterator[Face]:
    """All faces, the first choice first; the system's are opened when they are needed."""
    yield Face("")
    yield Face(SHIPPED)
    yield from map(Face, SYSTEM)


def normal(text: str) -> str:
    """A text with letters and accents combined if there is one character for both."""
    return unicodedata.normalize("NFC", text)


@cache
def runs(text: str) -> tuple[tuple[Face, str], ...]:
    """A text (see `normal`) cut into pieces, each with the face to draw it with; characters that no face has are
    replaced.
    """
    for face in faces():
        if all(face.has(character) for character in text):
            return ((face, text),)
    pieces: list[tuple[Face, str]] = []
    for character in text:
        face = face_of(character)
        shown = character if face is not None else REPLACEMENT
        face = face or Face(SHIPPED)
        if pieces and (pieces[-1][0] == face or character.isspace()):
            pieces[-1] = (pieces[-1][0], pieces[-1][1] + shown)
        else:
            pieces.append((face, shown))
    return tuple(pieces)


@cache
def face_of(character: str) -> Face | None:
    """The first face but Pillow's own (which looks different) that has a character; None if there is none."""
    return next((face for face in faces() if face.name and face.has(character)), None)


def missing(text: str) -> str:
    """The characters of a text that no face has, each once, in order."""
    text = normal(text)
    if text.isascii() and text.isprintable():
        return ""
    if all(Face("").has(character) for character in text):
        return ""
    return "".join(c for c in dict.fromkeys(text) if face_of(c) is None)
