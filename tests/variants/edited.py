"""Scripts of the gallery in which some numbers have become constants that vary."""

from __future__ import annotations

import random
import re
from pathlib import Path

from movimentum.source import SourceText

SCRIPTS = Path(__file__).parents[2] / "scripts"
_NUMBER = re.compile(r"(?<![\w.#'])(\d+(?:\.\d+)?)(?![\w.'\]]*\.\.)(?![\w'])")
_PAINT = re.compile(
    r"\.(width|color|fill|edge|pins|dash|layer|config|disc|tail|velocity|acceleration|range|gear|rack|opacity|size|coils"
    r"|places)\([^)]*\)"
)


def varied(name: str, generator: random.Random, count: int) -> tuple[SourceText, tuple[str, ...]]:
    """The script with ``count`` of its numbers, chosen at random, multiplied by constants that are 1; their names."""
    lines = (SCRIPTS / f"{name}.mov").read_text().split("\n")
    places: list[tuple[int, int, int]] = []
    for number, line in enumerate(lines):
        body = line.split("//")[0]
        if body.lstrip().startswith((".config", ".theme", ".part", ".for", ".include")) or ".for" in body:
            continue
        for pattern in (r"'[^']*'", _PAINT, r"@[^ ]*", r"\[[^\[\],]*\]"):
            body = re.sub(pattern, lambda found: " " * len(found[0]), body)
        found = (each for each in _NUMBER.finditer(body) if float(each[1]) > 0.0)
        places += [(number, each.start(1), each.end(1)) for each in found]
    chosen = sorted(generator.sample(places, min(count, len(places))), reverse=True)
    for k, (number, begin, end) in enumerate(chosen):
        line = lines[number]
        lines[number] = f"{line[:begin]}({line[begin:end]}*vary{k}){line[end:]}"
    names = tuple(f"vary{k}" for k in range(len(chosen)))
    text = "".join(f".let {each} = 1; " for each in names) + "\n".join(lines)
    return SourceText(str(SCRIPTS / f"{name}.mov"), text), names
