"""What an SVG says about how its shapes look: attributes, styles and simple style sheets, inherited."""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree

from movimentum.things.colors import color

Element = ElementTree.Element

INHERITED = frozenset(
    {
        "fill", "fill-opacity", "fill-rule", "stroke", "stroke-width", "stroke-opacity", "stroke-linecap",
        "stroke-linejoin", "stroke-miterlimit", "stroke-dasharray", "stroke-dashoffset", "color", "visibility",
        "clip-rule", "marker", "marker-start", "marker-mid", "marker-end", "paint-order",
    }
)  # fmt: skip
OWN = frozenset(
    {
        "opacity", "display", "clip-path", "filter", "mask", "mix-blend-mode", "transform", "vector-effect",
        "stop-color", "stop-opacity",
    }
)  # fmt: skip
"""What is not inherited."""
PLAIN = {
    "filter": ("none",), "mask": ("none",), "mix-blend-mode": ("normal",), "vector-effect": ("none",),
    "marker": ("none",), "marker-start": ("none",), "marker-mid": ("none",), "marker-end": ("none",),
    "paint-order": ("normal", "fill", "fill stroke", "fill stroke markers"),
}  # fmt: skip
"""Values of properties that change nothing; any other value is more than outlines can show."""
_SELECTOR = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][A-Za-z_][\w-]*)*)")


class NotPlain(Exception):
    """A drawing has something that outlines cannot show; the message says what."""


class Sheet:
    """The rules of a drawing's style sheets."""

    def __init__(self, root: Element) -> None:
        self._rules: list[tuple[tuple[int, int, int], int, str, list[str], dict[str, str]]] = []
        for style in root.iter("{http://www.w3.org/2000/svg}style"):
            self._read("".join(style.itertext()))
        self._rules.sort(key=lambda rule: rule[:2])

    def _read(self, text: str) -> None:
        text = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
        if "@" in text or "!" in text:
            raise NotPlain("a style sheet with `@` or `!`")
        place = 0
        for match in re.finditer(r"\s*([^{}]*)\{([^{}]*)\}\s*", text):
            if match.start() != place:
                break
            place = match.end()
            for selector in match[1].split(","):
                simple = _SELECTOR.fullmatch(selector.strip())
                if simple is None or not selector.strip():
                    raise NotPlain(f"a style sheet with the selector `{selector.strip()[:40]}`")
                names = re.findall(r"[.#][\w-]+", simple[2])
                ids = sum(name[0] == "#" for name in names)
                weight = (ids, len(names) - ids, int((simple[1] or "*") != "*"))
                self._rules.append((weight, len(self._rules), simple[1] or "*", names, _declared(match[2])))
        if text[place:].strip():
            raise NotPlain("a style sheet that is not understood")

    def of(self, element: Element, tag: str) -> dict[str, str]:
        """All that is said about an element itself."""
        known = {"." + name for name in element.get("class", "").split()} | {"#" + element.get("id", "")}
        found = {name: value.strip() for name, value in element.attrib.items() if name in INHERITED | OWN}
        for _, _, kind, names, said in self._rules:
            if kind in ("*", tag) and known.issuperset(names):
                found |= said
        style = _declared(element.get("style", ""))
        if "transform" in style or any("transform" in said for *_, said in self._rules):
            raise NotPlain("a `transform` in a style")
        return found | style


def _declared(text: str) -> dict[str, str]:
    pairs = (each.partition(":") for each in text.split(";"))
    if "!" in text:
        raise NotPlain("a style with `!`")
    return {name.strip().lower(): value.strip() for name, _, value in pairs if name.strip()}


def inherited(above: dict[str, str], said: dict[str, str]) -> dict[str, str]:
    """The style of an element below another one; `NotPlain` for what outlines cannot show."""
    found = dict(above)
    for name, value in said.items():
        if name in PLAIN and value.lower() not in PLAIN[name]:
            raise NotPlain(f"a `{name}`")
        if name in INHERITED and value != "inherit":
            found[name] = value
    return found


def paint_of(value: str, style: dict[str, str]) -> tuple[tuple[int, int, int], float] | None:
    """(colour, opacity) of a paint; None for no paint."""
    value = value.strip()
    if value.lower() in ("none", "transparent"):
        return None
    if value.lower() == "currentcolor":
        value = style.get("color", "black")
    if value.lower().startswith("url("):
        raise NotPlain("a gradient or a pattern as a line")
    found = color(value)
    if found is not None:
        return found, 1.0
    if (digits := re.fullmatch(r"#([0-9a-fA-F]{4}|[0-9a-fA-F]{8})", value)) is not None:
        text = digits[1] if len(digits[1]) == 8 else "".join(2 * digit for digit in digits[1])
        red, green, blue, alpha = (int(text[k : k + 2], 16) for k in (0, 2, 4, 6))
        return (red, green, blue), alpha / 255.0
    if (match := re.fullmatch(r"rgba?\(([^()]*)\)", value, re.IGNORECASE)) is not None:
        parts, mixed = [*_parts(match[1])], match[1].count("%")
        if len(parts) in (3, 4) and mixed in (0, 1, 3, 4) and (mixed != 1 or match[1].rstrip().endswith("%")):
            red, green, blue = (round(255.0 * min(max(part, 0.0), 1.0)) for part in parts[:3])
            return (red, green, blue), parts[3] if len(parts) == 4 else 1.0
    raise NotPlain(f"the colour `{value[:40]}`")


def _parts(text: str) -> Iterator[float]:
    for place, word in enumerate(re.split(r"[\s,/]+", text.strip())):
        try:
            yield float(word[:-1]) / 100.0 if word.endswith("%") else float(word) / (255.0 if place < 3 else 1.0)
        except ValueError as error:
            raise NotPlain(f"the colour `rgb({text[:40]})`") from error


def share_of(style: dict[str, str], name: str) -> float:
    """An opacity from 0 to 1."""
    text = style.get(name, "1")
    try:
        value = float(text[:-1]) / 100.0 if text.endswith("%") else float(text)
    except ValueError as error:
        raise NotPlain(f"the {name} `{text[:40]}`") from error
    return min(max(value, 0.0), 1.0)
