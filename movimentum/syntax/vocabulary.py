"""The language's own words: functions with their number of arguments, and the suffixes of vectors."""

from __future__ import annotations

from movimentum.things.registry import THING_FLAGS

FUNCTIONS: dict[str, tuple[int, int | None]] = {
    "a": (2, 2),
    "q": (1, 1),
    "i": (1, 1),
    "d": (1, 1),
    "sin": (1, 1),
    "cos": (1, 1),
    "tan": (1, 1),
    "asin": (1, 1),
    "acos": (1, 1),
    "atan": (1, 1),
    "atan2": (2, 2),
    "abs": (1, 1),
    "min": (1, None),
    "max": (1, None),
    "floor": (1, 1),
    "mod": (2, 2),
    "exp": (1, 1),
    "ln": (1, 1),
    "ease": (1, 1),
    "across": (3, 3),
    "along": (3, 3),
    "on": (2, 2),
    "where": (2, 2),
    "gap": (2, 2),
    "roll": (2, 2),
    "point": (2, 2),
    "tangent": (2, 2),
    "curvature": (2, 2),
    "length": (1, 1),
    "mesh": (2, 2),
    "belt": (2, 2),
    "cord": (2, None),
    "mean": (1, 1),
    "rms": (1, 1),
    "range": (1, 1),
    "first": (1, 1),
    "last": (1, 1),
    "at": (2, 2),
    "table": (3, 3),
}
"""Canonical name -> the least and the greatest number of arguments (None: any)."""

WRITTEN = {
    "on": ".on(Pin.P, Curve)",
    "where": ".where(Pin.P, Curve)",
    "gap": ".gap(Roller, Cam)",
    "roll": ".roll(Wheel, Road)",
    "point": ".point(Curve, 0.5)",
    "tangent": ".tangent(Curve, 0.5)",
    "curvature": ".curvature(Curve, 0.5)",
    "length": ".length(Curve)",
    "mesh": ".mesh(Sun, Planet)",
    "belt": ".belt(Motor, Fan)",
    "cord": ".cord(Load.P, Sheave, Hook.P)",
}
"""Functions of things, as they are written."""

SYNONYMS = {"angle": "a", "sqrt": "q", "integral": "i", "differential": "d"}
"""Longer spellings of functions -> canonical names."""

REDUCTIONS = frozenset({"min", "max", "mean", "rms", "range", "first", "last", "at"})
"""Functions that make one value of those in all frames (`.min` and `.max` do of one argument)."""

CLOCKS = ("t", "s", "iv", "T", "pi")
"""Values without arguments."""

VECTOR_MEMBERS = {"x": "x", "y": "y", "z": "z", "l": "l", "length": "l"}
"""Members of any vector -> canonical name."""

THING_MEMBERS = {
    "a": "angle",
    "angle": "angle",
    "opacity": "opacity",
    "red": "red",
    "green": "green",
    "blue": "blue",
    "visible": "visible",
    "layer": "layer",
    "scale": "scale",
}
"""Members of a thing besides its anchors (an anchor of that name takes precedence) -> canonical name."""

ENDING_WORDS = {"crossed": "belt", "grips": "cord"}
"""The words that may stand behind a call, or at the end of its statement -> its function."""

BARE_OPTIONS = THING_FLAGS | {"crossed", "mirrored"}
"""Options that may have no arguments."""
