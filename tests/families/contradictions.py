"""Scenes made from a known pose, with one statement that does not fit: what contradicts is known by construction.

Bodies are put at random places and turned at random. Each is held by statements that are true of that pose: pins,
lengths, coordinates, angles, vectors, some of them redundant. Then one number is changed, or one statement too many is
added, by a known amount. That it cannot hold is seen from the rank of the statements' derivatives, which this module
takes by itself, with finite differences of its own residuals.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Point = tuple[float, float]


@dataclass(frozen=True)
class Statement:
    """One statement: ``text`` with ``{}`` where its number stands, the number, and what its sides differ by at the
    poses (3 * bodies,) followed by the variables' values, for a given number.
    """

    text: str
    number: float
    residual: Callable[[FloatArray, float], list[float]]
    angle: bool = False

    def script(self, off: float = 0.0) -> str:
        return self.text.format(repr(round(float(self.number + off), 12)))

    def off(self, pose: FloatArray, more: float = 0.0) -> list[float]:
        return self.residual(pose, self.number + more)


@dataclass(frozen=True)
class Body:
    """``anchors`` in the body's own frame."""

    name: str
    anchors: tuple[Point, ...]


@dataclass
class Scene:
    """``pose`` holds (x, y, turn in degrees) of each body, then the variables."""

    bodies: list[Body] = field(default_factory=list)
    pose: list[float] = field(default_factory=list)
    variables: list[float] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    wrong: int = -1
    amount: float = 0.0

    def flat(self) -> FloatArray:
        return np.array([*self.pose, *self.variables])

    def residuals(self, pose: FloatArray, chosen: list[int] | None = None, *, broken: bool = True) -> FloatArray:
        """What the statements ``chosen`` (default: all) are off by; lengths over 100, angles in radians."""
        found: list[float] = []
        for i in range(len(self.statements)) if chosen is None else chosen:
            statement = self.statements[i]
            rows = statement.off(pose, self.amount if broken and i == self.wrong else 0.0)
            found += [math.remainder(v, 360.0) * math.pi / 180.0 if statement.angle else v / 100.0 for v in rows]
        return np.array(found)

    def script(self) -> str:
        lines = [".config(10, 400, 400);"]
        for body in self.bodies:
            points = [(round(x, 12), round(y, 12)) for x, y in body.anchors]
            anchors = " ".join(f"{'abcd'[i]}=[{x!r},{y!r}]" for i, (x, y) in enumerate(points))
            lines.append(f"{body.name} : .bar {anchors};")
        lines.append("@0")
        for i, statement in enumerate(self.statements):
            lines.append(statement.script(self.amount if i == self.wrong else 0.0))
        return "\n".join([*lines, "@1", ""])


def place(pose: FloatArray, body: int, point: Point) -> Point:
    x, y, turn = (float(v) for v in pose[3 * body : 3 * body + 3])
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    return x + c * point[0] - s * point[1], y + s * point[0] + c * point[1]


