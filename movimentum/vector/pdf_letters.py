"""Letters in a PDF: a font of its own whose glyphs are the outlines that all vector films draw.

Such a font (Type 3) holds only what is used, and names its glyphs' characters. So texts can be searched and copied, in
any script that a face is found for, although no font file is embedded.
"""

from __future__ import annotations

import re
from typing import Protocol

from movimentum.drawing.style import UNITS
from movimentum.records import dataclass, field
from movimentum.rendering.layout import laid_out, width_of
from movimentum.rendering.outlines import glyphs, outline_of, text_outline
from movimentum.vector.numbers import short

FULL = 255
"""Glyphs of one font."""


class Streams(Protocol):
    """Where a font is written to."""

    def add(self, body: bytes) -> int:
        """A new object's number."""
        ...

    def stream(self, entries: str, data: bytes) -> int:
        """A stream's number."""
        ...


@dataclass(slots=True)
class _Font:
    """``glyphs``: what each draws, its width and its text, by its code less one."""

    glyphs: list[tuple[str, float, str]] = field(default_factory=list[tuple[str, float, str]])


class PdfLetters:
    """The fonts of one file."""

    def __init__(self) -> None:
        self._fonts: list[_Font] = []
        self._known: dict[tuple[str, str], tuple[int, int]] = {}

    def shown(self, text: str) -> str:
        """Operators that show ``text`` from the origin on, in `UNITS` for the height of the font."""
        found: list[str] = []
        at, font = 0.0, -1
        for path, x, width, letters in _spelled(text):
            number, code = self._code(path, width, letters)
            if number != font:
                found.append(f"/T{number} {UNITS} Tf")
                font = number
            step = f"{short(x - at, 2)} 0 Td " if x != at else ""
            found.append(f"{step}<{code:02X}> Tj")
            at = x
        return f"BT {' '.join(found)} ET" if found else ""

    def _code(self, path: str, width: float, text: str) -> tuple[int, int]:
        if (path, text) not in self._known:
            if not self._fonts or len(self._fonts[-1].glyphs) >= FULL:
                self._fonts.append(_Font())
            self._fonts[-1].glyphs.append((path, width, text))
            self._known[path, text] = len(self._fonts) - 1, len(self._fonts[-1].glyphs)
        return self._known[path, text]

    def written(self, file: Streams) -> str:
        """The entry of a resource dictionary with all fonts, which are written."""
        listed = " ".join(f"/T{number} {_font(file, font)} 0 R" for number, font in enumerate(self._fonts))
        return f"<< {listed} >>"


def _spelled(text: str) -> list[tuple[str, float, float, str]]:
    """(outline, place, width, characters) of each letter, spaces too; a text whose letters join is one."""
    if glyphs(text) is None:
        return [(text_outline(text), 0.0, width_of(text) * UNITS, text)]
    return [(outline_of(each), each.x * UNITS, each.width * UNITS, each.text) for each in laid_out(text)]


def _font(file: Streams, font: _Font) -> int:
    count = len(font.glyphs)
    boxes = [_box(path) for path, _, _ in font.glyphs]
    box = [min(b[0] for b in boxes), min(b[1] for b in boxes), max(b[2] for b in boxes), max(b[3] for b in boxes)]
    drawn = [
        file.stream("", f"{round(width)} 0 d0\n{path_operators(path)}f*".encode("ascii"))
        for path, width, _ in font.glyphs
    ]
    procedures = " ".join(f"/g{code} {number} 0 R" for code, number in enumerate(drawn, 1))
    names = " ".join(f"/g{code}" for code in range(1, count + 1))
    widths = " ".join(str(round(width)) for _, width, _ in font.glyphs)
    mapped = file.stream("", _characters([text for _, _, text in font.glyphs]).encode("ascii"))
    return file.add(
        f"<< /Type /Font /Subtype /Type3 /FontBBox [{' '.join(map(str, box))}]"
        f" /FontMatrix [{1 / UNITS:g} 0 0 {1 / UNITS:g} 0 0] /FirstChar 1 /LastChar {count} /Widths [{widths}]"
        f" /Encoding << /Type /Encoding /Differences [1 {names}] >> /CharProcs << {procedures} >>"
        f" /Resources << >> /ToUnicode {mapped} 0 R >>".encode()
    )


def _characters(texts: list[str]) -> str:
    """The map from codes to characters (ISO 32000-1, 9.10.3)."""
    rows = [f"<{code:02X}> <{text.encode('utf-16-be').hex().upper()}>" for code, text in enumerate(texts, 1)]
    blocks = [rows[k : k + 100] for k in range(0, len(rows), 100)]
    body = "".join(f"{len(block)} beginbfchar\n{chr(10).join(block)}\nendbfchar\n" for block in blocks)
    return (
        "/CIDInit /ProcSet findresource begin 12 dict begin begincmap\n"
        "/CIDSystemInfo << /Registry (Adobe) /Ordering (UCS) /Supplement 0 >> def\n"
        "/CMapName /Letters def /CMapType 2 def\n1 begincodespacerange <00> <FF> endcodespacerange\n"
        f"{body}endcmap CMapName currentdict /CMap defineresource pop end end\n"
    )


_TOKENS = re.compile(r"[A-Za-z]|-?(?:\d+\.?\d*|\.\d+)")


def corners(path: str) -> list[tuple[list[tuple[float, float]], bool]]:
    """The corners of each line of an SVG's path that consists of straight lines, and whether it is closed.

    ValueError for other commands than those that our vector films have.
    """
    tokens = _TOKENS.findall(path)
    found: list[tuple[list[tuple[float, float]], bool]] = []
    x = y = 0.0
    command, place = "", 0
    while place < len(tokens):
        if tokens[place].isalpha():
            command, place = tokens[place], place + 1
            if command in "zZ":
                found[-1] = found[-1][0], True
                x, y = found[-1][0][0]
                continue
        if command in "hH":
            x, place = (x if command == "h" else 0.0) + float(tokens[place]), place + 1
        elif command in "MLml":
            dx, dy = float(tokens[place]), float(tokens[place + 1])
            x, y = (x + dx, y + dy) if command.islower() else (dx, dy)
            place += 2
        else:
            raise ValueError(f"{command} in a path")
        if command in "Mm":
            found.append(([], False))
            command = "L" if command == "M" else "l"
        found[-1][0].append((x, y))
    return found


def path_operators(path: str) -> str:
    """The operators that make an SVG's path."""
    made: list[str] = []
    for points, closed in corners(path):
        for place, (x, y) in enumerate(points):
            made.append(f"{short(x, 6)} {short(y, 6)} {'l' if place else 'm'}\n")
        made.append("h\n" if closed else "")
    return "".join(made)


def _box(path: str) -> tuple[int, int, int, int]:
    points = [point for line, _ in corners(path) for point in line] or [(0.0, 0.0)]
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return round(min(xs)), round(min(ys)), round(max(xs)), round(max(ys))
