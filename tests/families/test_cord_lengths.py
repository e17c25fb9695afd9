"""Cords that are too short or too long: the lengths that are possible, against closed forms, and a fix that works."""

from __future__ import annotations

import math
import random
import re

import pytest

import movimentum as mv
from tests.broad import broad
from tests.families.test_cords import length


def told(text: str) -> tuple[mv.Diagnostic, list[float]]:
    """The error about a cord, and the numbers in its note."""
    with pytest.raises(mv.NoSolutionError) as caught:
        mv.loads(text).solve()
    (error,) = (each for each in caught.value.diagnostics if each.severity is mv.Severity.ERROR)
    assert error.code == "cord/length"
    (note,) = error.notes
    return error, [float(each) for each in re.findall(r"[0-9.]+(?=,? (?:px|and))", note)]


def works(text: str, stated: str, error: mv.Diagnostic) -> None:
    """With the offered length there is a pose."""
    (fix,) = error.fixes
    (edit,) = fix.edits
    assert stated in text[edit.span.start : edit.span.end]
    mv.loads(text[: edit.span.start] + edit.text + text[edit.span.end :]).solve()


@broad("seed", range(12), first=1)
def test_a_cord_from_an_arm_is_taut_between_two_lengths(seed: int) -> None:
    """From an arm that turns, under a wheel, to a hook: the least and the greatest of many poses."""
    rng = random.Random(seed)
    arm, radius, far = rng.uniform(20, 60), rng.uniform(10, 30), rng.uniform(150, 250)
    hook = complex(far + rng.uniform(80, 200), rng.uniform(150, 220))

    def total(turn: float) -> float:
        return length([(arm * complex(math.cos(turn), math.sin(turn)), 0.0), (complex(far, 0), -radius), (hook, 0.0)])

    every = [total(2.0 * math.pi * k / 5000) for k in range(5000)]
    for stated in (min(every) * rng.uniform(0.2, 0.95), max(every) * rng.uniform(1.05, 1.5)):
        text = (
            f"Arm : .bar A = [0,0] B = [{arm!r},0]; Wheel : .disc({radius!r}) C = [{far!r},0];\n"
            f"@0 Arm.A = [0,0]; Wheel.C = [{far!r},0]; Wheel.angle = 0; "
            f".cord(Arm.B, -Wheel, [{hook.real!r},{hook.imag!r}]) = {stated!r};\n@1"
        )
        error, (low, high) = told(text)
        assert (low, high) == pytest.approx((min(every), max(every)), rel=5e-4)
        works(text, f"{stated!r}", error)


@broad("seed", range(12), first=2)
def test_a_belt_is_shortest_where_its_idler_just_touches_it(seed: int) -> None:
    rng = random.Random(100 + seed)
    big, small, far, idler = rng.uniform(30, 70), rng.uniform(10, 28), rng.uniform(150, 260), rng.uniform(8, 15)
    lean = math.asin((big - small) / far)
    shortest = 2.0 * math.sqrt(far**2 - (big - small) ** 2) + big * (math.pi + 2 * lean) + small * (math.pi - 2 * lean)
    stated = shortest * rng.uniform(0.3, 0.97)
    text = (
        f"Big : .disc({big!r}) C = [0,0]; Small : .disc({small!r}) C = [{far!r},0]; "
        f"Idler : .disc({idler!r}) C = [{far / 2!r},{big!r}];\n"
        f"@0 Big.C = [0,0]; Big.angle = 0; Small.C = [{far!r},0]; Small.angle = 0; Idler.C.x = {far / 2!r}; "
        f"Idler.angle = 0; Idler.C.y > 0; .cord(Big, -Idler, Small, Big) = {stated!r};\n@1"
    )
    error, numbers = told(text)
    assert numbers[0] == pytest.approx(shortest, rel=5e-4)
    assert error.fixes


@broad("seed", range(12), first=2)
def test_a_load_rises_to_the_wheel_at_most(seed: int) -> None:
    rng = random.Random(200 + seed)
    radius, x, y = rng.uniform(15, 40), rng.uniform(-200, -90), rng.uniform(-60, 60)
    stops = [(complex(x, y), 0.0), (0j, radius), (complex(radius, 0.0), 0.0)]
    shortest = length([*stops[:2], (complex(radius, -1e-9), 0.0)])
    stated = shortest * rng.uniform(0.3, 0.97)
    text = (
        f"Wheel : .disc({radius!r}) C = [0,0]; Load : .disc(4) P = [{radius!r},-50];\n"
        f"@0 Wheel.C = [0,0]; Wheel.angle = 0; Load.P.x = {radius!r}; Load.P.y <= 0; Load.angle = 0; "
        f".cord([{x!r},{y!r}], Wheel, Load.P) = {stated!r};\n@1"
    )
    error, numbers = told(text)
    assert numbers[0] == pytest.approx(shortest, rel=5e-4)
    works(text, f"{stated!r}", error)
