"""Anchor escapements, generated, with their truth in closed form, at any place, turn and scale.

A wheel with pointed teeth (tips at the radius 100) stands below the axis of an anchor with two pallets. The wheel is
drawn round clockwise, the anchor swings by a cosine. Angles are in degrees, anticlockwise from the x axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.pushing.scripts import Place, polygon

RADIUS = 100.0
LOCK = 0.8
"""Degrees of the anchor: by so much a tooth is held beyond the corner of its pallet when the anchor hangs straight."""


def _round(centre: tuple[float, float], radius: float, angle: float) -> tuple[float, float]:
    """A point about a centre."""
    a = math.radians(angle)
    return centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)


@dataclass(frozen=True)
class Pallet:
    """A pallet in the anchor's frame, by radius and angle about the axis: the face on which teeth rest goes from
    ``back`` to the corner ``lock``, the face that they push along from there to ``tip``.
    """

    back: tuple[float, float]
    lock: tuple[float, float]
    tip: tuple[float, float]
    behind: tuple[float, float]


@dataclass(frozen=True)
class Escapement:
    """An escapement whose pallets are ``span`` and a half teeth apart. ``dead``: the faces on which teeth rest are
    arcs about the anchor's axis (Graham's); else each pallet has one straight face, which drives the wheel back as the
    anchor swings on (the recoil of the anchor).
    """

    teeth: int
    span: int
    swing: float = 6.0
    dead: bool = True
    speed: float = 2000.0

    @property
    def pitch(self) -> float:
        """From tooth to tooth."""
        return 360.0 / self.teeth

    @property
    def half(self) -> float:
        """Half the angle between the pallets, as the wheel sees it."""
        return (self.span + 0.5) * 180.0 / self.teeth

    @property
    def far(self) -> float:
        """From axis to axis: the pallets' middle is where tangents of the wheel meet the axis."""
        return RADIUS / math.cos(math.radians(self.half))

    def pallets(self) -> tuple[Pallet, Pallet]:
        """The one where teeth come in, and the one where they go out."""
        middle = RADIUS * math.tan(math.radians(self.half))
        w = 0.4417 * RADIUS * math.pi / self.teeth  # half of a pallet: a little less than half a tooth on both
        outer, inner = middle + w, middle - w
        entry, exit_ = 180.0 + self.half, -self.half
        tip = 30.0 / self.teeth
        if self.dead:
            return (
                Pallet((outer, entry - 16.0), (outer, entry - LOCK), (inner, entry + tip), (inner, entry - 16.0)),
                Pallet((inner, exit_ + 16.0), (inner, exit_ + LOCK), (outer, exit_ - tip), (outer, exit_ + 16.0)),
            )
        # one straight face, of which the corner is a point like any other
        one = Pallet(
            (outer + 0.6 * w, entry - 12.0), (outer, entry - LOCK), (inner, entry + tip), (inner - 6.0, entry - 14.0)
        )
        other = Pallet(
            (inner - 0.6 * w, exit_ + 12.0), (inner, exit_ + LOCK), (outer, exit_ - tip), (outer + 6.0, exit_ + 14.0)
        )
        return one, other

    # --- the script

    def wheel_points(self, phase: float) -> list[tuple[float, float]]:
        """Round the wheel: each tooth's tip, and the two ends of the gap behind it. They lean forward."""
        deep = RADIUS - max(26.0, 540.0 / self.teeth)
        places = [(RADIUS, 0.0), (deep, 0.95 * self.pitch), (deep, 1.25 * self.pitch)]
        return [_round((0.0, 0.0), r, phase + self.pitch * k + a) for k in range(self.teeth) for r, a in places]

    @property
    def phase(self) -> float:
        """Where a tooth is at first: a little before it rests on the first pallet."""
        return 90.0 + self.seen(self.swing, 0) + 0.05 * self.pitch

    def text(self, place: Place, periods: float, fps: float = 25.0) -> str:
        """The script: a swing to and fro in each time unit."""
        axis = (0.0, self.far)
        hub = [_round(axis, 12.0, 270.0), _round(axis, 12.0, 90.0)]
        parts: list[str] = []
        for name, pallet, ends in zip(("Entry", "Exit"), self.pallets(), (hub, hub[::-1]), strict=True):
            lock, tip, behind, back = (
                _round(axis, *each) for each in (pallet.lock, pallet.tip, pallet.behind, pallet.back)
            )
            points = [lock, tip, behind, *ends, back] if self.dead else [tip, behind, *ends, back]
            arc = ""
            if self.dead:
                radius = pallet.lock[0] * place.scale * place.sense * (1.0 if name == "Entry" else -1.0)
                arc = f".arcto(P0, {radius:.14g})"
            parts.append(polygon(name, axis, points, place)[:-1] + arc + ";")
        return f"""
            .config({fps}, 400, 300);
            {polygon("Wheel", (0.0, 0.0), self.wheel_points(self.phase), place)}
            {" ".join(parts)}
            @0 Entry.O = {place.said(*axis)};  Entry.angle = {place.sense * self.swing:.14g}*(.cos(360*.t));
               Exit.O = {place.said(*axis)};   Exit.angle = Entry.angle;
               Wheel.O = {place.said(0.0, 0.0)};
               Wheel.angle ~ .{"least" if place.sense > 0.0 else "most"} .weak .speed({self.speed:.14g});
               .gap(Entry, Wheel) >= 0 .pushes;  .gap(Exit, Wheel) >= 0 .pushes;
            @{periods:g}
        """

    # --- the truth

    def anchor(self, times: np.ndarray) -> np.ndarray:
        """How far the anchor is turned."""
        return self.swing * np.cos(2.0 * math.pi * times)

    def seen(self, turned: float, which: int) -> float:
        """How far from the line of axes a tooth's tip is that rests on pallet ``which`` (0: entry, 1: exit), the anchor
        being ``turned``: where the wheel's circle meets the face.
        """
        pallet = self.pallets()[which]
        if self.dead:
            r = pallet.lock[0]
            return math.degrees(math.acos((RADIUS**2 + self.far**2 - r**2) / (2.0 * RADIUS * self.far)))
        axis = (0.0, self.far)
        a, b = (np.array(_round(axis, r, angle + turned)) for r, angle in (pallet.back, pallet.tip))
        way = (b - a) / np.hypot(*(b - a))
        normal = np.array([-way[1], way[0]])
        distance = float(normal @ a)
        about = math.degrees(math.atan2(normal[1], normal[0]))
        wide = math.degrees(math.acos(distance / RADIUS))
        # of the two meetings, the one on this pallet's side
        away = [(about + s * wide - 90.0 + 180.0) % 360.0 - 180.0 for s in (-1.0, 1.0)]
        sides = [x if which == 0 else -x for x in away]
        return min((x for x in sides if x > 0.0), key=lambda x: abs(x - self.half))

    def resting(self, times: np.ndarray) -> np.ndarray:
        """The wheel's turn, positive as it goes, where a tooth rests on a pallet and the anchor has swung far beyond
        the drop: from 0.6 of its swing on, until it comes back there; nan elsewhere. A tooth rests on the entry first.
        """
        found = np.full(len(times), np.nan)
        theta = self.anchor(times)
        for k, (time, turned) in enumerate(zip(times, theta, strict=True)):
            count = math.floor(time + 0.5) if turned > 0.0 else math.floor(time)
            if abs(turned) < 0.6 * self.swing or time < 0.02:
                continue
            if turned > 0.0:
                place = 90.0 + self.seen(float(turned), 0)
                ahead = 0.0
            else:
                place = 90.0 - self.seen(float(turned), 1)
                between = (90.0 + self.seen(self.swing, 0) - (90.0 - self.seen(-self.swing, 1))) % self.pitch
                ahead = between - (90.0 + self.seen(self.swing, 0) - (90.0 - self.seen(-self.swing, 1)))
            # the tooth that rests is the one that is there, up to whole teeth
            found[k] = self.phase - place + (0.0 if turned > 0.0 else ahead) + count * self.pitch
        return found
