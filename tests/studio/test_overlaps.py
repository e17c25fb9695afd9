"""What overlaps is shown where it is asked for."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from movimentum.studio.messages import OverlapsFound, OverlapsRequest
from movimentum.studio.worker import PATIENT
from tests.studio.bench import Bench
from tests.studio.conftest import Tab

Opened = Callable[..., Tab]


def passing(size: float, speed: float) -> str:
    """A disc that passes through another one that stands still, 50 px away at first."""
    return (
        f".config(20, 200, 100); Moving : .disc({size}) C=[0,0]; Still : .disc({size}) C=[50,0];"
        f"@0 Moving.C = [{speed}*.t, 40]; Still.C = [50, 40]; @{120 / speed}"
    )


@pytest.mark.parametrize(("size", "speed"), [(3.0, 100.0), (5.0, 40.0), (12.0, 60.0)])
def test_the_page_is_told_the_overlaps_that_it_asked_for(
    bench: Callable[[str], Bench], size: float, speed: float
) -> None:
    there = bench(passing(size, speed))
    there.worker._find_overlaps(there.job)  # pyright: ignore[reportPrivateUsage]
    assert not there.said  # nobody has asked
    there.worker.show_overlaps(OverlapsRequest(True))
    there.worker._find_overlaps(there.job)  # pyright: ignore[reportPrivateUsage]
    (told,) = there.said
    assert isinstance(told, OverlapsFound)
    (found,) = told.overlaps
    assert found["things"] == [there.number("Moving"), there.number("Still")]
    assert math.isclose(found["from"], (50 - 2 * size) / speed, rel_tol=1e-9)
    assert math.isclose(found["to"], (50 + 2 * size) / speed, rel_tol=1e-9)
    assert math.isclose(found["depth"], 2 * size, rel_tol=1e-6)


def test_they_are_looked_for_after_all_else() -> None:
    assert PATIENT[-1] == "overlaps"


@pytest.mark.slow
def test_overlaps_are_on_the_scrubber_and_in_the_picture(opened: Opened) -> None:
    tab = opened(passing(5.0, 40.0))
    tab.settled()
    tab.testid("overlaps").click()
    tab.until("s.overlaps.length === 1")
    assert tab.testid("overlapping").count() == 1
    mark, scrubber = (tab.testid(name).bounding_box() for name in ("overlapping", "scrubber"))
    assert mark is not None
    assert scrubber is not None
    left = (mark["x"] - scrubber["x"]) / scrubber["width"]
    assert abs(left - 1.0 / 3.0) < 0.03  # from t = 1 of 3
    tab.testid("overlap-0").click()
    assert abs(tab.until("s.selection.length === 2")["time"] - 1.25) < 0.026
    tab.write(passing(5.0, 40.0).replace("50, 40", "50, 90"))
    tab.until("s.shownRev === s.rev && s.overlaps.length === 0")
    tab.page.wait_for_function("() => document.getElementById('overlaps').innerText.includes('Nothing overlaps')")
