"""Where the gallery's gears are: ratios of teeth; and the Geneva wheel, whose slot holds the crank's pin."""

from __future__ import annotations

import numpy as np

from tests.mechanisms.kinematics import Array, Columns, body, merge, polar, still


def planetary(t: Array) -> Columns:
    """Sun 15, planets 15, ring 45 at rest (Willis): carrier = sun · 15/(15 + 45), planets against it by 45/15."""
    sun = 240 * t
    carrier = sun * 15 / (15 + 45)
    planet = carrier * (1 - 45 / 15)
    axle = still((130, 155), t)
    parts: list[Columns] = [
        body("Ring", {"C": (0, 0)}, "C", axle, 0),
        body("Sun", {"C": (0, 0), "T": (0, 25)}, "C", axle, sun),
        body("Mark", {"O": (0, 0)}, "O", axle + polar(25, 90 + sun), 0),
    ]
    arms: dict[str, tuple[float, float]] = {"O": (0.0, 0.0)}
    for k, name in enumerate("ABD"):
        x, y = polar(72, 90 + 120 * k)
        arms[name] = (float(x), float(y))
        u, v = polar(20, 90 + 120 * k)
        where = axle + polar(72, 90 + 120 * k + carrier)
        parts.append(body(f"Planet[{k}]", {"C": (0, 0), "T": (float(u), float(v))}, "C", where, planet))
    parts.append(body("Carrier", arms, "O", axle, carrier))
    return merge(*parts)


def clockwork(t: Array) -> Columns:
    """8 : 24 and 8 : 32 teeth; the minute hand turns clockwise, 450° a second. They begin with a tooth in a gap."""
    minute = -450 * t
    wheel, hour = -minute / 3, minute / 12
    arbor, other = still((165, 225), t), still((165, 105), t)
    return merge(
        body("Long", {"C": (0, 0), "H": (0, 138)}, "C", arbor, minute),
        body("Short", {"C": (0, 0), "H": (0, 88)}, "C", arbor, hour),
        body("Cannon", {"C": (0, 0)}, "C", arbor, minute),
        body("Hour", {"C": (0, 0)}, "C", arbor, hour),
        body("Wheel", {"C": (0, 0)}, "C", other, wheel),
        body("Pinion", {"C": (0, 0)}, "C", other, wheel),
    )


def geneva_turn(t: Array) -> Array:
    """How far the wheel with four slots is turned: tan = r sin α/(a - r cos α) while the crank is within 45° of the
    line of the axles, and else not at all.
    """
    a, r = 150.0, 150.0 * np.sin(np.pi / 4)
    turns = np.floor(t / 2)
    alpha = np.clip(180 * (t - 2 * turns) - 180, -45, 45)
    radians = np.deg2rad(alpha)
    return 90 * turns + 45 + np.rad2deg(np.arctan2(r * np.sin(radians), a - r * np.cos(radians)))


def geneva_slots(t: Array) -> Columns:
    """Axles (120, 140) and (280, 140); the pin begins where it enters a slot. The wheel is one body with its slots."""
    d, a = 160.0, 160.0 * np.sin(np.pi / 4)
    crank, wheel = 180 * t, -geneva_turn(t + 0.75)  # the other wheel's pin enters at 0.75; a slot's angle has no scale
    drive, axle = still((120, 140), t), still((280, 140), t)
    x, y = polar(a, -45)
    anchors: dict[str, tuple[float, float]] = {"C": (0.0, 0.0)}
    for k in range(4):
        for name, radius, where in (
            (f"Slot[{k}].A", a + 20, 45 + 90 * k),
            (f"Slot[{k}].B", d - a, 45 + 90 * k),
            (f"Bite[{k}].C", d, 90 * k),
        ):
            u, v = polar(radius, where)
            anchors[name] = (float(u), float(v))
    return merge(
        body("Crank", {"O": (0, 0), "P": (float(x), float(y))}, "O", drive, crank),
        body("Pin", {"C": (0, 0)}, "C", drive + polar(a, crank - 45), 0),
        body("Disc", {"C": (0, 0), "Free.C": (d, 0)}, "C", drive, crank - 45),
        body("Wheel", anchors, "C", axle, wheel),
        body("Way", {"O": (0, 0)}, "O", axle, wheel - 135),
    )


def elliptic_gears(t: Array) -> Columns:
    """Half axes 75, foci 37.5 from the middle: of an ellipse about its focus r = p/(1 - ε cos), and the radii to where
    the two touch add up to the distance of the axles, 150; so tan(φ/2) = -(1 + ε)/(1 - ε) tan(θ/2).
    """
    ratio, long = 0.5, 75.0
    left = 180 * t
    turns = np.round(left / 360)  # the half angles of whole turns are where the tangent is nought
    half = np.deg2rad(left / 2 - 180 * turns)
    right = -360 * turns - 2 * np.rad2deg(np.arctan2((1 + ratio) * np.sin(half), (1 - ratio) * np.cos(half)))
    radius = long * (1 - ratio**2) / (1 - ratio * np.cos(np.deg2rad(left)))
    foci = {"F": (0.0, 0.0), "G": (2 * ratio * long, 0.0)}
    return merge(
        body("Left", foci, "F", still((120, 165), t), left),
        body("Right", foci, "F", still((270, 165), t), right),
        {"w": radius / (2 * long - radius)},
    )


def escapement_turn(t: Array) -> Array:
    """How far the escape wheel is turned (degrees). Teeth rest on two arcs about the anchor's axis; the wheel leaves
    one when the corner of its pallet passes the tooth, and runs at 60 degrees a second to the other.
    """
    d = 134.563273  # 100/cos 42; the radii are 100 tan 42 and half a pallet more and less

    def seen(radius: float) -> tuple[float, float]:
        """Of a tooth on the arc: its angle from the line of the axles at the wheel, and at the anchor."""
        wheel = np.arccos((100.0**2 + d**2 - radius**2) / (2 * 100.0 * d))
        return float(np.degrees(wheel)), float(np.degrees(np.arcsin(100.0 * np.sin(wheel) / radius)))

    # at the pallets, from the line of the axles: 48 degrees; their first corners are 0.8 degrees before that
    (entry, entry_seen), (leave, leave_seen) = seen(99.2904), seen(80.7904)
    first, second = 90.0 + entry - 137.507, 90.0 - leave - (137.507 - 72.0)
    released = np.arccos((48.8 - entry_seen) / 7.0) / (2 * np.pi)
    again = 1.0 - np.arccos((leave_seen - 48.8) / 7.0) / (2 * np.pi)
    turns, phase = np.floor(t), t - np.floor(t)
    there = np.maximum(first - 60.0 * np.maximum(phase - released, 0.0), second)
    back = np.maximum(second - 60.0 * np.maximum(phase - again, 0.0), first - 24.0)
    start = np.maximum(-60.0 * t, first)
    return np.where(t < 0.1, start, -24.0 * turns + np.where(phase < again, there, back))
