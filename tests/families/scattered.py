"""Random scenes that have a known pose, with every thing drawn somewhere else: at its own origin, as people write bars.

A mechanism is grown in its pose: pins, cranks, dyads, sliders, triads, fixed angles, lengths, and what is redundant but
agrees. Then each thing is moved and turned away from there, and only the script's own statements tell how they belong
together. Every statement is also kept as a function of the anchors' places, so that an answer is judged without us.
"""

from __future__ import annotations

import cmath
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field

Places = Callable[[str, str], complex]
"""From the names of a thing and an anchor to the anchor's place in the world."""


@dataclass
class Scattered:
    """A scene: ``things`` (name -> anchors in the known pose), ``statements``, and what each of them is off by."""

    things: dict[str, dict[str, complex]] = field(default_factory=dict)
    statements: list[str] = field(default_factory=list)
    errors: list[tuple[str, Callable[[Places], float]]] = field(default_factory=list)

    def place(self, thing: str, anchor: str) -> complex:
        """Where an anchor is in the known pose."""
        return self.things[thing][anchor]

    def state(self, text: str, error: Callable[[Places], float]) -> None:
        """Add a statement."""
        self.statements.append(text)
        self.errors.append((text, error))

    def worst(self, places: Places) -> tuple[float, str]:
        """The largest error of a statement, and the statement."""
        return max((abs(error(places)), text) for text, error in self.errors)


def number(value: float) -> str:
    """A number as a script writes it."""
    return repr(float(value))


def vector(z: complex) -> str:
    """A vector as a script writes it."""
    return f"[{number(z.real)}, {number(z.imag)}]"


