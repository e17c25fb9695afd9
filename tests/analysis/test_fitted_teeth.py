"""`mesh/fitted`: the angle by which a gear is turned to fit its teeth is told, and is the one that it is turned by."""

from __future__ import annotations

import math
import random
import re

import pytest

from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, understand


def notes_and_angles(text: str) -> tuple[dict[str, float], dict[str, float]]:
    timeline = arranged(understand(SourceText("gears.mov", text)), Choices())
    solution = examined(timeline, Choices())
    said = [item.message for item in solution.diagnostics if item.code == "mesh/fitted"]
    found = [re.match(r"`(\w+)` is turned by (\S+) degrees, .* of `\w+`$", message) for message in said]
    poses = solution.motion.poses_at([timeline.start])
    angles = {thing.name: float(poses.angle[thing.number][0]) for thing in timeline.scene.things}
    return {match[1]: float(match[2]) for match in found if match}, angles


@pytest.mark.parametrize("seed", range(24))
def test_the_angle_of_a_gear_that_nothing_else_turns(seed: int) -> None:
    made = random.Random(seed)
    n1, n2 = made.randint(8, 60), made.randint(8, 60)
    kind = made.choice(["gears", "ring", "rack"])
    where = made.uniform(-180.0, 180.0)
    if kind == "rack":
        first = f"First : .rack({n1}, 4) P = [0,0] Q = [200,0]"
        at = (made.uniform(0.0, 100.0), 2.0 * n2)
        centre, rest = "First.P = [0,0]", "First.angle = 0"
    else:
        n1 += n2 * (kind == "ring")
        first = f"First : .gear({n1}, 4){' .inner' * (kind == 'ring')} C = [0,0]"
        far = 2.0 * (n1 - n2 if kind == "ring" else n1 + n2)
        at = (far * math.cos(math.radians(where)), far * math.sin(math.radians(where)))
        centre, rest = "First.C = [0,0]", "First.angle = 90*.t"
    place = f"[{at[0]!r}, {at[1]!r}]"
    text = (
        f"{first}; Second : .gear({n2}, 4) C = {place};\n"
        f"@0 {centre}; {rest}; Second.C = {place}; .mesh(First, Second) = 0;\n@1\n"
    )
    told, angles = notes_and_angles(text)
    turn = angles["Second"]
    assert abs(turn) <= 180.0 / n2 + 1e-6
    if abs(turn) > 1e-5:
        assert told == {"Second": pytest.approx(turn, rel=1e-5)}
    else:
        assert told == {}


def test_the_driver_may_be_named_last_and_nothing_is_told_of_teeth_that_fit() -> None:
    pair = "A : .gear(20, 4) C = [100,100]; B : .gear(12, 4) C = [164,100]; @0 A.C = [100,100]; B.C = [164,100];"
    told, angles = notes_and_angles(f"{pair} .mesh(A, B) = 0; B.angle = 90*.t; @1")
    assert told == {"A": pytest.approx(angles["A"])}
    assert abs(angles["A"]) == pytest.approx(9.0)
    assert notes_and_angles(f"{pair.replace('12, 4', '11, 4').replace('164', '162')} .mesh(A, B) = 0; @1")[0] == {}


@pytest.mark.parametrize("seed", range(12))
def test_a_planet_that_is_drawn_anywhere_is_told_as_turned_as_it_is(seed: int) -> None:
    """Once, though it is in mesh with two; where it is drawn does not count."""
    made = random.Random(seed)
    sun, planet = made.randint(10, 30), made.randint(9, 20)
    ring, at = sun + 2 * planet, f"[{made.uniform(-300, 300)}, {made.uniform(-300, 300)}]"
    told, angles = notes_and_angles(
        f"""Ring : .gear({ring}, 4) .inner C = [0,0]; Sun : .gear({sun}, 4) C = [0,0] T = C + [9,0];
        Planet : .gear({planet}, 4) C = {at} T = C + [9,0]; Arm : .bar C = [0,0] P = C + [{2 * (sun + planet)},0];
        @0 Ring.C = [0,0]; Ring.angle = 0; Sun.C = Ring.C; Arm.C = Ring.C; Planet.C = Arm.P; Sun.angle = 90*.t;
        .mesh(Sun, Planet) = 0; .mesh(Ring, Planet) = 0; @1"""
    )
    turn = angles["Planet"]
    small = {"Planet": pytest.approx(turn, rel=1e-5)} if 1e-5 < abs(turn) <= 180.0 / planet + 1e-6 else {}
    assert told == small
