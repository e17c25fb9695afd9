"""Transformable Penrose tilings as scripts, placed elsewhere than they are drawn."""

from __future__ import annotations

from functools import cache

from benchmarks.penrose import transformable
from movimentum.interop.linkages import linkage_script
from tests.families.scattered import number, vector


@cache
def _linkage(order: int):
    return transformable(order)


def tiling_script(order: int) -> tuple[str, list[tuple[str, str, complex]]]:
    """The script, and every rod's ends (thing, anchor, place as drawn); the first is the vertex to place."""
    linkage = _linkage(order)
    points = [(f"R{i}_{k}", f"V{end}", complex(*linkage.vertices[end])) for i, k in linkage.rods for end in (i, k)]
    return linkage_script(linkage, "a tiling"), points


def at_another_place(order: int, turn: float | None, shift: complex) -> str:
    """Statements that place the first vertex ``shift`` away from where it is drawn, and turn its rod (None: nothing is
    said of that).
    """
    linkage = _linkage(order)
    i, k = linkage.rods[0]
    text = f"\nR{i}_{k}.V{i} = {vector(complex(*linkage.vertices[i]) + shift)};\n"
    return text if turn is None else text + f"R{i}_{k}.angle = {number(turn)};\n"
