"""Drawing tools write what a person would have written."""

from __future__ import annotations

import math
import re
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from movimentum.diagnostics import Severity
from movimentum.source import Edit, SourceText, Span, edited
from movimentum.studio.messages import ToolUsed
from movimentum.studio.placing import NothingToDo
from movimentum.studio.tools import _carried_out, edits_between
from movimentum.studio.worker import TextWork
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine
from tests.studio.scripts import FOUR_BAR


class StillHands:
    """Dragging that have moved nothing."""

    def placed_at(self, job: TextWork, time: Fraction) -> Any:
        import numpy as np

        poses = job.motion.poses_at([time])
        return np.concatenate([poses.origin[:, 0], poses.direction[:, 0]], axis=1)


def used(text: str, tool: str, names: tuple[str, ...] = (), points: Any = (), time: float = 0.0) -> str:
    job = TextWork(1, Engine().revise(SourceText("x.mov", text)), Fraction(time))
    job.moved = job.revision.moves
    message = ToolUsed(1, tool, names, points, time)
    after = _carried_out(job, StillHands(), message, Choices()).text  # pyright: ignore[reportArgumentType]
    made = edits_between(text, after)
    assert edited(text, [Edit(Span(each["from"], each["to"]), each["text"]) for each in made]) == after
    found = Engine().revise(SourceText("x.mov", after)).diagnostics
    assert not [item for item in found if item.severity is Severity.ERROR], found
    return after


@pytest.mark.slow
def test_a_four_bar_from_nothing() -> None:
    text = ""
    for place in ((100, 100), (150.4, 199.6), (300, 220), (350, 100)):
        text = used(text, "anchor", ("",), (place,))
    for a, b in ("AB", "BC", "CD"):
        text = used(text, "rod", (f"{a}.P", f"{b}.P"), ((0, 0), (0, 0)))
    text = used(text, "fix", ("A.P",), ((0, 0),))
    text = used(text, "fix", ("D.P",), ((0, 0),))
    text = used(text, "attract", ("C.P",), ((400.2, 200),))
    assert text == (
        ".config(24, 640, 480) .theme('textbook');\n\n"
        "A : .disc(4)  P = [100, 100];\n"
        "B : .disc(4)  P = [150, 200];\n"
        "C : .disc(4)  P = [300, 220];\n"
        "D : .disc(4)  P = [350, 100];\n"
        "AB : .bar  A = [100, 100]  B = [150, 200];\n"
        "BC : .bar  B = [150, 200]  C = [300, 220];\n"
        "CD : .bar  C = [300, 220]  D = [350, 100];\n\n"
        "@0   AB.A = A.P;\n     AB.B = B.P;\n     BC.B = B.P;\n     BC.C = C.P;\n     CD.C = C.P;\n     CD.D = D.P;\n"
        "     A.P = [100, 100];\n     D.P = [350, 100];\n     C.P ~ [400, 200];\n"
    )
    free = used(text, "fix", ("A.P",), ((0, 0),))
    assert "A.P = [" not in free.replace("AB.A = A.P", "")
    again = used(text, "attract", ("C.P",), ((10, 20),))
    assert "C.P ~ [10, 20];" in again
    assert again.count("~") == 1
    without_b = used(text, "delete", ("B",))
    assert "B : .disc" not in without_b
    assert "B.P" not in without_b
    assert "AB : .bar" in without_b


def test_rods_without_points_have_their_own_ends() -> None:
    text = used("", "rod", ("", ""), ((10, 20), (110, 20)))
    assert "Rod1 : .bar  A = [10, 20]  B = [110, 20];" in text
    text = used(text, "rod", ("Rod1.B", ""), ((0, 0), (110, 120)))
    assert "Rod2 : .bar  B = [110, 20]  A = [110, 120];" in text
    assert "Rod2.B = Rod1.B;" in text


@pytest.mark.slow
def test_an_angle_is_the_one_on_show() -> None:
    text = used("", "rod", ("", ""), ((10, 20), (110, 20)))
    text = used(text, "rod", ("Rod1.B", ""), ((0, 0), (110, 120)))
    assert "Rod2.angle = Rod1.angle;" in used(text, "angle", ("Rod1", "Rod2"))
    after = used(FOUR_BAR.replace("Rocker.C = Coupler.C;", ""), "angle", ("Crank", "Coupler"), time=0.0)
    assert "Coupler.angle = Crank.angle" in after


