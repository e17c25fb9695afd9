"""Numbers, colours and places as the page of a film has them."""

from __future__ import annotations

from typing import Any

from movimentum.geometry import Affine


def matrix(place: Affine) -> list[float]:
    """As a canvas takes it: by columns."""
    return [nine_digits(value) for value in (place.a, place.d, place.b, place.e, place.c, place.f)]


def nine_digits(value: Any) -> Any:
    """A number with nine digits, which is more than the poses have; whole ones without a point. (A living figure's
    stays what it is.)
    """
    if not isinstance(value, float | int):
        return value
    if -1e9 < value < 1e9 and (whole := int(value)) == value:
        return whole
    rounded = float(f"{value:.9g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded


def css(color: tuple[int, int, int]) -> str:
    """A colour as style sheets write it."""
    return "#" + "".join(f"{value:02x}" for value in color)
