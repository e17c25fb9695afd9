"""Scripts in which something pushes, with their truth in closed form, at any place, turn and scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Place:
    """Where a scene stands: scaled, mirrored in the x axis, turned (degrees) and moved."""

    x: float = 0.0
    y: float = 0.0
    turned: float = 0.0
    scale: float = 1.0
    mirrored: bool = False

    def at(self, x: float, y: float) -> tuple[float, float]:
        """A point of the plain scene."""
        y = -y if self.mirrored else y
        c, s = math.cos(math.radians(self.turned)), math.sin(math.radians(self.turned))
        return self.x + self.scale * (c * x - s * y), self.y + self.scale * (s * x + c * y)

    def said(self, x: float, y: float) -> str:
        """The same, as a script says it."""
        u, v = self.at(x, y)
        return f"[{u:.14g}, {v:.14g}]"

    @property
    def sense(self) -> float:
        """-1 where turns go the other way round."""
        return -1.0 if self.mirrored else 1.0


PLACES = (
    Place(),
    Place(310.5, -42.25),
    Place(turned=33.0),
    Place(scale=0.02),
    Place(scale=40.0),
    Place(12.0, 7.0, 200.0, 3.0, mirrored=True),
)


def polygon(name: str, centre: tuple[float, float], points: Sequence[tuple[float, float]], place: Place) -> str:
    """A polygon with its first anchor, `O`, in the middle."""
    anchors = " ".join(f"P{k} = {place.said(*point)}" for k, point in enumerate(points))
    through = ", ".join(f"P{k}" for k in range(len(points)))
    return f"{name} : .polygon O = {place.said(*centre)} {anchors} .through({through});"


# --- Geneva drives


@dataclass(frozen=True)
class Geneva:
    """A crank with a pin, and a wheel with slots, 100 apart; the slots are broader than the pin by ``play`` on each
    side.
    """

    slots: int
    play: float = 0.0
    pin: float = 3.0
    first: float = -1.9  # of the crank, in radians; it turns by a quarter each time unit

    @property
    def half(self) -> float:
        """Between two slots, half the angle (radians)."""
        return math.pi / self.slots

    @property
    def crank(self) -> float:
        """The pin's distance from its axis."""
        return 100.0 * math.sin(self.half)

    def text(self, place: Place, turns: int = 1, fps: float = 25.0) -> str:
        """The script."""
        radius, breadth = 100.0 * math.cos(self.half), self.pin + self.play
        mouth, bottom = math.sqrt(radius**2 - breadth**2), 100.0 - self.crank - self.pin - 1.0
        points: list[tuple[float, float]] = []
        for k in range(self.slots):
            angle = math.pi + self.half + 2.0 * math.pi * k / self.slots
            c, s = math.cos(angle), math.sin(angle)
            points += [
                (200.0 + c * u - s * v, 100.0 + s * u + c * v)
                for u, v in ((mouth, -breadth), (bottom, -breadth), (bottom, breadth), (mouth, breadth))
            ]
        pin = 100.0 + self.crank * math.cos(self.first), 100.0 + self.crank * math.sin(self.first)
        return f"""
            .config({fps}, 320, 200);
            {polygon("Wheel", (200.0, 100.0), points, place)}
            Crank : .bar O = {place.said(100.0, 100.0)} P = {place.said(*pin)};
            Pin   : .disc({self.pin * place.scale:.14g}) C = {place.said(*pin)};
            @0 Crank.O = {place.said(100.0, 100.0)};  Crank.angle = {90.0 * place.sense}*.t;
               Pin.C = Crank.P;  Pin.angle = 0;  Wheel.O = {place.said(200.0, 100.0)};
               .gap(Pin, Wheel) >= 0 .pushes;
            @{4 * turns}
        """

    def seen(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """At times: the direction of the pin from the wheel (radians, from the line to the crank), how far it is, and
        the number of the turn.
        """
        phi = self.first + 0.5 * math.pi * times
        turn = np.floor((phi + math.pi) / (2.0 * math.pi))
        x, y = self.crank * np.cos(phi) - 100.0, self.crank * np.sin(phi)
        return np.arctan2(y, -x), np.hypot(x, y), turn

    def wheel(self, times: np.ndarray) -> np.ndarray:
        """How far the wheel is turned (degrees), while the pin is deep in a slot, and before and after; nan near the
        mouths. With play, the pin pushes the wall ahead of it, whose distance is known.
        """
        direction, far, turn = self.seen(times)
        phi = self.first + 0.5 * math.pi * times - 2.0 * math.pi * turn
        lag = np.arcsin(np.clip(self.play / far, 0.0, 1.0))
        engaged = np.abs(phi) < 0.5 * math.pi - self.half
        inside = engaged & (far < 100.0 * math.cos(self.half) - 2.0 * self.pin - self.play)
        pushed = -(direction + self.half) + lag  # the wheel turns against the crank
        # until the pin has crossed the play it rests: at 0 first, and afterwards where the pin has left it
        pushed = np.where(pushed <= 0.0, pushed, np.where(turn == 0, 0.0, np.nan))
        before = -2.0 * self.half * turn
        # it rests where it was left: as far as the pin has pushed it when it leaves the slot
        return np.where(inside, np.degrees(before + pushed), np.nan)

    def dwell(self) -> tuple[float, float]:
        """Where the crank (radians) comes into a slot, and leaves it, without play."""
        return -(0.5 * math.pi - self.half), 0.5 * math.pi - self.half

    def peak(self) -> float:
        """The wheel's fastest speed, of the crank's, without play."""
        return math.sin(self.half) / (1.0 - math.sin(self.half))


# --- lost motion, and stops


def play_operator(drive: np.ndarray, first: float, play: float) -> np.ndarray:
    """A thing that is carried along between two stops, ``play`` before and behind a driver (the play operator)."""
    result = np.empty_like(drive)
    now = first
    for k, value in enumerate(drive):
        now = min(max(now, value - play), value + play)
        result[k] = now
    return result


# --- ratchets


@dataclass(frozen=True)
class Ratchet:
    """A wheel about [150,100] whose flanks face clockwise; an arm about the same axle swings by ``swing`` (degrees)
    and back in two time units, with ``pawls`` on it, so far (degrees) from 60 degrees.
    """

    teeth: int
    phase: float  # radians
    swing: float
    pawls: tuple[float, ...] = (0.0,)
    tip: float = 80.0
    pin: float = 104.0  # how far the pawls' pins are from the axle, and
    length: float = 66.0  # their tips from their pins

    @property
    def pitch(self) -> float:
        """Between two teeth, in degrees."""
        return 360.0 / self.teeth

    @property
    def height(self) -> float:
        """Of a tooth."""
        return min(12.0, 0.55 * self.tip * math.radians(self.pitch))

    @property
    def lean(self) -> float:
        """By how much a flank is undercut (radians)."""
        return 0.06 * self.height / (self.tip - self.height)

    def ahead(self, radius: float) -> float:
        """How far (degrees) the tip of a pawl is ahead of its pin where it is so far from the axle."""
        return math.degrees(math.acos((self.pin**2 + radius**2 - self.length**2) / (2.0 * self.pin * radius)))

    def wheel(self) -> list[tuple[float, float]]:
        """The corners: root and tip of each tooth."""
        found: list[tuple[float, float]] = []
        for k in range(self.teeth):
            angle = self.phase + math.radians(self.pitch * k)
            found += [_round(self.tip - self.height, angle + self.lean), _round(self.tip, angle)]
        return found

    def pawl(self, at: float) -> tuple[tuple[float, float], list[tuple[float, float]]]:
        """The pin and the corners of a pawl at ``at`` (degrees), clear of the wheel: an arm with a tooth at its end."""
        (px, py), far = _round(self.pin, math.radians(at)), self.tip + 2.0
        tx, ty = _round(far, math.radians(at + self.ahead(far)))
        ux, uy = (tx - px) / self.length, (ty - py) / self.length
        high = self.height + 4.0
        shape = (
            (-4.0, -high - 6.0),
            (-4.0, -high),
            (self.length - high, -high),
            (self.length, 0.0),
            (self.length - 0.3 * (high + 6.0), -high - 6.0),
        )
        return (px, py), [(px + ux * u - uy * v, py + uy * u + ux * v) for u, v in shape]

    def text(self, place: Place, strokes: int, fps: float = 25.0) -> str:
        """The script."""
        things: list[str] = []
        says: list[str] = []
        toward = "most" if place.sense > 0 else "least"
        for k, off in enumerate(self.pawls):
            pin, points = self.pawl(60.0 + off)
            things.append(polygon(f"Pawl{k}", pin, points, place))
            says.append(f"""
               Pawl{k}.O = Arm.P{k};  Pawl{k}.angle ~ .{toward} .weak .speed(4000);
               .gap(Pawl{k}, Wheel) >= 0 .pushes;""")
        pins = " ".join(f"P{k} = {place.said(*self.pawl(60.0 + off)[0])}" for k, off in enumerate(self.pawls))
        return f"""
            .config({fps}, 320, 260);
            {polygon("Wheel", (150.0, 100.0), self.wheel(), place)}
            Arm : .bar O = {place.said(150.0, 100.0)} {pins};
            {" ".join(things)}
            @0 Wheel.O = {place.said(150.0, 100.0)};  Wheel.angle .holds;  Arm.O = {place.said(150.0, 100.0)};
               Arm.angle = {place.sense * self.swing}*(.cos(180*.t) - 1)/2;
               {" ".join(says)}
            @{2 * strokes}
        """

    def advanced(self, strokes: int) -> list[float]:
        """How far (degrees) the wheel has turned after each stroke. As the arm goes back, a pawl drops over the tips
        that it passes; as the arm comes forward, the pawl that is first at a root pushes the wheel.
        """
        phase, now = math.degrees(self.phase), 0.0
        found: list[float] = []
        for _ in range(strokes):
            after = now
            for off in self.pawls:
                back = 60.0 + off - self.swing + self.ahead(self.tip)
                tooth = math.ceil((back - now - phase) / self.pitch)
                root = phase + math.degrees(self.lean) + self.pitch * tooth
                after = max(after, 60.0 + off + self.ahead(self.tip - self.height) - root)
            now = after
            found.append(now)
        return found


def _round(radius: float, angle: float) -> tuple[float, float]:
    """A point about the axle of a ratchet."""
    return 150.0 + radius * math.cos(angle), 100.0 + radius * math.sin(angle)


def ratchet_points(teeth: int, tip: float, root: float, phase: float) -> list[tuple[float, float]]:
    """A wheel about [150,100] whose flanks are radial and face clockwise."""
    points: list[tuple[float, float]] = []
    for k in range(teeth):
        angle = phase + 2.0 * math.pi * k / teeth
        points += [(150.0 + r * math.cos(angle), 100.0 + r * math.sin(angle)) for r in (root, tip)]
    return points
