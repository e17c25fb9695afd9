"""Of things that begin inside each other: the pose that is offered is free, keeps the equations, and is near."""

from __future__ import annotations

import re

import numpy as np
import pytest

import movimentum as mv
from tests.pushing.test_bad_input import error_of


def offered(text: str) -> dict[str, list[float]]:
    """What the help says about where things are free."""
    error = error_of(text)
    assert error.code == "contact/start"
    number = r"-?[0-9.e+-]*[0-9]"
    said = re.findall(rf"`([\w.]+)` at (?:\[({number}), ({number})\]|({number}))", str(error.helps[0]))
    assert said, error.helps
    return {name: [float(each) for each in rest if each] for name, *rest in said}


@pytest.mark.parametrize("seed", range(4))
def test_an_arm_turns_aside(seed: int) -> None:
    random = np.random.default_rng(seed)
    way, far, radius, width = random.uniform(-20, 20), random.uniform(60, 100), random.uniform(12, 20), 10.0
    turn = way + random.uniform(-6, 6)
    x, y = 150 + far * np.cos(np.radians(way)), 150 + far * np.sin(np.radians(way))

    def text(angle: float) -> str:
        return f"""Arm : .bar O = [150,150] P = O + [120,0].r({angle!r}) .width(10);
        Post : .disc({radius}) C = [{x},{y}];
        @0 Arm.O = [150,150];   Post.C = [{x},{y}];   .gap(Arm, Post) >= 0 .pushes;   @0.1"""

    (least,) = offered(text(turn))["Arm.angle"]
    aside = np.degrees(np.arcsin((radius + width / 2) / far))
    assert turn + least == pytest.approx(way + np.copysign(aside, turn - way), abs=1e-6)
    mv.loads(text(turn + least)).solve()


@pytest.mark.parametrize("slope", [0.5, -1.2])
def test_a_slider_stays_on_its_line(slope: float) -> None:
    def text(x: float) -> str:
        return f"""A : .disc(20) C = [100,100];   B : .disc(15) C = [{x!r},{100 + 8 + slope * (x - 100)!r}];
        @0 A.C = [100,100];   B.C = [x, 108 + {slope}*(x - 100)];   .gap(A, B) >= 0 .pushes;   @0.1"""

    x, y = offered(text(103))["B.C"]
    assert y == pytest.approx(108 + slope * (x - 100), abs=1e-6)
    assert np.hypot(x - 100, y - 100) == pytest.approx(35, abs=1e-6)
    mv.loads(text(x)).solve()


@pytest.mark.slow
def test_lengths_are_kept() -> None:
    text = """Crank : .bar A = [100,100] B = [140,100];   Rod : .bar B = [140,100] C = [260,150] .width(8);
    Rock : .bar D = [260,70] C = [260,150];   Post : .disc(10) C = [200,125];
    @0 Crank.A = [100,100];   Rod.B = Crank.B;   Rock.D = [260,70];   Rock.C = Rod.C;   Post.C = [200,125];
       .gap(Rod, Post) >= 0 .pushes;   @0.1"""
    found = offered(text)
    b, turn = np.array(found["Rod.B"]), np.radians(found["Rod.angle"][0])
    c = b + np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ [120, 50]
    assert np.hypot(*(b - [100, 100])) == pytest.approx(40, abs=1e-6)
    assert np.hypot(*(c - [260, 70])) == pytest.approx(80, abs=1e-6)
    along = (c - b) / 130
    assert abs(along[0] * (125 - b[1]) - along[1] * (200 - b[0])) == pytest.approx(14, abs=1e-6)


def test_what_has_no_room_between_walls_is_free_beyond_them() -> None:
    walls = "".join(
        f"W{k} : .polygon A = [{x},50] B = [{x + 10},50] C = [{x + 10},150] D = [{x},150];"
        for k, x in ((1, 50), (2, 90))
    )
    text = f"""{walls} B : .disc(20) C = [76,100];
    @0 W1.A = [50,50];  W1.angle = 0;  W2.A = [90,50];  W2.angle = 0;  B.C.y = 100;
       .gap(W1, B) >= 0 .pushes;  .gap(B, W2) >= 0 .pushes;  @0.1"""
    assert offered(text)["B.C"][0] == pytest.approx(120, abs=1e-6)


def test_what_no_statement_moves_is_named() -> None:
    text = "A : .disc(20) C = [75,100]; B : .disc(20) C = [80,100]; @0 A.C = [75,100]; .gap(A, B) >= 0 .pushes;"
    error = error_of(f"{text} @0.1")
    assert "`B` stays as it is drawn" in error.notes[0]
    typed = re.findall(r"`(B\.C = .*?;)`", str(error.helps))[0]
    assert offered(f"{text} {typed} @0.1")["B.C"] == pytest.approx([115, 100], abs=1e-6)
