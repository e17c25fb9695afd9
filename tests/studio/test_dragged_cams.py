"""Cams, slots and rolling curves under the hand: a move is answered before the next picture is due."""

from __future__ import annotations

import time

import pytest

from tests.studio.bench import Bench

HEAD = ".config(25, 500, 400);\n"
CAM = "Cam : .curve C = [150,100] P = [180,100] .polar(th, 40 + 9*.cos(2*th));   "
FACE = "@0 Cam.C = [150,100]; F.A.x = 90; F.angle = 0; F.A.y > 100; .gap(F, Cam) = 0;\n@4"
SLOT = "Slot : .curve A = [80,80] .through([0,0], [40,40], [90,0], [120,40]) .open;   "
OVAL = ".param(u, [30 + 50*.cos(u), 40*.sin(u)])"
ROLL = "@0 A.F = [150,200]; B.F = [250,200]; .roll(A, B) = 0;\n@2"
MOVE = 0.016
"""Seconds: a picture of a screen."""


@pytest.mark.parametrize(
    ("text", "thing", "anchor", "to"),
    [
        (
            CAM + "R : .disc(10) C = [150,160];\n@0 Cam.C = [150,100]; R.C.x = 150; R.C.y > 100; .gap(R, Cam) = 0;\n@4",
            *("Cam", "P", (170, 130)),
        ),
        (
            f"{CAM}F : .bar A = [90,160] B = [210,160];\n{FACE}",
            *("Cam", "P", (170, 130)),
        ),
        (
            f"{SLOT}P : .disc(5) P = [100,95];\n@0 Slot.A = [80,80]; Slot.angle = 0; .on(P.P, Slot) = 0;\n@4",
            *("P", "P", (130, 110)),
        ),
        (
            f"A : .curve F = [150,200] G = [200,200] {OVAL};\nB : .curve F = [250,200] G = [310,200] {OVAL};\n{ROLL}",
            *("A", "G", (170, 230)),
        ),
    ],
)
def test_a_move_of_what_touches_takes_less_than_a_picture(text, thing, anchor, to):
    bench = Bench(HEAD + text)
    bench.drag(thing, anchor, to, moves=3)
    begun, moves = time.process_time(), 30
    bench.drag(thing, anchor, (to[0] + 5, to[1] + 7), moves=moves)
    assert (time.process_time() - begun) / moves < MOVE
