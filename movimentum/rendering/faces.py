"""Fonts for texts: Inter, shared by all films; DejaVu Sans, for characters missing from Inter; and the system's fonts.

Each character is drawn with the first face that has it, together with its combining accents. So a text does not change
its design because of one more character.
"""

from __future__ import annotations

import io
import os
import re
import unicodedata
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from typing import Any

from PIL import ImageFont

from movimentum.records import dataclass

SHIPPED = ("Inter-Regular.otf", "DejaVuSans.ttf")
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
"""Files that systems commonly have, searched by name if the two that are shipped are not enough."""
PROBE = 24.0
"""The size used to find out which characters a face has."""
NOWHERE = ("\U0010ffff", "\ufff0", "\u0378")
"""Characters that no font has: a face draws the same sign for them as for all characters that it lacks."""
REPLACEMENT = "\ufffd"


@dataclass(frozen=True, slots=True)
class Face:
    """A font file by name."""

    name: str

    def at(self, size: float, *, joined: bool = False) -> Any:
        """The font at a size in pixels, for single characters or (``joined``) for such as change beside each other;
        OSError if the system does not have it.
        """
        return _opened(self.name, size, joined)

    def has(self, text: str) -> bool:
        """Whether the face draws all characters of a text, and not its sign for missing ones."""
        return all(_has(self.name, character) for character in text)


@cache
def _opened(name: str, size: float, joined: bool) -> Any:
    # what lays out joined letters is a library of the system, where it has one: plain letters must not depend on it
    engine = None if joined else ImageFont.Layout.BASIC
    return ImageFont.truetype(io.BytesIO(_shipped(name)) if name in SHIPPED else name, size, layout_engine=engine)


@cache
def _shipped(name: str) -> bytes:
    """A font beside this module, also where the package is not in a folder."""
    from movimentum import rendering

    loader: Any = rendering.__loader__
    data: bytes = loader.get_data(os.path.join(os.path.dirname(__file__), "fonts", name))
    return data


@cache
def _lacking(name: str) -> frozenset[tuple[tuple[int, int], bytes]]:
    return frozenset(_drawn(name, character) for character in NOWHERE)


def _drawn(name: str, character: str) -> tuple[tuple[int, int], bytes]:
    mask = _opened(name, PROBE, False).getmask(character)
    return tuple(mask.size), bytes(mask)


@cache
def _has(name: str, character: str) -> bool:
    if character.isspace() or unicodedata.category(character) == "Cf":
        return True  # they are invisible
    try:
        return _drawn(name, character) not in _lacking(name)
    except OSError:
        return False


def plain(size: float) -> Any:
    """The project's own font, for numbers and names in diagrams and on sheets."""
    return Face(SHIPPED[0]).at(size)


def faces() -> Iterator[Face]:
    """All faces, the first choice first; the system's are opened when they are needed."""
    yield from map(Face, (*SHIPPED, *SYSTEM))


def installed() -> list[str]:
    """The fonts of the system that are tried and found."""
    found: list[str] = []
    for name in SYSTEM:
        with suppress(OSError):
            ImageFont.truetype(name, PROBE)
            found.append(name)
    return found


def normal(text: str) -> str:
    """A text with letters and accents combined if there is one character for both."""
    return unicodedata.normalize("NFC", text)


@cache
def runs(text: str) -> tuple[tuple[Face, str], ...]:
    """A text (see `normal`) cut into pieces, each with the face to draw it with; characters that no face has are
    replaced.
    """
    pieces: list[tuple[Face, str]] = []
    for cluster in re.findall(r"(?s).[\u0300-\u036f\u1ab0-\u1aff\u20d0-\u20ff\ufe20-\ufe2f]*", text):
        face = face_of(cluster)
        shown = cluster if face is not None else REPLACEMENT
        face = face or Face(SHIPPED[-1])
        if pieces and (pieces[-1][0] == face or cluster.isspace()):
            pieces[-1] = (pieces[-1][0], pieces[-1][1] + shown)
        else:
            pieces.append((face, shown))
    return tuple(pieces)


@cache
def face_of(cluster: str) -> Face | None:
    """The first face that has a character, and the accents on it; None if there is none."""
    return next((face for face in faces() if face.has(cluster)), None)


def missing(text: str) -> str:
    """The characters of a text that no face has, each once, in order."""
    text = normal(text)
    if text.isascii() and text.isprintable():
        return ""
    return "".join(c for c in dict.fromkeys(text) if face_of(c) is None)
