"""What pushes in the studio: the hand is held by it too, and the scrubber shows when."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from movimentum.studio.descriptions import scene_data
from tests.studio.bench import Bench
from tests.studio.conftest import Tab

Opened = Callable[..., Tab]

PUSHED = """
    .config(10, 300, 100);
    A : .disc(10) C = [20,50];  B : .disc(10) C = [100,50];  Stop : .bar P = [200,50] Q = [220,50];
    @0 A.C = [20 + 30*.t, 50];  B.C.y = 50;  B.angle = 0;  Stop.P = [200,50];  Stop.angle = 0;
       .gap(A, B) >= 0 .pushes;  B.C.x <= 160 .pushes;
    @3
"""


@pytest.mark.parametrize("hand", [-30.0, 15.0, 130.0, 250.0])
def test_a_hand_is_held_by_what_pushes(bench: Callable[[str], Bench], hand: float) -> None:
    there = bench(PUSHED)
    places = there.drag("B", "C", (hand, 50.0), 6).places
    drawn = (100.0, 50.0)  # nothing turns, so a place is how far a thing is from where it is drawn
    x, y = np.array(places[4 * there.number("B") :][:2]) + drawn
    assert x == pytest.approx(min(max(hand, 40.0), 160.0), abs=0.02)  # between the driven disc and the stop
    assert y == pytest.approx(50.0, abs=1e-9)
    assert places[4 * there.number("A")] == pytest.approx(0.0, abs=1e-9)


def test_the_page_is_told_what_touches_when(bench: Callable[[str], Bench]) -> None:
    there = bench(PUSHED)
    told = scene_data(there.job.motion.timeline, None, there.job.motion)["contacts"]
    assert [each["words"] for each in told] == ["A and B touch"]
    assert told[0]["time"] == pytest.approx(2.0, abs=1e-9)
    assert scene_data(there.job.motion.timeline)["contacts"] == []


@pytest.mark.slow
def test_contacts_are_marks_on_the_scrubber(opened: Opened) -> None:
    tab = opened(PUSHED)
    tab.settled()
    assert tab.testid("contact").count() == 1
    mark, scrubber = (tab.testid(name).bounding_box() for name in ("contact", "scrubber"))
    assert mark is not None
    assert scrubber is not None
    left = (mark["x"] - scrubber["x"]) / scrubber["width"]
    assert abs(left - 2.0 / 3.0) < 0.03
    assert tab.testid("contact").get_attribute("title") == "A and B touch, t = 2"
    tab.testid("contact").click()
    assert abs(tab.page.evaluate("movimentum.state().time") - 2.0) < 1e-6