class Maker:
    """Builds one random scene of ``count`` bodies."""

    def __init__(self, seed: int, count: int) -> None:
        self.r = random.Random(seed)
        self.scene = Scene()
        self.count = count
        self.ends: list[tuple[int, int]] = []
        """(body, anchor) of what can be hung onto."""

    def at(self, end: tuple[int, int]) -> Point:
        body, anchor = end
        return place(np.array(self.scene.pose), body, self.scene.bodies[body].anchors[anchor])

    def name(self, end: tuple[int, int]) -> str:
        return f"{self.scene.bodies[end[0]].name}.{'abcd'[end[1]]}"

    def body(self, world: list[Point]) -> int:
        """A body with anchors at places ``world``, drawn at its own origin."""
        turn = self.r.uniform(-170.0, 170.0)
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        x0, y0 = world[0]
        anchors = tuple(
            (round(c * (x - x0) + s * (y - y0), 9), round(-s * (x - x0) + c * (y - y0), 9)) for x, y in world
        )
        number = len(self.scene.bodies)
        self.scene.bodies.append(Body(f"B{number}", anchors))
        self.scene.pose += [x0, y0, turn]
        return number

    def add(self, text: str, number: float, residual, *, angle: bool = False) -> None:
        statement = Statement(text, float(number), residual, angle)
        if all(statement.script() != other.script() for other in self.scene.statements):  # told apart by their texts
            self.scene.statements.append(statement)

    # statements

    def pin_to_ground(self, end: tuple[int, int]) -> None:
        body, anchor = end
        local = self.scene.bodies[body].anchors[anchor]
        x, y = self.at(end)
        if self.r.random() < 0.7:
            y = round(y, 12)
            self.add(
                f"{self.name(end)} = [{{}}, {y!r}];",
                x,
                lambda p, v, b=body, q=local, y=y: [place(p, b, q)[0] - v, place(p, b, q)[1] - y],
            )
        else:
            self.coordinate(end, 0)
            self.coordinate(end, 1)

    def coordinate(self, end: tuple[int, int], axis: int) -> None:
        body, anchor = end
        local = self.scene.bodies[body].anchors[anchor]
        self.add(
            f"{self.name(end)}.{'xy'[axis]} = {{}};",
            self.at(end)[axis],
            lambda p, v, b=body, q=local, k=axis: [place(p, b, q)[k] - v],
        )

    def joined(self, one: tuple[int, int], other: tuple[int, int]) -> None:
        """``one = other + [number, 0]``-like; mostly without a number."""
        (b1, a1), (b2, a2) = one, other
        q1, q2 = self.scene.bodies[b1].anchors[a1], self.scene.bodies[b2].anchors[a2]
        dx = self.at(one)[0] - self.at(other)[0]
        dy = self.at(one)[1] - self.at(other)[1]

        def residual(p, v, b1=b1, b2=b2, q1=q1, q2=q2, dy=dy):
            x, y = place(p, b1, q1)
            u, w = place(p, b2, q2)
            return [x - u - v, y - w - dy]

        if abs(dx) < 1e-8 and abs(dy) < 1e-8:
            self.add(f"{self.name(one)} = {self.name(other)} + [{{}}, 0];" if self.r.random() < 0.15
                     else f"{self.name(one)} = {self.name(other)};", 0.0,
                     lambda p, v, b1=b1, b2=b2, q1=q1, q2=q2: residual(p, v, b1, b2, q1, q2, 0.0))  # fmt: skip
        else:
            dy = round(dy, 12)
            self.add(f"{self.name(one)} = {self.name(other)} + [{{}}, {dy!r}];", dx, residual)

    def length(self, one: tuple[int, int], other: tuple[int, int]) -> None:
        (b1, a1), (b2, a2) = one, other
        q1, q2 = self.scene.bodies[b1].anchors[a1], self.scene.bodies[b2].anchors[a2]

        def residual(p, v, b1=b1, b2=b2, q1=q1, q2=q2):
            x, y = place(p, b1, q1)
            u, w = place(p, b2, q2)
            return [math.hypot(x - u, y - w) - v]

        value = math.dist(self.at(one), self.at(other))
        self.add(f"({self.name(one)} - {self.name(other)}).l = {{}};", value, residual)

    def length_to(self, end: tuple[int, int], point: Point) -> None:
        body, anchor = end
        local = self.scene.bodies[body].anchors[anchor]
        point = round(point[0], 9), round(point[1], 9)
        self.add(
            f"({self.name(end)} - [{point[0]!r},{point[1]!r}]).l = {{}};",
            math.dist(self.at(end), point),
            lambda p, v, b=body, q=local: [math.dist(place(p, b, q), point) - v],
        )

    def angle(self, body: int) -> None:
        self.add(
            f"B{body}.angle = {{}};",
            self.scene.pose[3 * body + 2],
            lambda p, v, b=body: [p[3 * b + 2] - v],
            angle=True,
        )

    def angle_between(self, one: int, other: int) -> None:
        self.add(
            f"B{one}.angle - B{other}.angle = {{}};",
            self.scene.pose[3 * one + 2] - self.scene.pose[3 * other + 2],
            lambda p, v: [p[3 * one + 2] - p[3 * other + 2] - v],
            angle=True,
        )

    # parts

    def end(self) -> tuple[int, int]:
        return self.ends[self.r.randrange(len(self.ends))]

    def near(self, about: Point, low: float = 40.0, high: float = 110.0) -> Point:
        turn, far = self.r.uniform(0.0, 2.0 * math.pi), self.r.uniform(low, high)
        return about[0] + far * math.cos(turn), about[1] + far * math.sin(turn)

    def well(self, a: Point, b: Point) -> Point:
        """A place for a joint that is well off the line of ``a`` and ``b``."""
        while True:
            p = self.near(a)
            u, v = (p[0] - a[0], p[1] - a[1]), (p[0] - b[0], p[1] - b[1])
            lengths = math.hypot(*u) * math.hypot(*v)
            if math.hypot(*v) > 25 and abs(u[0] * v[1] - u[1] * v[0]) > 0.3 * lengths:
                return p

    def shape(self, *points: Point) -> list[Point]:
        """A body's anchors: ``points``, and now and then one more."""
        return [*points, self.near(points[0])] if self.r.random() < 0.3 else list(points)

    def hang(self, number: int) -> None:
        self.ends += [(number, i) for i in range(len(self.scene.bodies[number].anchors))]

    def grounded(self) -> None:
        a = (self.r.uniform(50, 350), self.r.uniform(50, 350))
        number = self.body(self.shape(a, self.near(a)))
        self.pin_to_ground((number, 0))
        kind = self.r.choice(("angle", "angle", "coordinate", "both", "free"))
        if kind == "angle":
            self.angle(number)
        elif kind == "coordinate":
            self.coordinate((number, 1), self.r.randrange(2))
        elif kind == "both":
            self.pin_to_ground((number, 1))
        self.hang(number)

    def dyad(self) -> None:
        one = self.end()
        other = self.end()
        if math.dist(self.at(one), self.at(other)) < 20.0:
            return self.level()
        joint = self.well(self.at(one), self.at(other))
        first = self.body(self.shape(self.at(one), joint))
        second = self.body(self.shape(self.at(other), joint))
        self.joined((first, 0), one)
        self.joined((second, 0), other)
        self.joined((first, 1), (second, 1))
        self.hang(first)
        self.hang(second)
        return None

    def level(self) -> None:
        one = self.end()
        joint = self.near(self.at(one))
        number = self.body(self.shape(self.at(one), joint))
        self.joined((number, 0), one)
        kind = self.r.choice(("angle", "between", "coordinate", "length", "length to"))
        if kind == "angle":
            self.angle(number)
        elif kind == "between":
            self.angle_between(number, one[0])
        elif kind == "coordinate":
            self.coordinate((number, 1), self.r.randrange(2))
        elif kind == "length":
            self.length((number, 1), self.end())
        else:
            self.length_to((number, 1), self.well(self.at(one), joint))
        self.hang(number)

    def loose(self) -> None:
        one = self.end()
        number = self.body(self.shape(self.at(one), self.near(self.at(one))))
        self.joined((number, 0), one)
        self.hang(number)

    def too_many(self) -> None:
        """A true statement about what stands already."""
        kind = self.r.choice(("length", "length", "length to", "angle", "between", "coordinate", "joined", "pin"))
        one, other = self.end(), self.end()
        far = math.dist(self.at(one), self.at(other))
        if kind == "length" and one[0] != other[0] and far > 20.0:
            self.length(one, other)
        elif kind == "length to":
            self.length_to(one, self.near(self.at(one)))
        elif kind == "angle":
            self.angle(one[0])
        elif kind == "between" and one[0] != other[0]:
            self.angle_between(one[0], other[0])
        elif kind == "coordinate":
            self.coordinate(one, self.r.randrange(2))
        elif kind == "joined" and one[0] != other[0]:
            self.joined(one, other)
        elif kind == "pin":
            self.pin_to_ground(one)

    def made(self) -> Scene:
        self.grounded()
        while len(self.scene.bodies) < self.count:
            self.r.choice((self.grounded, self.dyad, self.dyad, self.dyad, self.level, self.level, self.loose))()
        for _ in range(self.r.randint(1, 4)):
            self.too_many()
        order = list(range(len(self.scene.statements)))
        if self.r.random() < 0.5:
            self.r.shuffle(order)
            self.scene.statements = [self.scene.statements[i] for i in order]
        return self.scene


