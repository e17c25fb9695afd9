"""An integral across a pole of its integrand has no value behind it, and that is told with the time; a singularity that
can be integrated is no pole.
"""

from __future__ import annotations

import random
import re

import pytest

from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, understand

SCENE = ".config(10, 60, 40);\nA : .bar P = [0,0] Q = [10,0];\n@0 A.P = [0,0]; A.angle = {angle}; x = .i({inside});\n@1"


def told(inside: str, angle: str = "0") -> tuple[int, str]:
    """The fault, and the first error's message."""
    source = SourceText("a.mov", SCENE.format(inside=inside, angle=angle))
    found = examined(arranged(understand(source), Choices()), Choices())
    return found.fault, next((item.message for item in found.diagnostics if item.severity == "error"), "")


def assert_pole(inside: str, place: float, angle: str = "0") -> None:
    fault, message = told(inside, angle)
    assert fault == 3, inside
    when = re.search(r"no finite value from t = ([0-9.e-]+) on", message)
    assert when is not None, message
    assert float(when[1]) == pytest.approx(place, abs=1e-8), inside


# fmt: off
POLES = ["{k}/(.t - {p})", "{k}/(.t - {p})^2", "1/.abs(.t - {p})", "{k}/(.t^2 - {p}^2)",
         "{k}/.sin(50*(.t - {p}))", ".tan(90 + 40*(.t - {p}))", "{k} + .sin(90*.t)/(.t - {p})",
         "{k}*.t + .t/(.t - {p})",          "1/.abs(.t - {p})^1.5", "1/(.exp(.t) - .exp({p}))"]
GOOD = ["1/.sqrt(.abs(.t - {p}))", "1/.abs(.t - {p})^0.8", ".ln(.abs(.t - {p}))", "1/(.t + {p})",
        "1/((.t - {p})^2 + 0.0001)", ".abs(.t - {p})", ".floor(10*.t)", ".abs(.sin(900*.t))", "{{.t : 1 > {p} : 2}}",
        ".sin(40*(.t - {p}))/(.t - {p} + 2)", "(1 - .cos(20*(.t - {p})))/(.t - {p})^2",
        "(.t^2 - {p}^2)/(.t - {p})", ".sin(50*(.t - {p}))/(.t - {p})"]
# fmt: on


def _family(forms: list[str], seeds: range) -> list[tuple[str, float]]:
    found: list[tuple[str, float]] = []
    for seed in seeds:
        chance = random.Random(seed)
        place = chance.choice((0.5, 0.25, 0.3, round(chance.uniform(0.05, 0.95), 4), chance.uniform(0.05, 0.95)))
        found.append((chance.choice(forms).format(p=repr(place), k=chance.choice((1, -3, 250, 1e-4))), place))
    return found


@pytest.mark.slow
def test_poles_are_told_with_the_time() -> None:
    for inside, place in _family(POLES, range(4)):
        assert_pole(inside, place)


@pytest.mark.slow
def test_a_pole_through_what_is_solved_for() -> None:
    assert_pole("1/(A.Q.x - 7)", 0.5, "2*.acos(0.7)*.t")


def test_what_can_be_integrated_is() -> None:
    for inside, _ in _family(GOOD, range(4)):
        assert told(inside)[0] == 0, inside


@pytest.mark.slow
def test_many_poles() -> None:
    for inside, place in _family(POLES, range(4, 84)):
        assert_pole(inside, place)
    for inside, _ in _family(GOOD, range(4, 64)):
        assert told(inside)[0] == 0, inside
