"""Where the gallery's inversor, lift, quick return, excavator and locomotive are: closed forms of their dimensions."""

from __future__ import annotations

import itertools

import numpy as np

from tests.mechanisms.engine_oracles import slide
from tests.mechanisms.kinematics import (
    Array,
    Columns,
    between,
    body,
    circle_circle,
    ease,
    merge,
    polar,
    still,
)


def points(name: str, **places: Array) -> Columns:
    """Columns of anchors alone."""
    return {f"{name}.{anchor}.{axis}": place[:, k] for anchor, place in places.items() for k, axis in enumerate("xy")}


def hart(t: Array) -> Columns:
    """Bars 240 and 120; O (90, 200), crank 45 about (135, 200). Q is P inverted; the rest follows from the middles."""
    o, e = still((90, 200), t), still((135, 200), t)
    swing = 64 * np.sin(np.pi * t)
    p = e + polar(45, swing)
    q = o + (p - o) * ((240**2 - 120**2) / 4 / ((p - o) ** 2).sum(axis=-1))[:, None]
    a = circle_circle(o, 60, p, 120, +1)
    b, d = 2 * p - a, 2 * o - a
    c = 2 * q - d
    return merge(
        points("Left", A=a, O=o, D=d),
        points("Down", A=a, P=p, B=b),
        points("Up", D=d, Q=q, C=c),
        points("Right", C=c, B=b),
        body("Crank", {"E": (0, 0), "P": (45, 0)}, "E", e, swing),
    )


def scissor_lift(t: Array) -> Columns:
    """Bars 170, foot (95, 50). Of the cylinder's length c: c² = (170/2 cos θ)² + (3 · 170/2 sin θ)²."""
    c = 100 + 90 * (ease(t / 2) - ease((t - 2.5) / 2))
    sine = np.sqrt((c**2 / 170**2 - 0.25) / 2)
    half = np.stack([85 * np.sqrt(1 - sine**2), 85 * sine], axis=-1)
    foot = still((95, 50), t)
    up, right = half * [0, 2], half * [2, 0]
    parts: list[Columns] = [{"c": c}]
    for k in range(3):
        low = foot + k * up
        parts.append(points(f"S[{k + 1}].A", P=low, M=low + half, Q=low + right + up))
        parts.append(points(f"S[{k + 1}].B", P=low + right, M=low + half, Q=low + up))
    top = foot + 3 * up
    parts += [
        points("Platform", L=top + np.array([-40.0, 9.0])),
        points("Roller", O=foot + right),
        points("Roller2", O=top + right),
    ]
    return merge(*parts)


def whitworth(t: Array) -> Columns:
    """Crank 90 about (170, 190), arm about (170, 235), 70 to the rod of 190; the ram is level with the arm's pivot."""
    turn = np.deg2rad(30 - 180 * t)
    axle, pivot = still((170, 190), t), still((170, 235), t)
    pin = axle + polar(90, 30 - 180 * t)
    away = pin - pivot
    unit = away / np.linalg.norm(away, axis=-1)[:, None]
    tail = pivot - 70 * unit
    ram = slide(tail, 190, 235)
    # velocities: the pin's, the arm's angular one, its tail's, the ram's
    pin_rate = 90 * np.pi * np.stack([np.sin(turn), -np.cos(turn)], axis=-1)
    rate = (away[:, 0] * pin_rate[:, 1] - away[:, 1] * pin_rate[:, 0]) / (away**2).sum(axis=-1)
    tail_rate = -70 * rate[:, None] * np.stack([-unit[:, 1], unit[:, 0]], axis=-1)
    v = tail_rate[:, 0] + (235 - tail[:, 1]) * tail_rate[:, 1] / (ram[:, 0] - tail[:, 0])
    return merge(
        body("Gear", {"C": (0, 0), "P": (90, 0)}, "C", axle, 30 - 180 * t),
        points("Pin", O=pin),
        points("Arm", T=tail, Q=pivot, A=pivot + 38 * unit, B=pivot + 142 * unit),
        points("Rod", T=tail, H=ram),
        points("Ram", H=ram),
        points("Dot", O=np.stack([ram[:, 0], 75 + 0.12 * v], axis=-1)),
        {"x": ram[:, 0], "v": v},
    )


