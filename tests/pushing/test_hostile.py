"""Mechanisms at random (places, turns, mirrors, scales, orders of statements, frame rates) against closed forms."""

from __future__ import annotations

import math
import random
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad
from tests.pushing.scripts import Place

SCRIPTS = Path(__file__).parents[2] / "scripts"


class Drawn:
    """A place, and ways to say in it what stands in the plain scene."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        r = self.random
        turned, scale = r.choice([0.0, 90.0, r.uniform(0.0, 360.0)]), r.choice([1.0, 0.02, 40.0, r.uniform(0.1, 10.0)])
        self.place = Place(r.uniform(-200, 300), r.uniform(-200, 300), turned, scale, r.random() < 0.5)
        o, p, q = (self.place.at(*point) for point in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
        self.along, self.across = (p[0] - o[0], p[1] - o[1]), (q[0] - o[0], q[1] - o[1])

    def coordinate(self, point: str, *, across: bool = False) -> str:
        """An expression for how far along (across) an anchor is, in the plain scene's direction, but in pixels."""
        (x, y), scale = self.across if across else self.along, self.place.scale
        return f"({x / scale:.15g}*{point}.x + ({y / scale:.15g})*{point}.y)"

    def on_line(self, point: str, y: float) -> str:
        """The statement that keeps an anchor on the plain line at ``y``."""
        x0, y0 = self.place.at(0.0, y)
        (a, b), scale = self.across, self.place.scale
        return f"{self.coordinate(point, across=True)} = {(a * x0 + b * y0) / scale:.15g};"

    def text(self, things: list[str], says: list[str], end: float) -> str:
        self.random.shuffle(says)
        fps = self.random.choice([7, 25, 60])
        return f".config({fps}, 400, 300);\n{' '.join(things)}\n@0 " + "\n   ".join(says) + f"\n@{end}"

    def moved(self, x: float, y: float, way: float, law: str) -> str:
        """A vector that begins at a plain point and goes ``way`` times a ``law`` along."""
        (px, py), (a, b) = self.place.at(x, y), self.along
        return f"[{px:.15g} + ({a * way:.15g})*{law}, {py:.15g} + ({b * way:.15g})*{law}]"

    def off(self, motion: mv.Motion, anchor: str, x: np.ndarray, y: np.ndarray) -> float:
        """How far it is from plain places, in plain units."""
        want = np.array([self.place.at(*point) for point in zip(x, y, strict=True)])
        return float(np.abs(motion[anchor] - want).max()) / self.place.scale


@broad("seed", range(40), every=9)
def test_blocks_in_a_row_are_pushed_and_stay(seed: int) -> None:
    drawn = Drawn(seed)
    r, place = drawn.random, drawn.place
    count, far, rate = r.randint(2, 6), r.uniform(30, 120), r.choice([90.0, 137.0, 180.0])
    widths = [r.uniform(8, 30) for _ in range(count)]
    starts = [0.0]
    for width in widths[:-1]:
        starts.append(starts[-1] + width + (r.uniform(0, 25) if r.random() < 0.85 else 0.0))
    things: list[str] = []
    says: list[str] = []
    for k, (x, w) in enumerate(zip(starts, widths, strict=True)):
        corners = [place.said(*point) for point in ((x, 0), (x + w, 0), (x + w, 20), (x, 20))]
        things.append(f"B{k} : .polygon " + " ".join(f"P{j} = {corner}" for j, corner in enumerate(corners)) + ";")
        says.append(f"B{k}.angle = 0;")
        if k:
            says += [drawn.on_line(f"B{k}.P0", 0.0), f".gap(B{k}, B{k - 1}) >= 0 .pushes;"]
    says.append(f"B0.P0 = {drawn.moved(0.0, 0.0, 0.5 * far, f'(1 - .cos({rate}*.t))')};")
    motion = mv.loads(drawn.text(things, says, 4.0)).solve()
    turned = np.minimum(rate * motion.times, 180.0)
    pushed = 0.5 * far * (1.0 - np.cos(np.radians(turned)))
    for k in range(1, count):
        x = np.maximum(starts[k], pushed + sum(widths[:k]))
        assert drawn.off(motion, f"B{k}.P0", x, np.zeros_like(x)) < 1e-7


@broad("seed", range(100, 140), every=9)
def test_lost_motion_in_a_chain(seed: int) -> None:
    drawn = Drawn(seed)
    r, place = drawn.random, drawn.place
    count, far, rate = r.randint(1, 4), r.uniform(20, 80), r.choice([90.0, 150.0, 200.0])
    plays = [r.uniform(2, 15) for _ in range(count)]
    things = [f"A : .bar O = {place.said(0, 0)} P = {place.said(20, 0)};"]
    says = [f"A.O = {drawn.moved(0.0, 0.0, far, f'.sin({rate}*.t)')};", "A.angle = 0;"]
    for k, play in enumerate(plays):
        y, before = 30.0 * (k + 1), f"C{k - 1}" if k else "A"
        things.append(f"C{k} : .bar O = {place.said(0, y)} P = {place.said(15, y)};")
        apart = f"{drawn.coordinate(f'C{k}.O')} - {drawn.coordinate(f'{before}.O')}"
        says += [drawn.on_line(f"C{k}.O", y), f"C{k}.angle = 0;"]
        says += [f"{apart} >= {-play * place.scale:.15g} .pushes;", f"{apart} <= {play * place.scale:.15g} .pushes;"]
    motion = mv.loads(drawn.text(things, says, 4.0)).solve()
    turns = [(90.0 + 180.0 * j) / rate for j in range(5)]
    times = np.unique(np.concatenate([[t for t in turns if t < 4.0], motion.times]))
    x = far * np.sin(np.radians(rate * times))
    for k, play in enumerate(plays):
        here, followed = 0.0, np.empty_like(x)
        for n, value in enumerate(x):
            here = followed[n] = min(max(here, value - play), value + play)
        x, y = followed, np.full(len(motion.times), 30.0 * (k + 1))
        assert drawn.off(motion, f"C{k}.O", x[np.searchsorted(times, motion.times)], y) < 1e-7


