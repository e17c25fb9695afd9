"""More families of scripts in which something pushes, with their truth in closed form, at any place, turn and scale."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.pushing.scripts import Place, play_operator, polygon


def _round(centre: tuple[float, float], radius: float, angle: float) -> tuple[float, float]:
    """A point about a centre; the angle in degrees."""
    a = math.radians(angle)
    return centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)


# --- lost motion between turning things


@dataclass(frozen=True)
class Dogs:
    """Wheels about one axle, each with a pin that the next one's pin meets: a combination lock. Pins have radius
    ``pin`` and stand at ``radius``; the first wheel swings by ``swing`` degrees, ever the same way at first.
    """

    wheels: int
    swing: float
    radius: float = 60.0
    pin: float = 4.0

    @property
    def free(self) -> float:
        """How far (degrees) two pins stand apart where they touch."""
        return 2.0 * math.degrees(math.asin(2.0 * self.pin / (2.0 * self.radius)))

    def start(self, k: int) -> float:
        """Where the pin of wheel k stands at first (degrees)."""
        return 40.0 * k

    def text(self, place: Place, fps: float = 25.0) -> str:
        """The script."""
        things: list[str] = []
        says: list[str] = []
        for k in range(self.wheels):
            centre = _round((100.0, 100.0), self.radius, self.start(k))
            things.append(f"W{k} : .bar O = {place.said(100.0, 100.0)} P = {place.said(*centre)};")
            things.append(f"D{k} : .disc({self.pin * place.scale:.14g}) C = {place.said(*centre)};")
            says.append(f"W{k}.O = {place.said(100.0, 100.0)};  D{k}.C = W{k}.P;  D{k}.angle = 0;")
            if k:
                says.append(f".gap(D{k - 1}, D{k}) >= 0 .pushes;")
        return f"""
            .config({fps}, 200, 200);
            {" ".join(things)}
            @0 W0.angle = {place.sense * self.swing}*.sin(90*.t);
               {" ".join(says)}
            @4
        """

    def turned(self, times: np.ndarray) -> list[np.ndarray]:
        """How far each wheel has turned (degrees), at times that have the turning points among them."""
        found = [self.swing * np.sin(0.5 * math.pi * times)]
        for _k in range(1, self.wheels):
            apart = 40.0  # the pin before is so far behind; the other way round it comes to the far side
            ahead, behind = apart - self.free, 360.0 - apart - self.free
            drive = found[-1] + 0.5 * (behind - ahead)
            found.append(play_operator(drive, 0.0, 0.5 * (ahead + behind)))
        return found


# --- latches


@dataclass(frozen=True)
class Latch:
    """A door that slides by ``way`` with ``speed`` under a catch, whose nose has a ramp of ``slope`` and a ``depth``;
    the catch goes up and down, and is drawn down.
    """

    slope: float
    depth: float
    speed: float = 40.0

    def text(self, place: Place, back: bool = False, fps: float = 25.0) -> str:
        """The script; with ``back`` the door turns back, once it is caught."""
        run = self.depth / self.slope
        catch = polygon(
            "Catch",
            (100.0, 60.0),
            [
                (100.0, 60.0),
                (100.0 + run, 60.0 - self.depth),
                (104.0 + run, 60.0 - self.depth),
                (104.0 + run, 90.0),
                (100.0, 90.0),
            ],
            place,
        )
        door = polygon(
            "Door",
            (20.0, 30.0),
            [
                (20.0, 30.0),
                (90.0, 30.0),
                (90.0, 60.0 - self.depth / 2),
                (80.0, 60.0 - self.depth / 2),
                (80.0, 40.0),
                (20.0, 40.0),
            ],
            place,
        )
        dx, dy = (b - a for a, b in zip(place.at(0.0, 0.0), place.at(self.speed, 0.0), strict=True))
        ux, uy = (b - a for a, b in zip(place.at(0.0, 0.0), place.at(0.0, 1.0), strict=True))
        x, y = place.at(20.0, 30.0)
        cx, cy = place.at(100.0, 60.0)
        length = math.hypot(ux, uy)
        end = 1.2 * (run + 25.0) / self.speed
        back_x, back_y = (f"{v:.14g} + {d:.14g}*({end:.14g} - .t)" for v, d in ((x, dx), (y, dy)))
        turn = f"@{end:.14g} Door.O = [{back_x}, {back_y}];"
        return f"""
            .config({fps}, 300, 200);
            {catch} {door}
            @0 Door.O = [{x:.14g} + {dx:.14g}*.t, {y:.14g} + {dy:.14g}*.t];  Door.angle = 0;
               Catch.angle = 0;  Catch.O = [{cx:.14g} + {ux / length:.14g}*lift, {cy:.14g} + {uy / length:.14g}*lift];
               lift ~ 0 .weak .speed({2000 * place.scale:.14g});
               .gap(Door, Catch) >= 0 .pushes;
            {turn if back else ""}
            @{2 * end if back else end:.14g}
        """

    def lift(self, times: np.ndarray) -> np.ndarray:
        """How high the catch is, as the door goes under it; nan where it falls."""
        run, height = self.depth / self.slope, self.depth / 2.0
        front = 90.0 + self.speed * times
        ramp = np.clip(self.slope * (front - 100.0) - height, 0.0, height)
        return np.where(front - 10.0 > 104.0 + run, np.nan, np.where(front < 100.0 + run, ramp, height))


# --- counters


@dataclass(frozen=True)
class Counter:
    """Wheels that carry: a pin of each turns the next one, which has ``slots``, by one slot in every turn."""

    slots: int
    wheels: int
    pin: float = 3.0

    def text(self, place: Place, turns: float, fps: float = 25.0) -> str:
        """The script: the first wheel turns once in a time unit."""
        half = math.pi / self.slots
        crank, radius = 100.0 * math.sin(half), 100.0 * math.cos(half)
        mouth, bottom = radius, 100.0 - crank - self.pin - 1.0
        things: list[str] = []
        says: list[str] = []
        for w in range(self.wheels):
            x = 100.0 * w
            # the pin stands away from the next wheel
            px = x - crank
            things.append(f"Pin{w} : .disc({self.pin * place.scale:.14g}) C = {place.said(px, 0.0)};")
            if w == 0:
                things.append(f"W0 : .bar O = {place.said(x, 0.0)} P = {place.said(px, 0.0)};")
                says.append(f"W0.O = {place.said(x, 0.0)};  W0.angle = {360.0 * place.sense}*.t;")
            else:
                points: list[tuple[float, float]] = []
                for k in range(self.slots):
                    a = math.pi + half + 2.0 * half * k
                    c, s = math.cos(a), math.sin(a)
                    points += [
                        (x + c * u - s * v, s * u + c * v)
                        for u, v in ((mouth, -self.pin), (bottom, -self.pin), (bottom, self.pin), (mouth, self.pin))
                    ]
                anchors = " ".join(f"A{k} = {place.said(*point)}" for k, point in enumerate(points))
                through = ", ".join(f"A{k}" for k in range(len(points)))
                things.append(
                    f"W{w} : .polygon O = {place.said(x, 0.0)} P = {place.said(px, 0.0)} {anchors} .through({through});"
                )
                says.append(f"W{w}.O = {place.said(x, 0.0)};  .gap(Pin{w - 1}, W{w}) >= 0 .pushes;")
            says.append(f"Pin{w}.C = W{w}.P;  Pin{w}.angle = 0;")
        return f"""
            .config({fps}, 400, 200);
            {" ".join(things)}
            @0 {" ".join(says)}
            @{turns}
        """

    def shown(self, turns: int) -> list[float]:
        """How far (degrees) each wheel but the first has turned after so many turns of the first, from the side where a
        pin meets no wheel.
        """
        found: list[float] = []
        count = turns
        sense = -1.0
        for _ in range(1, self.wheels):
            found.append(sense * count * 360.0 / self.slots)
            # a wheel's pin passes the next wheel when it has turned by half a turn, and then by each whole one
            count = (2 * count + self.slots) // (2 * self.slots)
            sense = -sense
        return found


# --- drives with several pins


@dataclass(frozen=True)
class Pins:
    """An intermittent drive: ``pins`` of one crank, as far apart as a slot's step lasts, turn a wheel of ``slots``."""

    slots: int
    pins: int
    pin: float = 3.0

    @property
    def half(self) -> float:
        """Half a slot's angle (radians)."""
        return math.pi / self.slots

    @property
    def apart(self) -> float:
        """Between two pins (degrees): one comes in just as the one before goes out, and a little later."""
        return math.degrees(math.pi - 2.0 * self.half) + 4.0

    def text(self, place: Place, fps: float = 25.0) -> str:
        """The script: a turn of the crank in four time units, which begins as all pins are out."""
        crank, radius = 100.0 * math.sin(self.half), 100.0 * math.cos(self.half)
        mouth, bottom = radius, 100.0 - crank - self.pin - 1.0
        points: list[tuple[float, float]] = []
        for k in range(self.slots):
            a = math.pi + self.half + 2.0 * self.half * k
            c, s = math.cos(a), math.sin(a)
            points += [
                (100.0 + c * u - s * v, s * u + c * v)
                for u, v in ((mouth, -self.pin), (bottom, -self.pin), (bottom, self.pin), (mouth, self.pin))
            ]
        first = -0.5 * self.apart - 10.0
        where = [_round((0.0, 0.0), crank, first - self.apart * k) for k in range(self.pins)]
        anchors = " ".join(f"P{k} = {place.said(*point)}" for k, point in enumerate(where))
        things = [f"Pin{k} : .disc({self.pin * place.scale:.14g}) C = {place.said(*p)};" for k, p in enumerate(where)]
        says = [
            f"Pin{k}.C = Crank.P{k};  Pin{k}.angle = 0;  .gap(Pin{k}, Wheel) >= 0 .pushes;" for k in range(self.pins)
        ]
        return f"""
            .config({fps}, 400, 200);
            {polygon("Wheel", (100.0, 0.0), points, place)}
            Crank : .bar O = {place.said(0.0, 0.0)} {anchors};
            {" ".join(things)}
            @0 Crank.O = {place.said(0.0, 0.0)};  Crank.angle = {90.0 * place.sense}*.t;
               Wheel.O = {place.said(100.0, 0.0)};  {" ".join(says)}
            @4
        """

    def turned(self) -> float:
        """By a whole turn of the crank."""
        return -360.0 / self.slots * self.pins