def test_the_layout_of_everything_else_stays() -> None:
    text = used(FOUR_BAR, "anchor", ("",), ((20, 30),))
    assert text.replace("E : .disc(4)  P = [20, 30];\n", "") == FOUR_BAR
    text = used(FOUR_BAR, "attract", ("Coupler.P",), ((20, 30),))
    assert text.replace("    Coupler.P ~ [20, 30];\n", "") == FOUR_BAR
    text = used(FOUR_BAR, "delete", ("PivotA",))
    assert "PivotD : .disc(8)  O = [310,110];" in text
    assert "PivotA" not in text


def test_the_shape_of_a_part_is_edited_where_it_is_defined() -> None:
    text = used(FOUR_BAR, "shape", ("Crank.B",), ((190, 110),))
    assert "B = A + [60, 0]" in text
    text = used(FOUR_BAR, "anchor", ("Rocker",), ((290, 170),))
    assert "P = C + [" in text


@pytest.mark.parametrize(
    ("tool", "names"), [("fix", ("No.P",)), ("delete", ("No",)), ("nothing", ()), ("angle", ("Crank", "Crank"))]
)
def test_what_makes_no_sense_says_so(tool: str, names: tuple[str, ...]) -> None:
    with pytest.raises(NothingToDo):
        used(FOUR_BAR, tool, names)


def test_edits_count_characters() -> None:
    before = "// \U0001f600\nA;\nB;\n"
    made = edits_between(before, before + "C;\n")
    assert made == [{"from": len(before), "to": len(before), "text": "C;\n"}]


def drawn(*places: tuple[float, float]) -> str:
    """An open chain of rods through points, its ends fixed."""
    names = "ABCDEFGH"[: len(places)]
    points = "".join(f"{n} : .disc(4)  P = [{x}, {y}];\n" for n, (x, y) in zip(names, places, strict=True))
    rods = "".join(
        f"{a}{b} : .bar  {a} = [{p[0]}, {p[1]}]  {b} = [{q[0]}, {q[1]}];\n"
        for (a, p), (b, q) in pairwise(zip(names, places, strict=True))
    )
    pins = "".join(f"     {a}{b}.{a} = {a}.P;  {a}{b}.{b} = {b}.P;\n" for a, b in pairwise(names))
    (ax, ay), (zx, zy) = places[0], places[-1]
    return f"{points}{rods}\n@0\n{pins}     A.P = [{ax}, {ay}];  {names[-1]}.P = [{zx}, {zy}];\n"


@pytest.mark.parametrize(
    ("places", "turns"),
    [
        (((100, 100), (130, 110), (220, 190), (250, 100)), True),  # Grashof's, the shortest rod at the ground
        (((100, 100), (180, 110), (220, 190), (250, 100)), False),
        (((150, 150), (190, 230), (380, 300), (460, 150)), False),
        (((0, 0), (0, 100), (100, 100), (100, 0)), True),  # a parallelogram
    ],
)
def test_a_rod_turns_if_grashof_lets_it_and_swings_if_not(places: tuple[tuple[float, float], ...], turns: bool) -> None:
    """Grashof: with sides s <= p, q <= l, the shortest one turns all the way round if s + l <= p + q."""
    sides = [math.dist(a, b) for a, b in pairwise((*places, places[0]))]
    least, most = min(sides), max(sides)
    if turns:
        assert least + most <= sum(sides) - least - most + 1e-9
        assert sides[0] == least
    after = used(drawn(*places), "turn", ("AB",))
    (statement,) = re.findall(r"AB\.angle = ([^;]*);", after)
    assert (statement == "90*.t") is turns
    assert after.rstrip().endswith("@4  .loop;")
    motion = Engine().revise(SourceText("x.mov", after)).motion
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    number = next(thing.number for thing in motion.timeline.scene.things if thing.name == "AB")
    swept = float(np.ptp(poses.angle[number]))
    assert swept == pytest.approx(360 * (1 - 1 / len(poses.frames))) if turns else 10 < swept <= 180


@pytest.mark.slow
def test_a_rod_that_cannot_move_is_not_driven() -> None:
    text = drawn((0, 0), (30, 40), (60, 0)).replace("@0\n", "@0   AB.angle = 0;\n")
    with pytest.raises(NothingToDo, match="stated already"):
        used(text, "turn", ("AB",))
    with pytest.raises(NothingToDo, match="cannot turn"):
        used(drawn((0, 0), (30, 40), (60, 0)), "turn", ("AB",))
