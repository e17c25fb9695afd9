"""The outlines of gears and racks: involute teeth, whose points lie on the true curve.

A tooth's flank is the involute of the base circle, so a tooth is ``2 (pi / (2 z) + inv 20° - inv a)`` wide (radians)
where ``cos a = base radius / r``. Below the base circle, where there is no involute, flanks are radial.
"""

from __future__ import annotations

import math

from movimentum.drawing.figure_outlines import Point, circle
from movimentum.outlines.shapes import tip_radius
from movimentum.scene.model import Thing
from movimentum.things.kinds.toothed import ADDENDUM, DEDENDUM, PRESSURE_ANGLE, RIM, rack_corners

_FLANK = 8  # points of a flank


def gear_outline(thing: Thing) -> tuple[tuple[Point, ...], tuple[tuple[Point, ...], ...]]:
    """The outline of a gear in its local frame, counter-clockwise, and its holes (a ring has one)."""
    gear = thing.toothed
    centre, radius, module = thing.anchors[0].local, gear.pitch_radius, gear.module
    direction = math.radians(thing.tooth_direction)
    if not gear.inner:
        return _around(centre, _tooth(gear.teeth, radius, module), gear.teeth, direction), ()
    # the gaps of a ring have the shape of a gear's teeth
    gap = _tooth(gear.teeth, radius, module, DEDENDUM, ADDENDUM)
    toothed = _around(centre, gap, gear.teeth, direction + math.pi / gear.teeth)
    rim = tuple(circle(centre, radius + (DEDENDUM + RIM) * module)[:-1])
    return rim, (toothed[::-1],)


def _tooth(
    teeth: int, radius: float, module: float, addendum: float = ADDENDUM, dedendum: float = DEDENDUM
) -> list[tuple[float, float]]:
    """One tooth and the root behind it, as (radius, angle from the tooth's middle), by growing angle."""
    base = radius * math.cos(math.radians(PRESSURE_ANGLE))
    pitch = math.pi / teeth

    def half(r: float) -> float:
        """Half the tooth's angle at a radius; below the base circle as on it."""
        return min(pitch / 2.0 + _involute(PRESSURE_ANGLE) - _involute(_angle(base, r)), 0.98 * pitch)

    root = max(radius - dedendum * module, 0.1 * module)
    tip = tip_radius(half, radius, radius + addendum * module)
    low = max(base, root)
    # equal steps of the angle that the taut string has turned through
    turn_low, turn_tip = (math.sqrt(max((r / base) ** 2 - 1.0, 0.0)) for r in (low, tip))
    turns = [turn_low + (turn_tip - turn_low) * k / (_FLANK - 1) for k in range(_FLANK)]
    radii = ([root] if root < base else []) + [base * math.sqrt(1.0 + turn * turn) for turn in turns]
    rising = [(r, -half(r)) for r in radii]
    falling = [(r, -angle) for r, angle in reversed(rising)]
    top = _between(tip, rising[-1][1], falling[0][1])
    bottom = _between(root, falling[-1][1], 2.0 * pitch - falling[-1][1])
    return [*rising, *top, *falling, *bottom]


def _between(radius: float, begin: float, end: float) -> list[tuple[float, float]]:
    """Points of an arc strictly between its ends, close enough to look round."""
    count = max(1, math.ceil((end - begin) / math.radians(4.0)))
    return [(radius, begin + (end - begin) * k / count) for k in range(1, count)]


def _around(centre: Point, tooth: list[tuple[float, float]], teeth: int, direction: float) -> tuple[Point, ...]:
    found: list[Point] = []
    for number in range(teeth):
        turn = direction + 2.0 * math.pi * number / teeth
        found += [
            (centre[0] + r * math.cos(turn + angle), centre[1] + r * math.sin(turn + angle)) for r, angle in tooth
        ]
    return tuple(found)


def _angle(base: float, radius: float) -> float:
    """The pressure angle at a radius, in degrees; 0 below the base circle."""
    return math.degrees(math.acos(min(1.0, base / radius)))


def _involute(degrees: float) -> float:
    """tan a - a."""
    angle = math.radians(degrees)
    return math.tan(angle) - angle


def rack_outline(thing: Thing) -> tuple[Point, ...]:
    """The outline of a rack in its local frame, counter-clockwise: straight flanks, its teeth on the left."""
    (x, y), turn = thing.anchors[0].local, math.radians(thing.tooth_direction)
    c, s = math.cos(turn), math.sin(turn)
    corners = rack_corners(thing.toothed.teeth, thing.toothed.module)
    return tuple((x + c * u - s * v, y + s * u + c * v) for u, v in corners)
