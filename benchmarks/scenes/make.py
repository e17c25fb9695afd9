"""Writes wheels.mov, the scene of the rendering benchmark, for any number of frames.

Five 200x200 sprites with soft edges travel and turn over a 600x400 canvas, five 7-pixel lines join their centres in a
ring: positions and angles are expressions of time, 240 frames are one turn.
"""

from __future__ import annotations

import math
import sys
from fractions import Fraction
from pathlib import Path

FPS = 25
WIDTH, HEIGHT = 600, 400
SPRITES = 5


def script(frames: int, sprites: str = "sprites") -> str:
    """The text of the scene; ``sprites`` is the pictures' folder as seen from the script's."""
    lines = [
        "// Five turning wheels, five lines between them; written by make.py.",
        f".config({FPS}, {WIDTH}, {HEIGHT}) .background('#fafaf5');",
        "",
    ]
    lines += [f"S{i} : '{sprites}/wheel{i}.png'  C = [100, 100];" for i in range(SPRITES)]
    lines += [f"L{i} : .line S{i}.C S{(i + 1) % SPRITES}.C .width(7) .color('#282832');" for i in range(SPRITES)]
    lines.append("\n@0")
    turn = f"{360 * FPS / 240:g}*.t"
    for i in range(SPRITES):
        phase = math.degrees(i)
        x = f"{WIDTH * (0.2 + 0.15 * i):.10g} + 40*.sin({turn} + {phase!r})"
        y = f"{HEIGHT * 0.5:g} - {HEIGHT * 0.22:.10g}*.cos({1 + i % 2}*{turn} + {1.3 * phase!r})"
        lines.append(f"    S{i}.C = [{x}, {y}];")
        lines.append(f"    S{i}.angle = -({1 + i % 3}*{turn} + {0.3 * phase!r});")
    lines.append(f"@{Fraction(frames - 1, FPS) if frames == 1 else (frames - 1) / FPS!r}")
    return "\n".join(lines) + "\n"


def wheels(folder: Path) -> None:
    """Draw the sprites into ``folder``, unless they are there."""
    if all((folder / f"wheel{i}.png").exists() for i in range(SPRITES)):
        return
    from PIL import Image, ImageDraw

    folder.mkdir(parents=True, exist_ok=True)
    size, fine = 200, 8
    big = size * fine
    shades = [(205, 70, 55), (60, 135, 220), (75, 170, 95), (235, 175, 50), (145, 95, 195)]
    for i, shade in enumerate(shades):
        mask = Image.new("L", (big, big), 0)
        draw = ImageDraw.Draw(mask)
        draw.ellipse((4 * fine, 4 * fine, big - 4 * fine, big - 4 * fine), fill=255)
        draw.ellipse((0.19 * big, 0.19 * big, 0.81 * big, 0.81 * big), fill=0)
        for spoke in range(3):
            angle = math.pi * spoke / 3 + 0.2 * i
            x, y = 0.45 * big * math.cos(angle), 0.45 * big * math.sin(angle)
            draw.line((big / 2 - x, big / 2 - y, big / 2 + x, big / 2 + y), fill=255, width=int(0.07 * big))
        ramp = Image.linear_gradient("L").resize((size, size))
        bands = [ramp.point([int(level * (0.65 + 0.35 * v / 255)) for v in range(256)]) for level in shade]
        wheel = Image.merge("RGBA", [*bands, mask.resize((size, size), Image.Resampling.BOX)])
        clear = Image.new("RGBA", (size, size), (0, 0, 0, 0))
        clear.paste(wheel, (0, 0), wheel.getchannel("A").point([0] + [255] * 255))
        clear.save(folder / f"wheel{i}.png")


if __name__ == "__main__":
    here = Path(__file__).resolve().parent
    wheels(here / "sprites")
    (here / "wheels.mov").write_text(script(int(sys.argv[1]) if len(sys.argv) > 1 else 240))