def excavator(t: Array) -> Columns:
    """Three triangles, each with a cylinder for a side, and the bucket's four-bar linkage behind the last."""
    knots = np.array([0.0, 1.2, 2.4, 3.4, 4.2, 5.0])

    def eased(*lengths: float) -> Array:
        k = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, 4)
        value = np.array(lengths)
        return value[k] + (value[k + 1] - value[k]) * ease((t - knots[k]) / (knots[k + 1] - knots[k]))

    boom, stick = eased(114, 109, 124, 124, 124, 114), eased(92, 136, 136, 98, 98, 92)
    bucket = eased(100, 125, 158, 158, 100, 100)
    foot, lug = still((195, 180), t), still((233, 146), t)

    def third(first: Array, reach: float, second: Array, length: Array, side: int) -> Array:
        """`circle_circle` with a radius that changes."""
        return np.concatenate(
            [circle_circle(first[[k]], reach, second[[k]], float(length[k]), side) for k in range(len(t))]
        )

    def frame(first: Array, second: Array, drawn: tuple[complex, complex]) -> tuple[Array, Array]:
        """The turn and the shift that take two drawn points to where they are, as complex numbers."""
        p, q = first @ [1, 1j], second @ [1, 1j]
        spin = (q - p) / (drawn[1] - drawn[0])
        return spin / np.abs(spin), p

    def placed(spin: Array, origin: Array, x: float, y: float) -> Array:
        z = origin + spin * complex(x, y)
        return np.stack([z.real, z.imag], axis=-1)

    lift = third(foot, float(np.hypot(104, 60)), lug, boom, +1)
    spin, origin = frame(foot, lift, (0j, 104 + 60j))
    tip, saddle = placed(spin, origin, 230, 72), placed(spin, origin, 112, 100)
    rear = third(tip, 52.0, saddle, stick, -1)
    spin2, origin2 = frame(tip, rear, (0j, 52j))
    knee, joint, wrist = (placed(spin2, origin2, x, y) for x, y in ((22, 14), (6, -118), (0, -150)))
    nose = third(joint, 40.0, knee, bucket, -1)
    pull = circle_circle(nose, 48.0, wrist, float(np.hypot(30, 6)), +1)
    return merge(
        points("Boom", O=foot, L=lift, T=tip, U=saddle),
        points("Stick", T=tip, R=rear, K=knee, J=joint, W=wrist),
        points("Rocker", J=joint, N=nose),
        points("Link", N=nose, Z=pull),
        between("Bucket", {"W": (0, 0), "Z": (30, 6), "D": (-52, -58)}, "W", wrist, "Z", pull),
        {"boom": boom, "stick": stick, "bucket": bucket},
    )


def locomotive(t: Array) -> Columns:
    """Three wheels that turn alike, cranks 26, a quarter of a turn apart; main rods 205 from the middle wheels."""
    angle = -180 * t
    parts: list[Columns] = []
    axles = [still((100 + 112 * k, 82), t) for k in range(3)]
    drawn = {"C": (0.0, 0.0), "N": (26.0, 0.0), "F": (0.0, 26.0)}
    for k, axle in enumerate(axles):
        parts.append(body(f"Wheel[{k}]", drawn, "C", axle, angle))
    for side, lead in (("Near", 0), ("Far", 90)):
        pins = [axle + polar(26, lead + angle) for axle in axles]
        head = slide(pins[1], 205, 82)
        parts.append(points(f"{side}.Coupling", A=pins[0], B=pins[1], C=pins[2]))
        parts.append(points(f"{side}.Main", B=pins[1], H=head))
        parts.append(points(f"{side}.Piston", H=head))
    return merge(*parts)


def tackle(t: Array) -> Columns:
    """Sheaves of 22 and 36, the upper ones about (140, 430); a winch of 28 at (320, 80) takes in. How high the lower
    ones are is found by halving; wheels turn by what passes over them.
    """
    centres = [(162.0, 510.0), (140.0, 0.0), (140.0, 430.0), (140.0, 0.0), (140.0, 430.0), (320.0, 80.0)]
    radii = [0.0, 22.0, 22.0, 36.0, 36.0, 28.0]
    wound = np.radians(270.0 * (1.0 - np.cos(np.radians(72.0 * t)))) * radii[-1]

    def parts(y: Array) -> tuple[list[Array], list[Array], list[Array]]:
        """The straight parts' lengths and directions, and the arcs between them."""
        places = [np.stack([0 * y + x, y if low == 0.0 else 0 * y + low], axis=1) for x, low in centres]
        straight, direction = [], []
        for n, away in enumerate(b - a for a, b in itertools.pairwise(places)):
            far, lower = np.hypot(*away.T), radii[n] - radii[n + 1]
            straight.append(np.sqrt(far**2 - lower**2))
            direction.append(np.arctan2(away[:, 1], away[:, 0]) - np.arcsin(lower / far))
        turns = [np.mod(a - b, 2 * np.pi) for a, b in itertools.pairwise(direction)]
        return straight, direction, [r * turn for r, turn in zip(radii[1:], turns, strict=False)]

    low, high = 0 * t + 60.0, 0 * t + 350.0
    for _ in range(60):
        middle = (low + high) / 2
        straight, _, arcs = parts(middle)
        long = sum(straight) + sum(arcs) + wound > 1862.5
        low, high = np.where(long, middle, low), np.where(long, high, middle)
    found: Columns = {}
    (straight, direction, arcs), (straight0, direction0, arcs0) = parts(low), parts(0 * t + 170.0)
    for n, name in enumerate(("Low2", "High2", "Low", "High"), 1):
        passed = sum(straight[:n]) + sum(arcs[: n - 1]) - sum(straight0[:n]) - sum(arcs0[: n - 1])
        turn = np.degrees(passed / radii[n] + direction[n - 1] - direction0[n - 1])
        place = np.stack([0 * t + 140.0, low if centres[n][1] == 0.0 else 0 * t + 430.0], axis=1)
        found |= body(name, {"O": (0, 0), "P": (0, 28 if radii[n] == 36.0 else 15)}, "O", place, turn)
    hung = np.stack([0 * t + 140.0, low - 75.0], axis=1)
    found |= points("Shaft", A=hung + np.array([0, 75]), B=hung) | points(
        "Load", A=hung - np.array([42, 0]), C=hung + np.array([42, -50])
    )
    return found | body("Winch", {"O": (0, 0), "P": (0, 21)}, "O", still((320, 80), t), -np.degrees(wound / 28.0))