class Growing:
    """Grows a mechanism, one group of bodies after the other."""

    def __init__(self, seed: int, size: float = 100.0) -> None:
        self.random = random.Random(seed)
        self.scene = Scattered()
        self.size = size
        self.points: list[tuple[str, str]] = []
        self.driven: set[str] = set()

    def thing(self, *anchors: complex) -> str:
        """A new bar with these anchors (A, B, C …) in the known pose."""
        name = f"T{len(self.scene.things)}"
        self.scene.things[name] = {"ABCDEF"[i]: z for i, z in enumerate(anchors)}
        return name

    def near(self, z: complex, low: float = 0.4, high: float = 1.3) -> complex:
        """A random place near another."""
        length = self.size * self.random.uniform(low, high)
        return z + cmath.rect(length, self.random.uniform(0.0, 2.0 * math.pi))

    def pin(self, thing: str, anchor: str) -> None:
        """Fix an anchor in the world."""
        z = self.scene.place(thing, anchor)
        self.scene.state(f"{thing}.{anchor} = {vector(z)};", lambda at: abs(at(thing, anchor) - z))

    def join(self, thing: str, anchor: str, other: tuple[str, str]) -> None:
        """Pin an anchor to another thing's."""
        left, right = f"{thing}.{anchor}", ".".join(other)
        if self.random.random() < 0.3 and other[0] not in self.driven:  # a key of its own, which no drive restates
            left, right = right, left
        self.scene.state(f"{left} = {right};", lambda at: abs(at(thing, anchor) - at(*other)))

    def known(self) -> tuple[str, str]:
        """An anchor that is there already, of those added lately rather than the first."""
        places = self.points[-8:] if self.random.random() < 0.7 else self.points
        return self.random.choice(places)

    def begin(self) -> None:
        """A crank: pinned, at a stated angle."""
        z = complex(self.random.uniform(0, 4), self.random.uniform(0, 4)) * self.size
        name = self.thing(z, self.near(z))
        self.pin(name, "A")
        direction = cmath.phase(self.scene.place(name, "B") - z)
        turn = math.degrees(direction)
        how = self.random.randrange(3)
        if how == 0:
            end = self.scene.place(name, "B")
            self.scene.state(f"{name}.B = {vector(end)};", lambda at: abs(at(name, "B") - end))
        elif how == 1:
            length = abs(self.scene.place(name, "B") - z)
            self.scene.state(
                f"{name}.B = {name}.A + [{number(length)}, 0].r({number(turn)});",
                lambda at: abs(at(name, "B") - at(name, "A") - cmath.rect(length, direction)),
            )
        else:
            self.scene.state(
                f".a([1,0], {name}.B - {name}.A) = {number(turn)};",
                lambda at: self.size * abs(cmath.phase((at(name, "B") - at(name, "A")) * cmath.rect(1, -direction))),
            )
        self.points.append((name, "B"))

    def dyad(self) -> None:
        """Two bars between two anchors, joined at a new one."""
        one, other = self.known(), self.known()
        p, q = self.scene.place(*one), self.scene.place(*other)
        middle = self.near(0.5 * (p + q))
        extra = [self.near(middle)] if self.random.random() < 0.5 else []
        first, second = self.thing(p, middle, *extra), self.thing(q, middle)
        self.join(first, "A", one)
        if one == other or abs(p - q) < 1e-3 * self.size:
            z = self.near(q)  # a second pin of its own
            self.scene.things[second]["A"] = z
            self.pin(second, "A")
        else:
            self.join(second, "A", other)
        self.join(second, "B", (first, "B"))
        self.points += [(first, "B"), *([(first, "C")] if extra else [])]

    def grounded_dyad(self) -> None:
        """A coupler and a rocker on a new pin."""
        one = self.known()
        p = self.scene.place(*one)
        middle, pivot = self.near(p), self.near(p, 0.8, 2.0)
        extra = [self.near(middle)] if self.random.random() < 0.7 else []
        first, second = self.thing(p, middle, *extra), self.thing(middle, pivot)
        self.join(first, "A", one)
        self.pin(second, "B")
        self.join(second, "A", (first, "B"))
        self.points += [(first, "B"), *([(first, "C")] if extra else [])]

    def slider(self) -> None:
        """A rod whose end is on a straight guide."""
        one = self.known()
        p = self.scene.place(*one)
        end = self.near(p)
        name = self.thing(p, end, self.near(end))
        self.join(name, "A", one)
        if self.random.random() < 0.5:
            self.scene.state(f"{name}.B = [_, {number(end.imag)}];", lambda at: (at(name, "B") - end).imag)
        else:
            self.scene.state(f"{name}.B.x = {number(end.real)};", lambda at: (at(name, "B") - end).real)
        self.points += [(name, "B"), (name, "C")]

    def triad(self) -> None:
        """A body on three bars: irreducible."""
        some = self.random.sample(self.points, min(3, len(self.points)))
        places = [self.scene.place(*point) for point in some]
        while len(places) < 3:
            places.append(self.near(places[0], 0.8, 1.8))
        centre = sum(places) / len(places)
        corners = [self.near(centre, 0.3, 0.8) for _ in range(3)]
        body = self.thing(*corners)
        for i, place in enumerate(places):
            bar = self.thing(place, corners[i])
            if i < len(some):
                self.join(bar, "A", some[i])
            else:
                self.pin(bar, "A")
            self.join(bar, "B", (body, "ABC"[i]))
        self.points += [(body, "A"), (body, "C")]

    def tangle(self) -> None:
        """Bars between joints of which none can be placed without the others (edges split: Henneberg's second step)."""
        one, other = self.known(), self.known()
        p, q = self.scene.place(*one), self.scene.place(*other)
        ends: dict[str, complex] = {"p": p, "q": q}
        if one == other or abs(p - q) < 0.3 * self.size:
            q = ends["q"] = self.near(p, 0.8, 1.5)
        middle = 0.5 * (p + q)
        ends["v0"] = self.near(middle)
        edges = [("p", "v0"), ("q", "v0")]
        for i in range(1, self.random.randint(2, 5)):
            u, v = edges.pop(self.random.randrange(len(edges)))
            w = self.random.choice([name for name in ends if name not in (u, v)])
            ends[f"v{i}"] = self.near(middle)
            edges += [(u, f"v{i}"), (v, f"v{i}"), (w, f"v{i}")]
        first: dict[str, tuple[str, str]] = {"p": one}
        if q == self.scene.place(*other):
            first["q"] = other
        for u, v in edges:
            bar = self.thing(ends[u], ends[v])
            for name, anchor in ((u, "A"), (v, "B")):
                if name in first:
                    self.join(bar, anchor, first[name])
                elif name == "q":
                    self.pin(bar, anchor)
                    first[name] = bar, anchor
                else:
                    first[name] = bar, anchor
        self.points += [first[name] for name in first if name.startswith("v")]

    def fixed_angle(self) -> None:
        """A bar joined at an anchor of another, at a fixed angle to it."""
        thing, anchor = self.known()
        base = next(name for name in self.scene.things[thing] if name != anchor)
        p, q = self.scene.place(thing, anchor), self.scene.place(thing, base)
        end = self.near(p)
        bar = self.thing(p, end)
        self.join(bar, "A", (thing, anchor))
        corner = cmath.phase((end - p) / (q - p))
        text = f".a({thing}.{base} - {thing}.{anchor}, {bar}.B - {bar}.A) = {number(math.degrees(corner))};"

        def off(at: Places) -> float:
            u, v = at(thing, base) - at(thing, anchor), at(bar, "B") - at(bar, "A")
            return self.size * cmath.phase(v / u * cmath.rect(1.0, -corner))

        self.scene.state(text, off)
        self.points.append((bar, "B"))

    def by_lengths(self) -> None:
        """A bar placed by a joint and the distance of its end from another anchor."""
        one, other = self.known(), self.known()
        p, q = self.scene.place(*one), self.scene.place(*other)
        end = self.near(0.5 * (p + q))
        bar = self.thing(p, end)
        if abs(p - q) < 1e-3 * self.size:
            q = self.near(end)
            text, far = vector(q), (lambda at, q=q: q)
        else:
            text, far = ".".join(other), (lambda at: at(*other))
        self.join(bar, "A", one)
        length = abs(end - q)
        self.scene.state(f"({bar}.B - {text}).l = {number(length)};", lambda at: abs(at(bar, "B") - far(at)) - length)
        self.points.append((bar, "B"))

    def redundant(self) -> None:
        """A bar between two anchors that are placed already, as long as it must be."""
        one, other = self.random.choice(self.points), self.random.choice(self.points)
        p, q = self.scene.place(*one), self.scene.place(*other)
        if abs(p - q) < 0.05 * self.size:
            return
        bar = self.thing(p, q)
        self.join(bar, "A", one)
        self.join(bar, "B", other)


