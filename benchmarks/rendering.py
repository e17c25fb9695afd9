"""The picture alone, from a cold process: five turning 200 x 200 sprites and five bars on 600 x 400, poses given.

::

    python benchmarks/rendering.py                        # ours: serial, two processes, bars only, other formats
    python benchmarks/rendering.py REFERENCE.py           # the same beside another program, interleaved:
                                                          # it is called as REFERENCE.py OUT.gif FRAMES PROCESSES

Nothing of the language or the solver is in it; the end-to-end figures are in ``end_to_end.py``.
"""

from __future__ import annotations

import sys
import tempfile
from fractions import Fraction
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

WIDTH, HEIGHT, TURN = 600, 400, 240
COLORS = ((220, 60, 50), (60, 140, 230), (70, 180, 90), (240, 180, 40), (150, 90, 200))


def wheel(color, turned):
    """A 200 x 200 wheel with three straight spokes through its hub, shaded from top to bottom."""
    import math

    from PIL import Image, ImageDraw

    size, fine = 200, 1600
    mask = Image.new("L", (fine, fine), 0)
    draw = ImageDraw.Draw(mask)
    draw.ellipse((32, 32, fine - 32, fine - 32), fill=255)
    draw.ellipse((fine * 0.2, fine * 0.2, fine * 0.8, fine * 0.8), fill=0)
    for spoke in range(3):
        angle = math.pi * spoke / 3 + turned
        dx, dy = math.cos(angle) * fine * 0.45, math.sin(angle) * fine * 0.45
        middle = fine / 2
        draw.line((middle - dx, middle - dy, middle + dx, middle + dy), fill=255, width=round(fine * 0.07))
    ramp = Image.linear_gradient("L").resize((size, size))
    shaded = [ramp.point([int(channel * (0.65 + 0.35 * v / 255)) for v in range(256)]) for channel in color]
    return Image.merge("RGBA", [*shaded, mask.reduce(8)])


def scene_and_poses(folder, frames, sprites):
    """The scene as the scene stage would hand it over, and its poses."""
    import numpy as np

    from movimentum.scene.model import Anchor, AnchorRef, Config, Scene, Thing
    from movimentum.solver.poses import Poses
    from movimentum.source import SourceText, Span
    from movimentum.things.kind import Look
    from movimentum.things.kinds.line import LINE
    from movimentum.things.kinds.sprite import SPRITE, SpriteImage

    nowhere = Span(0, 0)
    t = 2 * np.pi * (np.arange(frames) % TURN) / TURN
    origin, turn = np.zeros((10, frames, 2)), np.zeros((10, frames))
    things = []
    for i in range(5):
        centre = (Anchor("C", (100.0, 100.0), nowhere),)
        path = str(folder / f"wheel{i}.png")
        things.append(
            Thing(
                i,
                f"W{i}",
                SPRITE,
                centre,
                nowhere,
                nowhere,
                own=SpriteImage(path, (200, 200)),
                look=Look(hidden=not sprites),
            )
        )
        turn[i] = -(t * (1 + i % 3) + 0.3 * i)
        x = WIDTH * (0.2 + 0.15 * i) + 40 * np.sin(t + i)
        y = HEIGHT * (0.5 - 0.22 * np.cos(t * (1 + i % 2) + 1.3 * i))
        c, s = np.cos(turn[i]), np.sin(turn[i])
        origin[i] = np.stack([x - 100 * (c - s), y - 100 * (s + c)], axis=1)
    for i in range(5):
        through = (AnchorRef(i, 0), AnchorRef((i + 1) % 5, 0))
        things.append(Thing(5 + i, f"B{i}", LINE, (), nowhere, nowhere, through=through, look=Look(width=7.0)))
    config = Config(Fraction(25), (WIDTH, HEIGHT), (250, 250, 245))
    poses = Poses(
        frames=np.arange(frames),
        times=np.arange(frames) / 25.0,
        origin=origin,
        direction=np.stack([np.cos(turn), np.sin(turn)], axis=-1),
        angle=np.degrees(turn),
        visible=np.ones((10, frames), dtype=bool),
        properties={},
        variables={},
        solved=np.ones(frames, dtype=bool),
    )
    return Scene(SourceText("benchmark", ""), config, tuple(things), {}, ()), poses


def render(out, frames, workers, sprites):
    """What the measured process does."""
    from movimentum.encoding.write import write_animation
    from movimentum.rendering.painter import make_painter

    scene, poses = scene_and_poses(Path(out).parent, frames, sprites)
    painter = make_painter(scene, poses)
    write_animation(painter, poses, Path(out), fps=Fraction(25), workers=workers)


def main(reference, rounds):
    """Measure everything, interleaved, and print medians."""
    from measure import interleaved, machine, table

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for i, color in enumerate(COLORS):
            wheel(color, 0.2 * i).save(folder / f"wheel{i}.png")

        def ours(file, frames, workers, *what):
            return [sys.executable, __file__, "--one", str(folder / file), str(frames), str(workers), *what]

        commands = {
            "GIF, serial": ours("a.gif", 240, 1),
            "GIF, two processes": ours("b.gif", 240, 2),
            "GIF, bars only": ours("c.gif", 240, 1, "bars"),
            "GIF, ten frames, bars only": ours("d.gif", 10, 1, "bars"),
            "first frame as PNG": ours("e.png", 1, 1),
            "APNG, two processes": ours("f.apng", 240, 2),
            "WebP, two processes": ours("g.webp", 240, 2),
        }
        if reference:
            commands["reference GIF, serial"] = [sys.executable, reference, str(folder / "r.gif"), "240", "1"]
            commands["reference GIF, two processes"] = [sys.executable, reference, str(folder / "s.gif"), "240", "2"]
        print(machine())
        interleaved(commands, 1)  # compiles, and fills the disk's cache
        print(table(interleaved(commands, rounds)))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        render(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), "bars" not in sys.argv[5:])
    else:
        main(sys.argv[1] if len(sys.argv) > 1 else None, 5)
