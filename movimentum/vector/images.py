"""The pictures of a film as data that stand in the file itself, each once."""

from __future__ import annotations

import base64
from collections.abc import Sequence

from movimentum.encoding.pieces import saved
from movimentum.rendering.prepare import PreparedMark
from movimentum.rendering.sprites import Sprite


def embedded(items: Sequence[PreparedMark]) -> tuple[list[tuple[Sprite, str]], dict[int, int]]:
    """The pictures (with their data URIs) of all images among ``items``; and item number -> number of its picture."""
    pictures: list[tuple[Sprite, str]] = []
    known: dict[int, int] = {}
    places: dict[int, int] = {}
    for number, item in enumerate(items):
        sprite = item.sprite
        if sprite is None or sprite.image.mode == "L":  # a text
            continue
        if id(sprite) not in known:
            data = saved(sprite.image.convert("RGBA"), "PNG", optimize=True)
            known[id(sprite)] = len(pictures)
            pictures.append((sprite, f"data:image/png;base64,{base64.b64encode(data).decode('ascii')}"))
        places[number] = known[id(sprite)]
    return pictures, places
