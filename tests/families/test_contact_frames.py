"""Contact is the same however it is drawn: scaled, moved, mirrored, at any frame rate, from far off, for many turns."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum
from tests.broad import broad


class Draw:
    """A drawing that is scaled, mirrored in the vertical and moved."""

    def __init__(self, scale, flip, dx, dy):
        self.scale, self.sign, self.dx, self.dy = scale, -1.0 if flip else 1.0, dx, dy

    def at(self, x, y):
        """A place as text."""
        return f"[{self.sign * self.scale * x + self.dx!r}, {self.scale * y + self.dy!r}]"

    def back(self, points):
        """(F, 2) in the terms of the drawing."""
        return np.stack([(points[:, 0] - self.dx) / (self.sign * self.scale), (points[:, 1] - self.dy) / self.scale], 1)


def curve(seed, draw):
    """A closed curve in polar form, with two harmonics, as text."""
    random = np.random.default_rng(seed)
    a, b, c = 40.0, *random.uniform(0.5, 1.5, 2).tolist()
    p, q = random.uniform(-180.0, 180.0, 2).tolist()
    radius = f"{draw.scale!r}*({a!r} + {b!r}*.cos(2*th - ({p!r})) + {c!r}*.sin(3*th - ({q!r})))"
    return f".param(th, [{draw.sign!r}*({radius})*.cos(th), ({radius})*.sin(th)])"


def roller(seed, draw, *, start=70.0, turns=1.0):
    return (
        f"""Cam : .curve C = {draw.at(0, 0)} {curve(seed, draw)};
R : .disc({6.0 * draw.scale!r}) C = {draw.at(3, start)};
@0 Cam.C = {draw.at(0, 0)}; Cam.angle = {draw.sign * 360.0 * turns}*.t;
   R.C.x = {draw.sign * draw.scale * 3 + draw.dx!r}; R.C.y > {draw.dy!r}; .gap(R, Cam) = 0;
@1""",
        "R.C",
    )


def face(seed, draw, *, start=70.0, turns=1.0):
    return (
        f"""Cam : .curve C = {draw.at(0, 0)} {curve(seed, draw)};
F : .bar A = {draw.at(-90, start)} B = {draw.at(90, start)};
@0 Cam.C = {draw.at(0, 0)}; Cam.angle = {draw.sign * 360.0 * turns}*.t;
   F.A.x = {-draw.sign * draw.scale * 90 + draw.dx!r}; F.B.y = F.A.y; F.A.y > {draw.dy!r}; .gap(F, Cam) = 0;
@1""",
        "F.A",
    )


def pin(seed, draw, *, turns=1.0):
    return (
        f"""Slot : .curve C = {draw.at(0, 0)} {curve(seed, draw)};
P : .disc({2.0 * draw.scale!r}) P = {draw.at(40, 0)};
@0 Slot.C = {draw.at(0, 0)}; Slot.angle = 0; .on(P.P, Slot) = 0; .where(P.P, Slot) = {turns}*.t;
@1""",
        "P.P",
    )


def pair(seed, draw, *, start=90.0, turns=1.0):
    return (
        f"""A : .curve C = {draw.at(0, 0)} {curve(seed, draw)};
B : .curve C = {draw.at(0, start)} {curve(seed + 50, draw)};
@0 A.C = {draw.at(0, 0)}; A.angle = {draw.sign * 360.0 * turns}*.t; B.angle = 0;
   B.C.x = {draw.dx!r}; B.C.y > {draw.dy!r}; .gap(A, B) = 0;
@1""",
        "B.C",
    )


KINDS = {"roller": roller, "pin": pin, "face": face, "pair": pair}
PLAIN = Draw(1.0, flip=False, dx=0.0, dy=0.0)


def places(text, name, fps=20):
    return movimentum.loads(f".config({fps}, 400, 400);\n{text}").solve()[name]


@broad("kind", [*KINDS], first=2)
@broad(
    "draw",
    [Draw(3.7, flip=False, dx=0.0, dy=0.0), Draw(0.25, flip=True, dx=120.0, dy=-35.0),
     Draw(1.0, flip=True, dx=0.0, dy=0.0), Draw(0.001, flip=True, dx=0.1, dy=-0.05),
     Draw(1000.0, flip=False, dx=20000.0, dy=-9000.0)],
    first=2,
)  # fmt: skip
def test_a_contact_that_is_scaled_moved_and_mirrored(kind, draw):
    for seed in range(2):
        plain = places(*KINDS[kind](seed, PLAIN))
        assert draw.back(places(*KINDS[kind](seed, draw))) == pytest.approx(plain, abs=1e-9)


@broad("kind", [*KINDS], first=2)
def test_a_contact_does_not_depend_on_the_frame_rate(kind):
    text, name = KINDS[kind](3, PLAIN)
    every = places(text, name, fps=7 * 25 * 60)
    for fps in (7, 25, 60):
        assert places(text, name, fps=fps) == pytest.approx(every[:: 7 * 25 * 60 // fps], abs=1e-9)


@broad("kind", ["roller", "face", "pair"], first=1)
@broad("start", [48.0, 400.0, -60.0, -20.0, 5.0, 130.0, 2000.0], first=3)
def test_a_contact_is_found_from_far_off(kind, start):
    """Also from within, and from the side that an inequality excludes."""
    text, name = KINDS[kind](5, PLAIN)
    assert places(*KINDS[kind](5, PLAIN, start=start)) == pytest.approx(places(text, name), abs=1e-9)


@broad("kind", ["pin", "roller", "face", "pair"], first=1)
def test_a_contact_repeats_over_many_turns(kind):
    text, name = KINDS[kind](7, PLAIN, turns=1.0)
    once = places(text, name, fps=20)[:-1]
    text, name = KINDS[kind](7, PLAIN, turns=100.0)
    many = places(text, name, fps=2000)[:-1]
    assert many.reshape(100, 20, 2) == pytest.approx(np.broadcast_to(once, (100, 20, 2)), abs=1e-10)
