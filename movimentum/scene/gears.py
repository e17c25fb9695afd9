"""Where the teeth of gears and racks are: what equations between them and their pictures must agree on."""

from __future__ import annotations

import math

from movimentum.scene.model import Thing

PRESSURE_ANGLE = 20.0
"""Degrees, of all teeth."""


def pitch_radius(thing: Thing) -> float:
    """The radius of a gear's pitch circle, in world pixels."""
    assert thing.module is not None
    assert thing.teeth is not None
    return thing.module * thing.teeth / 2.0


def tooth_direction(thing: Thing) -> float:
    """Where a tooth of a gear is centred: degrees about its first anchor, in its local frame (as drawn).

    It is the direction to its second anchor, or that of x. A ring has a tooth there, too, which points inwards. Of a
    rack: the direction in which it runs, from its first anchor (where a tooth is centred) to its second; its teeth are
    on the left.
    """
    if len(thing.anchors) < 2:
        return 0.0
    (x, y), (u, v) = thing.anchors[0].local, thing.anchors[1].local
    return math.degrees(math.atan2(v - y, u - x)) if (x, y) != (u, v) else 0.0