@broad("seed", range(200, 240), every=9)
def test_a_disc_turns_a_bar_aside(seed: int) -> None:
    drawn = Drawn(seed)
    r, place = drawn.random, drawn.place
    radius, high, begin, end = r.uniform(3, 12), r.uniform(20, 60), -r.uniform(60, 90), r.uniform(-20, 40)
    first, width = r.uniform(80, 100), r.choice([0.0, 4.0])
    tip = 200.0 * math.cos(math.radians(first)), 200.0 * math.sin(math.radians(first))
    broad_ = f" .width({width * place.scale:.15g})" if width else ""
    things = [
        f"Bar : .bar O = {place.said(0, 0)} P = {place.said(*tip)}{broad_};",
        f"D : .disc({radius * place.scale:.15g}) C = {place.said(begin, high)};",
    ]
    says = [f"Bar.O = {place.said(0, 0)};", f"D.C = {drawn.moved(begin, high, (end - begin) / 3.0, '.t')};"]
    says += ["D.angle = 0;", ".gap(Bar, D) >= 0 .pushes;"]
    motion = mv.loads(drawn.text(things, says, 3.0)).solve()
    x = begin + (end - begin) * motion.times / 3.0
    lag = np.degrees(np.arcsin((radius + 0.5 * width) / np.hypot(x, high)))
    truth = np.minimum(first, np.degrees(np.arctan2(high, x)) - lag)
    turned = motion["Bar.angle"] - motion["Bar.angle"][0]
    assert np.abs(place.sense * turned - (truth - truth[0])).max() < 1e-7


@broad("seed", range(300, 340), every=9)
def test_an_eccentric_lifts_a_follower_that_is_pulled_down(seed: int) -> None:
    drawn = Drawn(seed)
    r, place = drawn.random, drawn.place
    radius, aside, own = r.uniform(20, 40), r.uniform(4, 15), r.uniform(3, 10)
    rate, begin = r.choice([120.0, 180.0, 250.0]), r.uniform(-60, 60)
    centre = aside * math.cos(math.radians(begin)), aside * math.sin(math.radians(begin))

    def lift(turned: np.ndarray) -> np.ndarray:
        angle = np.radians(begin + turned)
        return aside * np.sin(angle) + np.sqrt((radius + own) ** 2 - (aside * np.cos(angle)) ** 2)

    high = float(lift(np.zeros(1))[0])
    things = [
        f"Cam : .disc({radius * place.scale:.15g}) C = {place.said(*centre)};",
        f"Arm : .bar O = {place.said(0, 0)} E = {place.said(*centre)};",
        f"F : .disc({own * place.scale:.15g}) C = {place.said(0, high)};",
    ]
    x0, y0 = place.at(0.0, 0.0)
    still = (drawn.along[0] * x0 + drawn.along[1] * y0) / place.scale
    says = [f"Arm.O = {place.said(0, 0)};", f"Arm.angle = {place.sense * rate}*.t;", "Cam.C = Arm.E;", "Cam.angle = 0;"]
    says += [f"{drawn.coordinate('F.C')} = {still:.15g};", "F.angle = 0;", ".gap(F, Cam) >= 0 .pushes;"]
    says.append(f"{drawn.coordinate('F.C', across=True)} ~ .least .weak .speed({2000 * place.scale:.15g});")
    motion = mv.loads(drawn.text(things, says, 3.0)).solve()
    y = lift(rate * motion.times)
    assert drawn.off(motion, "F.C", np.zeros_like(y), y) < 1e-7


# --- however it is asked for


@broad("fps", [7, 60], first=1)
def test_a_film_is_the_same_at_any_rate_and_moment(fps: int) -> None:
    text = (SCRIPTS / "ratchet.mov").read_text()
    usual = mv.loads(text).solve()
    other = mv.loads(text.replace(".config(25,", f".config({fps},")).solve()
    names = ["Wheel.angle", "Pawl.angle", "Holder.angle"]
    whole = usual.at(other.times)
    for name in names:
        assert np.abs(whole[name] - other[name]).max() < 1e-9
    backward = usual.at(list(reversed(other.times.tolist())))
    for name in names:
        assert np.abs(backward[name][::-1] - whole[name]).max() == 0.0


def _noted(called: list[str], name: str, *_: object, **__: object) -> None:
    called.append(name)


@pytest.mark.slow
def test_nothing_of_it_runs_where_nothing_pushes(monkeypatch: pytest.MonkeyPatch) -> None:
    from movimentum.solver.kinds.pushing import PushingKernel
    from movimentum.solver.pushing.contacts import Contacts
    from movimentum.solver.pushing.pushed_path import PushedPath

    called: list[str] = []
    for kind in (PushingKernel, Contacts, PushedPath):
        for name in [n for n, value in vars(kind).items() if callable(value)]:
            monkeypatch.setattr(kind, name, partial(_noted, called, name))
    films = [path for path in sorted(SCRIPTS.glob("*.mov")) if ".pushes" not in path.read_text()]
    assert len(films) > 30
    for path in films[::5]:
        assert mv.load(path).solve().solved.any()
    assert called == []
