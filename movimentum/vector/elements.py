"""Elements of XML while they are written."""

from __future__ import annotations

import re
from collections.abc import Sequence

from movimentum.records import dataclass, field


@dataclass(slots=True)
class XmlElement:
    """An element: its attributes, as they are written, and what stands inside it."""

    tag: str
    attributes: list[str] = field(default_factory=list[str])
    inside: list[str] = field(default_factory=list[str])

    def __str__(self) -> str:
        start = " ".join([self.tag, *self.attributes])
        return f"<{start}>{''.join(self.inside)}</{self.tag}>" if self.inside else f"<{start}/>"


def escaped(text: str) -> str:
    """A text as XML holds it, in an attribute too; characters that XML cannot hold are replaced."""
    text = re.sub("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", text)
    for character, entity in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;")):
        text = text.replace(character, entity)
    return text


def hex_color(color: Sequence[float]) -> str:
    """Red, green and blue, whole numbers from 0 to 255, as ``#rrggbb``, or ``#rgb`` if that is the same."""
    text = "".join(f"{int(value):02x}" for value in color)
    return f"#{text[::2]}" if text[::2] == text[1::2] else f"#{text}"
