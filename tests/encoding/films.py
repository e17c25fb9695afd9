"""Short animations to write."""

from fractions import Fraction

import numpy as np

from movimentum.rendering.painter import PaintSession
from tests.rendering.scenes import disc_file, pixels, poses, scene, thing

FPS = Fraction(25)


def moving(tmp_path, frames=40, rest=True, **fields):
    """A turning sprite and a swinging bar; some frames alike."""
    made = scene(
        thing("sprite", image=disc_file(tmp_path / "d.png", 40)),
        thing("bar", (0, 0), (40, 0), color=(10, 20, 90), width=6.0),
        **fields,
    )
    t = np.arange(frames, dtype=float)
    if rest:
        t[5:12] = t[5]  # nothing moves for a while
        t[28:33] = t[28]  # across the border of two runs
    sprite = np.stack([5 + t, 10 + 0.3 * t, 7.3 * t], axis=1)
    bar = np.stack([50 + 0 * t, 40 + 0 * t, 11 * t], axis=1)
    return made, poses(sprite, bar)


def bars_only(frames=12):
    made = scene(thing("bar", (0, 0), (40, 0), color=(10, 20, 90), width=6.0))
    return made, poses([[50, 40, 13 * k] for k in range(frames)])


def composed(painter, where):
    return [pixels(image) for image in PaintSession(painter).frames(where)]
