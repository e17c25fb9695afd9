"""Parses SVG path data, command by command, into absolute lines and Bézier curves."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

from movimentum.tolerances import LEAST_DIVISOR, SAME_QUARTER

_SPACE, _COMMA = re.compile(r"\s*"), re.compile(r"\s*,?\s*")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_COMMAND = re.compile(r"[MmLlHhVvCcSsQqTtAaZz]")
_FLAG = re.compile(r"[01]")
_COUNT = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


class PathPiece(NamedTuple):
    """``M`` and ``L`` have one point, ``C`` three, ``Z`` none."""

    command: str
    points: tuple[complex, ...] = ()


class PathFault(ValueError):
    """Data that is no path, or no list of numbers."""


class _Scanner:
    """Reads a list of numbers, or the commands of a path."""

    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0

    def take(self, what: re.Pattern[str], between: re.Pattern[str] = _COMMA) -> str | None:
        """The next word if it is of this kind."""
        space = between.match(self._text, self._at)
        self._at = self._at if space is None else space.end()
        match = what.match(self._text, self._at)
        if match is None:
            return None
        self._at = match.end()
        return match[0]

    @property
    def done(self) -> bool:
        """Whether nothing is left."""
        return not self._text[self._at :].strip(" \t\r\n\f")


def numbers_of(text: str) -> list[float]:
    """A list of numbers, such as a polygon's ``points``; raises `PathFault`."""
    scanner, found = _Scanner(text), list[float]()
    while (word := scanner.take(_NUMBER)) is not None:
        found.append(float(word))
    if not (scanner.done and all(map(math.isfinite, found))):
        raise PathFault
    return found


def path_pieces(text: str, most_turn: float = math.pi / 2.0) -> Iterator[PathPiece]:
    """The pieces of a path's ``d``, one after another, each read when it is asked for; raises `PathFault` at what is
    not understood. Arcs are cut into curves that turn by ``most_turn`` (radians) at most.
    """
    scanner = _Scanner(text)
    here: complex = 0j
    start: complex = 0j
    handle: complex = 0j
    before = command = ""
    while not scanner.done:
        letter = scanner.take(_COMMAND, _SPACE)
        if letter is None and command in ("", "Z", "z"):
            raise PathFault
        command = letter or command
        kind = command.upper()
        values = _values(scanner, kind, repeated=letter is None)
        if not before and kind != "M":
            raise PathFault
        base: complex = here if command.islower() else 0j
        points: list[complex] = [base + complex(*pair) for pair in zip(values[::2], values[1::2], strict=False)]
        if before == "Z" and kind not in ("M", "Z"):
            yield PathPiece("M", (start,))
        match kind:
            case "M":
                yield PathPiece("M", (points[0],))
                start, command = points[0], "l" if command == "m" else "L"
            case "L":
                yield PathPiece("L", (points[0],))
            case "H" | "V":
                across = kind == "H"
                x = base.real + values[0] if across else here.real
                points = [complex(x, here.imag if across else base.imag + values[0])]
                yield PathPiece("L", (points[0],))
            case "C" | "S":
                first = points[0] if kind == "C" else 2 * here - handle if before in ("C", "S") else here
                handle = points[-2]
                yield PathPiece("C", (first, handle, points[-1]))
            case "Q" | "T":
                handle = points[0] if kind == "Q" else 2 * here - handle if before in ("Q", "T") else here
                first, second = here + 2 / 3 * (handle - here), points[-1] + 2 / 3 * (handle - points[-1])
                yield PathPiece("C", (first, second, points[-1]))
            case "A":
                points = [base + complex(*values[5:])]
                yield from _arc(here, values, points[0], most_turn)
            case _:
                yield PathPiece("Z")
                points = [start]
        here, before = points[-1], kind


def _values(scanner: _Scanner, kind: str, *, repeated: bool) -> list[float]:
    """The numbers of a command; raises `PathFault` where one is missing."""
    words = [
        scanner.take(_FLAG if kind == "A" and k in (3, 4) else _NUMBER, _COMMA if k or repeated else _SPACE)
        for k in range(_COUNT[kind])
    ]
    values = [float(word) for word in words if word is not None]
    if len(values) < len(words) or not all(map(math.isfinite, values)):
        raise PathFault
    return values


def _arc(start: complex, values: list[float], end: complex, most_turn: float) -> Iterator[PathPiece]:
    """An elliptical arc; see SVG 1.1, appendix F.6."""
    rx, ry, turn = abs(values[0]), abs(values[1]), values[2]
    large, sweep = values[3] > 0, values[4] > 0
    if start == end:
        return
    if rx == 0.0 or ry == 0.0:
        yield PathPiece("L", (end,))
        return
    way = complex(math.cos(math.radians(turn)), math.sin(math.radians(turn)))
    half = (start - end) / 2 / way
    x, y = half.real / rx, half.imag / ry
    square = max(0.0, 1.0 / max(x * x + y * y, LEAST_DIVISOR) - 1.0)
    if (far := math.hypot(x, y)) > 1.0:  # radii that are too short grow: half an ellipse, its centre between the ends
        rx, ry, x, y, square = rx * far, ry * far, x / far, y / far, 0.0
    side = math.sqrt(square) * (-1.0 if large == sweep else 1.0)
    middle = complex(side * y, -side * x)
    first = complex(x, y) - middle
    last = complex(-x, -y) - middle
    begin = math.atan2(first.imag, first.real)
    sweep_by = math.atan2(last.imag, last.real) - begin
    if sweep and sweep_by < 0.0:
        sweep_by += 2.0 * math.pi
    elif not sweep and sweep_by > 0.0:
        sweep_by -= 2.0 * math.pi

    def placed(point: complex) -> complex:
        point += middle
        return way * complex(rx * point.real, ry * point.imag) + (start + end) / 2

    pieces = max(1, math.ceil(abs(sweep_by) / most_turn - SAME_QUARTER))
    step = sweep_by / pieces
    handle = 4.0 / 3.0 * math.tan(step / 4.0)
    for k in range(pieces):
        a = complex(math.cos(begin + k * step), math.sin(begin + k * step))
        b = complex(math.cos(begin + (k + 1) * step), math.sin(begin + (k + 1) * step))
        last_point = end if k == pieces - 1 else placed(b)
        yield PathPiece("C", (placed(a + handle * 1j * a), placed(b - handle * 1j * b), last_point))
