"""Chains of triangular formulas by the seed, and what each of them means, in complex numbers of our own."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Complexes = NDArray[np.complex128]
Floats = NDArray[np.float64]

ROOM = 0.08
"""Of the smaller length: how far every triangle stays from being flat, so that its side is plain."""


@dataclass
class Chain:
    """``lines`` of formulas in order, ``points`` (F,) as they must come out, ``values`` as a file gives them."""

    lines: list[str] = field(default_factory=list[str])
    points: dict[str, Complexes] = field(default_factory=dict[str, Complexes])
    values: dict[str, str] = field(default_factory=dict[str, str])

    def text(self, choose: random.Random) -> str:
        """A file: formulas and values in some order and spelling, with comments."""
        known = [f"{name} = {value}" for name, value in self.values.items()]
        choose.shuffle(known)
        end = choose.choice(["\n", ";\n", "\r\n", "; "])
        formulas = [choose.choice([line, line.replace(" ", "")]) for line in self.lines]
        parts = choose.choice([[*formulas, *known], [*known, *formulas]])
        return choose.choice(["", "# a comment = 3\n", "#[ PLA[ \n #] \n"]) + end.join(parts) + "\n"


def chain(seed: int, frames: int = 7) -> Chain:
    """Two to six formulas on two to four fixed points, all solvable at every frame and well away from dead centres."""
    choose = random.Random(seed)
    made = Chain()
    fps = choose.choice([1, 10, 24, 25])
    made.values["fps"] = str(fps)
    for n in range(choose.randint(2, 4)):
        place = complex(round(choose.uniform(-200, 200), 3), round(choose.uniform(-200, 200), 3))
        made.points[f"O{n}"] = np.full(frames, place)
        made.values[f"O{n}"] = f"[{place.real}, {place.imag}]"
    if choose.random() < 0.2:
        steps = np.cumsum([choose.uniform(0, 9) for _ in range(frames)])
        path = np.linspace(0, choose.uniform(-60, 60), frames) + 1j * steps
        made.points["M"] = path
        made.values["M"] = str([[float(z.real), float(z.imag)] for z in path])
    wanted = choose.randint(2, 6)
    for _ in range(60):
        if len(made.lines) < wanted:
            _add(made, choose, frames, first=not made.lines)
    return made


def _add(made: Chain, choose: random.Random, frames: int, first: bool) -> None:
    """One more formula, if the one that chance suggests has a solution at every frame."""
    name = f"P{len(made.lines)}"
    often = ["PLA", "PLAP3", "PLAP", "PLAP", "PLLP", "PLLP", "PLLP", "PLPP", "PALP", "PXY", "PPP"]
    function = "PLA" if first else choose.choice(often)
    some = choose.sample(sorted(made.points), min(3, len(made.points)))
    names = [some[k % len(some)] for k in range(3)]
    draft = _Draft(name, choose, frames, inverse=function not in ("PXY", "PPP") and choose.random() < 0.3)
    found = draft.solved(function, names, [made.points[word] for word in names])
    if found is None or not np.isfinite(found[1]).all() or np.abs(found[1]).max() > 2000:
        return
    arguments, points = found
    word = choose.choice(["T", "true"]) if draft.inverse else choose.choice(["", "", "F"])
    made.lines.append(f"{function.rstrip('3')}[{', '.join([*arguments, *([word] if word else [])])}]({name})")
    made.points[name] = points
    made.values.update(draft.values)


@dataclass
class _Draft:
    """A formula that may become part of a chain, with the values that it would need."""

    name: str
    choose: random.Random
    frames: int
    inverse: bool
    values: dict[str, str] = field(default_factory=dict[str, str])

    @property
    def sign(self) -> float:
        return -1.0 if self.inverse else 1.0

    def length(self, near: float) -> tuple[str, Floats]:
        """What stands in the formula for a length, and its values (F,): a number, or a name, with one value or F."""
        choose = self.choose
        value = round(near * choose.uniform(0.6, 1.4), 2)
        name = f"L{self.name}{len(self.values)}"
        if choose.random() < 0.12:
            course = np.array([value * (1 + 0.02 * math.sin(k)) for k in range(self.frames)])
            self.values[name] = str(course.tolist())
            return name, course
        if choose.random() < 0.4:
            return repr(value), np.full(self.frames, value)
        self.values[name] = repr(value)
        return name, np.full(self.frames, value)

    def angle(self, still: float) -> tuple[str, Floats]:
        """An angle, which by the chance ``still`` is constant."""
        value = round(self.choose.uniform(-180, 180), 2)
        name = f"a{self.name}"
        course = np.full(self.frames, value)
        if self.choose.random() < still:
            self.values[name] = repr(value)
            return name, course
        steady, jerky = np.arange(self.frames) * 7.5, np.array([40 * math.sin(k) for k in range(self.frames)])
        course = course + self.choose.choice([steady, jerky])
        self.values[name] = str(course.tolist())
        return name, course

    def solved(self, function: str, names: list[str], places: list[Complexes]) -> tuple[list[str], Complexes] | None:
        """The arguments and the points of a formula by its meaning; None where it has no solution, or hardly one."""
        ways: dict[str, Callable[[list[str], list[Complexes]], tuple[list[str], Complexes] | None]] = {
            "PLLP": self._circles,
            "PLPP": self._line,
            "PALP": self._direction,
            "PXY": self._offset,
            "PPP": lambda names, places: (names, places[2] + (places[1] - places[0])),
        }
        return ways.get(function, self._polar if function == "PLAP" else self._from_x_axis)(names, places)

    def _from_x_axis(self, names: list[str], places: list[Complexes]) -> tuple[list[str], Complexes]:
        (text, r), (degrees, turned) = self.length(120.0), self.angle(0.4)
        return [names[0], text, degrees], places[0] + r * np.exp(1j * np.radians(self.sign * turned))

    def _polar(self, names: list[str], places: list[Complexes]) -> tuple[list[str], Complexes] | None:
        base = places[1] - places[0]
        if np.abs(base).min() < 5:
            return None
        arguments, point = self._from_x_axis(names, places)
        return [*arguments, names[1]], places[0] + (point - places[0]) * base / np.abs(base)

    def _circles(self, names: list[str], places: list[Complexes]) -> tuple[list[str], Complexes] | None:
        base = places[1] - places[0]
        far = np.abs(base)
        if far.min() < 5:
            return None
        (one, r), (two, s) = self.length(float(far.mean())), self.length(float(far.mean()))
        x = (r * r - s * s + far * far) / (2 * far)
        square = r * r - x * x
        if (square < (ROOM * np.minimum(r, s)) ** 2).any():
            return None
        return [names[0], one, two, names[1]], places[0] + (x + self.sign * 1j * np.sqrt(square)) * base / far

    def _line(self, names: list[str], places: list[Complexes]) -> tuple[list[str], Complexes] | None:
        text, r = self.length(120.0)
        base = places[2] - places[1]
        if np.abs(base).min() < 5:
            return None
        point = self._farther(places[0], r, places[1], base / np.abs(base))
        return None if point is None else ([names[0], text, names[1], names[2]], point)

    def _direction(self, names: list[str], places: list[Complexes]) -> tuple[list[str], Complexes] | None:
        (degrees, turned), (text, r) = self.angle(0.5), self.length(120.0)
        base = (places[1] - places[0]) * np.exp(1j * np.radians(turned))
        if np.abs(base).min() < 5:
            return None
        unit = base / np.abs(base)
        if np.ptp(np.sign(unit.real)) > 0 or np.abs(unit.real).min() < 0.05 or np.abs(np.diff(unit)).max() > 0.5:
            return None  # the line comes to be upright, between frames at least: the smaller x is another point then
        unit = unit * np.where(unit.real > 0, -1, 1)
        point = self._farther(places[1], r, places[0], unit)
        return None if point is None else ([names[0], degrees, text, names[1]], point)

    def _farther(self, centre: Complexes, r: Floats, start: Complexes, unit: Complexes) -> Complexes | None:
        foot = start + ((centre - start) * unit.conjugate()).real * unit
        square = r * r - np.abs(centre - foot) ** 2
        return None if (square < (ROOM * r) ** 2).any() else foot + self.sign * np.sqrt(square) * unit

    def _offset(self, names: list[str], places: list[Complexes]) -> tuple[list[str], Complexes]:
        (x, u), (y, v) = self.length(50.0), self.length(-70.0)
        return [names[0], x, y], places[0] + u + 1j * v
