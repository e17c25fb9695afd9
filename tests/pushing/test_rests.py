"""What rests between two pushes has the same numbers in all of its frames, to the last bit: nothing is drawn anew."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad
from tests.pushing.escapements import Escapement
from tests.pushing.families import Counter, Dogs
from tests.pushing.scripts import Geneva, Place, Ratchet

PLACE = Place(12.0, 7.0, 200.0, 3.0, mirrored=True)
FAMILIES = [
    *((Escapement(teeth, teeth // 4, swing).text(PLACE, 2), "Wheel") for teeth in (15, 20, 30) for swing in (3.5, 6.0)),
    *((Geneva(slots, play).text(PLACE, 2), "Wheel") for slots in (3, 4, 7, 12) for play in (0.0, 0.8)),
    *((Ratchet(teeth, 0.3, swing).text(PLACE, 2), "Wheel") for teeth in (8, 24) for swing in (50.0, 70.0)),
    *((Dogs(3, swing).text(PLACE), "W2") for swing in (400.0, 900.0)),
    (Counter(6, 2).text(PLACE, 2.2, 50.0), "W1"),
]


def steps_of(motion: mv.Motion, thing: str) -> np.ndarray:
    """(F - 1,) how much changes from frame to frame: where a thing is, and the cosine and sine of its direction."""
    poses, number = motion.poses(), motion.things.index(thing)
    numbers = np.concatenate([poses.origin[number], poses.direction[number]], axis=1)
    return np.abs(np.diff(numbers, axis=0)).max(axis=1)


@broad(("text", "thing"), FAMILIES, every=5, ids=[f"{thing}{k}" for k, (_, thing) in enumerate(FAMILIES)])
def test_a_dwell_is_the_same_to_the_last_bit(text: str, thing: str) -> None:
    steps = steps_of(mv.loads(text).solve(), thing)
    assert np.count_nonzero(steps == 0.0) >= 5
    assert np.count_nonzero(steps > 1e-6) >= 5
    rests = steps < 1e-6
    within = rests[:-2] & rests[1:-1] & rests[2:]  # at both ends of a dwell a frame may be that of a push
    assert steps[1:-1][within & (steps[1:-1] > 0.0)].tolist() == []


@pytest.mark.parametrize("speed", [1e-6, 1e-8])
def test_what_is_slow_does_not_rest(speed: float) -> None:
    """A block that is pushed, and one that is drawn, by less than rounding in each step, are where they should be."""
    text = f"""
        .config(100, 300, 100);
        A : .bar O=[0,50] P=[10,50];   B : .bar O=[20,50] P=[50,50];   C : .bar O=[0,80] P=[10,80];
        @0 A.O = [{speed}*.t, 50];  A.angle = 0;  B.O.y = 50;  B.angle = 0;  C.O.y = 80;  C.angle = 0;
           B.O.x - A.O.x >= 20 .pushes;
           C.O.x >= -1 .pushes;   C.O.x ~ .most .weak .speed({speed});
        @10
    """
    motion = mv.loads(text).solve()
    assert np.abs(motion["B.O"][:, 0] - 20.0 - speed * motion.times).max() < 1e-10
    assert np.abs(motion["C.O"][:, 0] - speed * motion.times).max() < 1e-10