def scattered(seed: int, things: int, redundancy: bool = True) -> Scattered:
    """A scene of about so many things."""
    grown = Growing(seed)
    for _ in range(1 + grown.random.randrange(3)):
        grown.begin()
    ways = [
        grown.dyad,
        grown.grounded_dyad,
        grown.slider,
        grown.triad,
        grown.fixed_angle,
        grown.by_lengths,
        grown.tangle,
    ]
    weights = [6, 6, 2, 2, 4, 2, 1]
    while len(grown.scene.things) < things:
        grown.random.choices(ways, weights)[0]()
    if redundancy and grown.random.random() < 0.4:
        grown.redundant()
    return grown.scene


def script(scene: Scattered, seed: int, drawn: str = "origin") -> str:
    """The scene's text. ``drawn``: "origin": each thing at its own origin, its first two anchors level; "anywhere":
    moved and turned at random; "together": all of it moved and turned as one; "closed": as it stands.
    """
    generator = random.Random(seed + 1)
    turn, shift = (
        cmath.rect(1.0, generator.uniform(-math.pi, math.pi)),
        complex(*(generator.gauss(0, 500) for _ in "xy")),
    )
    lines = [".config(10);"]
    for name, anchors in scene.things.items():
        first, second, *_ = anchors.values()
        if drawn == "origin":
            by, to = (second - first).conjugate() / abs(second - first), 0j
        elif drawn == "anywhere":
            by = cmath.rect(1.0, generator.uniform(-math.pi, math.pi))
            to = complex(generator.uniform(0, 400), generator.uniform(0, 400))
        elif drawn == "together":
            by, to = turn, shift + turn * first
        else:
            by, to = 1.0, first
        local = {anchor: (z - first) * by + to for anchor, z in anchors.items()}
        lines.append(f"{name} : .bar " + "  ".join(f"{a} = {vector(z)}" for a, z in local.items()) + ";")
    order = list(scene.statements)
    generator.shuffle(order)
    return "\n".join([*lines, "@0", *order]) + "\n"