def slopes(scene: Scene, chosen: list[int]) -> tuple[FloatArray, list[int]]:
    """Derivatives of the statements' residuals by central differences at the true pose, and each row's statement."""
    pose = scene.flat()
    owner = [i for i in chosen for _ in scene.statements[i].off(pose)]
    columns: list[FloatArray] = []
    for j in range(len(pose)):
        step = 1e-4
        up, down = pose.copy(), pose.copy()
        up[j] += step
        down[j] -= step
        columns.append((scene.residuals(up, chosen, broken=False) - scene.residuals(down, chosen, broken=False)) / step)
    return np.array(columns).T, owner


def rank(matrix: FloatArray) -> int:
    lengths = np.linalg.norm(matrix, axis=1)
    return int(np.linalg.matrix_rank(matrix / np.maximum(lengths, 1e-12)[:, None], tol=1e-6)) if len(matrix) else 0


def broken_scene(seed: int, count: int) -> Scene:
    """A scene in which one number is off, so that it cannot be met: the others leave it no room (by their rank)."""
    for attempt in range(100):
        maker = Maker(seed * 1009 + attempt, count)
        scene = maker.made()
        r = maker.r
        every = list(range(len(scene.statements)))
        matrix, owner = slopes(scene, every)
        full = rank(matrix)
        numbered = [i for i in every if "{}" in scene.statements[i].text]
        r.shuffle(numbered)
        for i in numbered[:12]:
            keep = [k for k, o in enumerate(owner) if o != i]
            rows = [k for k, o in enumerate(owner) if o == i]
            first = rows[0]  # the row with the number
            others = [*keep, *rows[1:]]
            if rank(matrix[others]) != full or rank(matrix[[*others, first]]) != full:
                continue
            amount = r.choice((-1.0, 1.0)) * (r.uniform(2.0, 40.0))
            return replace(scene, wrong=i, amount=amount)
    raise AssertionError("no number that could be wrong")