def block(name: str, x: float, y: float, w: float, h: float, place: Place) -> str:
    """A box with its lower left corner at [x, y]."""
    return polygon(name, (x, y), [(x, y), (x + w, y), (x + w, y + h), (x, y + h)], place)


# --- a safety catch


@dataclass(frozen=True)
class Safety:
    """A bolt that slides from 0 to ``way``, and a catch in its path that a second hand draws up from ``begin`` on, by
    ``lift`` in a time unit; it blocks until it is ``height`` up. The bolt is drawn on by a wish, as fast as ``speed``.
    """

    begin: float
    lift: float
    height: float = 12.0
    gap: float = 20.0
    speed: float = 30.0

    def text(self, place: Place, end: float, *, driven: bool = False) -> str:
        """The script; ``driven``: the bolt is, come what may."""
        bolt = block("Bolt", 0.0, 0.0, 40.0, 10.0, place)
        catch = block("Catch", 40.0 + self.gap, 10.0 - self.height, 6.0, 40.0, place)
        (ox, oy), (ux, uy), (vx, vy) = place.at(0.0, 0.0), place.at(1.0, 0.0), place.at(0.0, 1.0)
        ux, uy, vx, vy = ux - ox, uy - oy, vx - ox, vy - oy
        cx, cy = place.at(40.0 + self.gap, 10.0 - self.height)
        rise = f"{self.lift:.14g}*.max(.t - {self.begin:.14g}, 0)"
        go = f"way = {self.speed:.14g}*.t;" if driven else f"way ~ .most .weak .speed({self.speed:.14g});"
        return f"""
            .config(25, 300, 200);
            {bolt} {catch}
            @0 Bolt.O = [{ox:.14g} + {ux:.14g}*way, {oy:.14g} + {uy:.14g}*way];  Bolt.angle = 0;  {go}
               Catch.O = [{cx:.14g} + {vx:.14g}*{rise}, {cy:.14g} + {vy:.14g}*{rise}];  Catch.angle = 0;
               .gap(Bolt, Catch) >= 0 .pushes;
            @{end:.14g}
        """

    @property
    def free(self) -> float:
        """When the catch lets go."""
        return self.begin + self.height / self.lift

    def way(self, times: np.ndarray) -> np.ndarray:
        """How far the bolt has gone."""
        before = np.minimum(self.speed * times, self.gap)
        return np.where(times < self.free, before, before + self.speed * np.maximum(times - self.free, 0.0))
