"""Themes: the looks that definitions leave open. Some are built in, others come from files."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any, TypeGuard, cast

from movimentum.records import dataclass, field, replace
from movimentum.scene.findings import Findings
from movimentum.source import FarSpan, SourceText
from movimentum.things.colors import color, color_names
from movimentum.things.kind import Color
from movimentum.things.option_rules import OptionForm, OptionRule
from movimentum.things.registry import KINDS

EDGE_WIDTH = 1.6


@dataclass(frozen=True, slots=True)
class Theme:
    """``ink``: of lines, edges and letters; ``paper``: inside pins and supports; ``fills``: of links, in turn;
    ``accent``: of traces and vectors; ``curves``: those of a graph behind its first one, in turn. ``link_width``: the
    breadth of links (None: as suits their lengths). ``kinds``: word of a kind -> option -> value, which definitions
    override; pins of False: it has none. ``name``: its own, or that of its file.
    """

    name: str
    ink: Color
    paper: Color
    fills: tuple[Color, ...]
    accent: Color
    background: Color | None = None
    curves: tuple[Color, ...] = ()
    link_width: float | None = None
    edge_width: float = EDGE_WIDTH
    kinds: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])


_COLORS: tuple[Color, ...] = ((174, 199, 232), (253, 205, 152), (170, 214, 168), (240, 172, 168), (204, 186, 226))
THEMES = {
    "textbook": Theme("textbook", (38, 38, 46), (255, 255, 255), (*_COLORS, (219, 209, 194)), (190, 40, 40)),
    "print": Theme(
        "print",
        (0, 0, 0),
        (255, 255, 255),
        ((236, 236, 236), (206, 206, 206), (250, 250, 250)),
        (0, 0, 0),
        curves=((128, 128, 128), (176, 176, 176), (80, 80, 80)),
    ),
    "dark": Theme(
        "dark",
        (226, 229, 236),
        (30, 32, 38),
        ((74, 118, 173), (184, 120, 62), (82, 140, 92), (168, 80, 82), (124, 100, 168), (128, 120, 108)),
        (255, 186, 96),
        (30, 32, 38),
        ((255, 140, 70), (86, 180, 233), (72, 200, 150), (224, 140, 190)),
    ),
    "blueprint": Theme(
        "blueprint",
        (235, 242, 252),
        (22, 62, 118),
        ((46, 92, 154), (62, 110, 174), (36, 78, 138)),
        (255, 226, 130),
        (22, 62, 118),
        ((255, 200, 90), (150, 220, 255), (160, 235, 190), (255, 170, 160)),
    ),
}
"""The themes by name."""

SUFFIX = ".theme"
STATED = ("color", "fill", "edge", "width", "dash", "cap", "opacity", "size", "italic", "pins", "layer")
"""Options of things that a file may give to a whole kind."""
_COLOR_KEYS = ("background", "ink", "paper", "accent")
_LISTS = ("fills", "curves")
_WIDTHS = ("link-width", "edge-width")
_KEYS = ("theme", *_COLOR_KEYS, *_LISTS, *_WIDTHS)


def read_theme(file: SourceText, findings: Findings) -> Theme | None:
    """The theme that a file states, in TOML; all that is wrong with it is reported at its place in the file."""
    import tomllib  # few scripts have a theme of their own

    try:
        said = tomllib.loads(file.text.replace("\r\n", "\n"))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        place = re.search(r" \(at line (\d+), column \d+\)", str(error))
        line = int(place[1]) if place else len(file.text.splitlines()) or 1
        message = re.sub(r" \(at .*\)$", "", str(error))
        helps = ("a theme has lines such as `ink = 'navy'` and sections such as `[label]`: it is written in TOML",)
        findings.error("theme/syntax", f"the theme cannot be read: {message.lower()}", _line(file, line), helps=helps)
        return None
    before = findings.errors
    reader = _ThemeFile(file, findings)
    theme = reader.theme(said)
    return theme if findings.errors == before else None


def rules_of(word: str) -> dict[str, OptionRule]:
    """The options that a file may give to a kind, by name."""
    return {rule.name: rule for rule in KINDS[word].options if rule.name in STATED and rule.form in _READERS}


class _ThemeFile:
    def __init__(self, file: SourceText, findings: Findings) -> None:
        self.file, self.findings = file, findings

    def theme(self, said: Mapping[str, Any]) -> Theme:
        base = THEMES["textbook"]
        if "theme" in said:
            name = said["theme"]
            if isinstance(name, str) and name in THEMES:
                base = THEMES[name]
            else:
                self._wrong("", "theme", f"`theme` is one of {_listed(THEMES)}")
        found: dict[str, Any] = {}
        kinds: dict[str, Mapping[str, Any]] = {}
        for key, value in said.items():
            if isinstance(value, dict):
                kinds[key] = self._kind(key, cast(dict[str, Any], value))
            elif key in _COLOR_KEYS:
                found[key] = self.color("", key, value)
            elif key in _LISTS:
                found[key] = self._colors(key, value)
            elif key in _WIDTHS:
                found[key.replace("-", "_")] = self.number("", key, value)
            elif key != "theme":
                self._unknown("", key, _KEYS, f"a theme has no `{key}`")
        return replace(base, name=self.file.path, kinds=kinds, **found)

    def _kind(self, word: str, said: Mapping[str, Any]) -> dict[str, Any]:
        if word not in KINDS:
            self._unknown(word, "", KINDS, f"there is no kind of thing called `{word}`")
            return {}
        rules, found = rules_of(word), dict[str, Any]()
        for key, value in said.items():
            if key in rules:
                found[key] = _READERS[rules[key].form](self, word, key, value)
            else:
                self._unknown(word, key, rules, f"`[{word}]` has no `{key}`")
        return found

    def _unknown(self, section: str, key: str, known: Iterable[str], message: str) -> None:
        guess = self.findings.nearest(key or section, known)
        help_ = f"did you mean `{guess}`?" if guess else f"there is {_listed(known)}"
        self._wrong(section, key, message, help_, code="theme/unknown")

    def _wrong(self, section: str, key: str, message: str, *helps: str, code: str = "theme/value") -> None:
        self.findings.error(code, message, _span(self.file, section, key), helps=helps)

    def color(self, section: str, key: str, value: object) -> Color | None:
        found = color(value) if isinstance(value, str) else None
        if found is None:
            guess = self.findings.nearest(value.lower(), color_names()) if isinstance(value, str) else None
            help_ = f"did you mean '{guess}'?" if guess else "write a CSS colour name, '#rgb' or '#rrggbb'"
            self._wrong(section, key, f"`{key}` is a colour, in quotes", help_)
        return found

    def _colors(self, key: str, value: object) -> tuple[Color, ...]:
        if not isinstance(value, list) or not value:
            self._wrong("", key, f"`{key}` is a list of colours", f"write `{key} = ['steelblue', 'tan']`")
            return ()
        items: list[object] = list(cast(list[object], value))
        found = [self.color("", key, item) for item in items]
        return tuple(item for item in found if item is not None)

    def number(self, section: str, key: str, value: object) -> float | None:
        if not _is_number(value) or value <= 0.0:
            self._wrong(section, key, f"`{key}` is a number greater than 0, in pixels")
            return None
        return float(value)

    def layer(self, section: str, key: str, value: object) -> float | None:
        if not _is_number(value):
            self._wrong(section, key, f"`{key}` is a number")
            return None
        return float(value)

    def part(self, section: str, key: str, value: object) -> float | None:
        if not _is_number(value) or not 0.0 <= value <= 1.0:
            self._wrong(section, key, f"`{key}` is a number from 0 (clear) to 1 (opaque)")
            return None
        return float(value)

    def dash(self, section: str, key: str, value: object) -> tuple[float, ...]:
        items = list(cast(list[object], value)) if isinstance(value, list) else []
        lengths = [float(item) for item in items if _is_number(item) and item > 0.0]
        if not 0 < len(lengths) == len(items) <= 8:
            self._wrong(section, key, f"`{key}` is a list of up to 8 lengths, of dashes and gaps in turn, in pixels")
        return tuple(lengths if len(lengths) % 2 == 0 else 2 * lengths)

    def word(self, section: str, key: str, value: object) -> str | None:
        words = rules_of(section)[key].words
        if not isinstance(value, str) or value not in words:
            self._wrong(section, key, f"`{key}` is one of {_listed(words)}")
            return None
        return value

    def flag(self, section: str, key: str, value: object) -> bool:
        if not isinstance(value, bool):
            self._wrong(section, key, f"`{key}` is true or false")
        return value is True

    def pins(self, section: str, key: str, value: object) -> float | bool | None:
        return value if isinstance(value, bool) else self.number(section, key, value)


_READERS = {
    OptionForm.COLOR: _ThemeFile.color,
    OptionForm.POSITIVE: _ThemeFile.number,
    OptionForm.NUMBER: _ThemeFile.layer,
    OptionForm.OPACITY: _ThemeFile.part,
    OptionForm.DASH: _ThemeFile.dash,
    OptionForm.CHOICE: _ThemeFile.word,
    OptionForm.FLAG: _ThemeFile.flag,
    OptionForm.PINS: _ThemeFile.pins,
}


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _listed(words: Iterable[str]) -> str:
    return ", ".join(f"`{word}`" for word in words)


def _line(file: SourceText, number: int) -> FarSpan:
    lines = max(1, len(file.text.splitlines()))
    start = file.line_start(min(number, lines))
    return FarSpan(start, start + max(1, len(file.line(min(number, lines)))), file)


def _span(file: SourceText, section: str, key: str) -> FarSpan:
    """Where a key of a section (``""``: of the file) is; without a key, where the section begins."""
    here, begin = "", 1
    for number, line in enumerate(file.text.splitlines(), 1):
        head = re.match(r"\s*\[\s*[\"']?([^\]\"']*?)[\"']?\s*\]", line)
        if head:
            here = head[1]
            begin = number if here == section else begin
        if here == section and key and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
            return _line(file, number)
    return _line(file, begin)
