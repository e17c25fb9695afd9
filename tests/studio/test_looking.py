"""What the page shows of a motion: velocities, claims, traces, numbers that follow a hand, copies of the picture."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from movimentum.source import SourceText
from movimentum.studio.descriptions import claims_data, diagnostics_data
from movimentum.studio.messages import (
    ClaimsChecked,
    PlotRequest,
    Plotted,
    RatesRequest,
    RatesSent,
    StillMade,
    StillRequest,
)
from movimentum.studio.questions import plot, rates, still
from movimentum.workflow.engine import Engine
from tests.command import movimentum
from tests.studio.bench import Bench
from tests.studio.conftest import Tab
from tests.studio.scripts import FOUR_BAR

Opened = Callable[..., Tab]
CLAIMING = FOUR_BAR.replace(
    "@2\n",
    "    .claim Crank.B.x < 170;   .claim Crank.B.y < 400;   .claim Rocker.D = [310,110];\n@2\n",
)
ARM = """\
.config(20, 300, 200);
Arm : .bar A = [100, 80]  B = A + [60, 0];
{more}
@0  Arm.A = [100, 80];{drive}
@1
"""


def test_velocities_are_those_of_a_circle(bench: Callable[[str], Bench]) -> None:
    """Known from elsewhere: a point of a bar that turns has speed w r, at right angles to the bar."""
    at = bench(ARM.format(more="", drive=" Arm.angle = 90*.t;"))
    rates(at.worker, RatesRequest(1, 0))
    told = at.said.pop()
    assert isinstance(told, RatesSent)
    assert (told.first, told.count) == (0, 21)
    found = np.frombuffer(base64.b64decode(told.rates), "<f4").reshape(21, 2, 2)
    turn = math.pi / 2 * np.arange(21) / 20
    assert found[:, 0] == pytest.approx(np.zeros((21, 2)), abs=1e-4)
    expected = math.pi / 2 * 60 * np.stack([-np.sin(turn), np.cos(turn)], axis=-1)
    assert found[:, 1] == pytest.approx(expected, rel=1e-5, abs=1e-4)
    rates(at.worker, RatesRequest(1, 19))
    assert at.said.pop().count == 2


@pytest.mark.parametrize("degrees", [30, 135, -60, 170])
def test_numbers_in_labels_follow_a_hand(bench: Callable[[str], Bench], degrees: float) -> None:
    label = "Note : .label('{Arm.angle:.1f} {Arm.B.x:.2f} {(Arm.B - Arm.A).l:.3f}')  at = [10, 10];"
    at = bench(ARM.format(more=label, drive=""))
    turn = math.radians(degrees)
    moved = at.drag("Arm", "B", (100 + 60 * math.cos(turn), 80 + 60 * math.sin(turn)))
    assert moved.marks is not None
    (mark,) = [mark for mark in moved.marks["marks"] if mark["kind"] == "words"]
    assert mark["texts"][0]["text"] == f"{degrees:.1f} {100 + 60 * math.cos(turn):.2f} 60.000"
    assert len(moved.marks["live"]) == len(moved.marks["marks"])


def test_claims_are_told_with_the_frames_in_which_they_fail() -> None:
    """Crank.B.x = 130 + 50 cos(180 t) is below 170 from acos(0.8) on, and above it again before the turn is over."""
    motion = Engine().revise(SourceText("x.mov", CLAIMING)).motion
    first, second, third = claims_data(motion)
    assert [item["holds"] for item in (first, second, third)] == [False, True, True]
    assert first["words"] == "Crank.B.x < 170"
    edge = math.degrees(math.acos(0.8)) / 180
    frames = [f for f in range(51) if 130 + 50 * math.cos(math.pi * f / 25) >= 170]
    runs = [[0, max(f for f in frames if f < 25)], [min(f for f in frames if f > 25), 50]]
    assert first["failing"] == runs
    assert first["time"] == 0
    assert first["worst"] == pytest.approx(10)
    assert runs[0][1] == math.floor(edge * 25)
    names = [thing.name for thing in motion.timeline.scene.things]
    assert [names[number] for number in first["things"]] == ["Crank"]
    start, end = first["span"]
    assert CLAIMING[start:end].startswith(".claim Crank.B.x")


@pytest.mark.slow
def test_a_still_is_what_run_writes(bench: Callable[[str], Bench], tmp_path: Path) -> None:
    script = tmp_path / "x.mov"
    script.write_text(FOUR_BAR, encoding="utf-8")
    assert movimentum("run", "x.mov", "-o", "x.svg", "--at", "0.7", cwd=tmp_path).returncode == 0
    at = bench(FOUR_BAR)
    still(at.worker, at.dragging, StillRequest(1, 0.7))
    told = at.said.pop()
    assert isinstance(told, StillMade)
    assert told.svg == (tmp_path / "x.svg").read_text(encoding="utf-8")


def test_a_still_has_what_a_hand_has_moved(bench: Callable[[str], Bench]) -> None:
    at = bench(ARM.format(more="Note : .label('{Arm.angle:.0f}')  at = [10, 10];", drive=""))
    still(at.worker, at.dragging, StillRequest(1, 0.0))
    before = at.said.pop().svg
    at.drag("Arm", "B", (100, 140))
    still(at.worker, at.dragging, StillRequest(1, 0.0))
    after = at.said.pop().svg
    assert before != after
    assert ">90<" in after or "90" in after


def test_what_is_not_known_yet_has_no_still(bench: Callable[[str], Bench]) -> None:
    at = bench(FOUR_BAR)
    still(at.worker, at.dragging, StillRequest(7, 0.0))
    assert at.said.pop() == StillMade(7, "", "the motion is not known yet")
    assert not [item for item in at.said if isinstance(item, ClaimsChecked)]


@pytest.mark.slow
def test_claims_velocities_traces_and_copies_on_the_page(opened: Opened) -> None:
    tab = opened(CLAIMING)
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    state = tab.until("s.claims.length === 3")
    assert [item["holds"] for item in state["claims"]] == [False, True, True]
    claim = tab.testid("claim-0")
    assert claim.get_attribute("data-holds") == "false"
    assert "fails from t = 0" in claim.inner_text()
    assert tab.testid("failing").count() == 2
    tab.page.evaluate("movimentum.seek(20)")
    claim.click()
    assert tab.state["frame"] == 0
    assert tab.page.evaluate("movimentum.selected()").startswith(".claim Crank.B.x")

    tab.page.evaluate("movimentum.seek(10)")
    tab.page.locator("#stage").focus()
    tab.page.keyboard.press("s")
    assert tab.testid("velocity").get_attribute("aria-pressed") == "true"
    state = tab.until("Object.keys(s.velocities).length > 3")
    vx, vy = state["velocities"]["Crank.B"]
    turn = math.pi * 10 / 25
    assert (vx, vy) == pytest.approx((-50 * math.pi * math.sin(turn), 50 * math.pi * math.cos(turn)), rel=1e-4)
    assert "PivotD.O" not in state["velocities"]

    tab.page.locator("#stage").focus()
    tab.page.keyboard.press("l")
    assert tab.testid("traces").input_value() == "tail"
    assert {item["mode"] for item in tab.state["traces"]} == {"tail"}
    tab.testid("traces").select_option("off")
    assert tab.state["traces"] == []
    tab.click(tab.state["anchors"]["Coupler.P"])
    tab.testid("trace-Coupler.P").select_option("whole")
    assert tab.state["traces"] == [{"name": "Coupler.P", "mode": "whole"}]

    tab.page.locator("#stage").focus()
    tab.page.keyboard.press("c")
    tab.page.wait_for_function("() => document.querySelector('[data-testid=told]').textContent.includes('as PNG')")
    kinds = "navigator.clipboard.read().then((items) => items.flatMap((item) => item.types))"
    assert tab.page.evaluate(kinds) == ["image/png"]
    tab.page.keyboard.press("Shift+C")
    tab.page.wait_for_function("() => document.querySelector('[data-testid=told]').textContent.includes('as SVG')")
    assert tab.page.evaluate("navigator.clipboard.readText()").startswith("<svg ")
    # a browser that refuses is told about, and what to do instead
    refusal = "Promise.reject(new DOMException('no', 'NotAllowedError'))"
    tab.page.evaluate(f"() => {{ navigator.clipboard.write = () => {refusal}; }}")
    tab.testid("menu").click()
    tab.testid("copy-png").click()
    tab.page.wait_for_function(
        "() => document.querySelector('[data-testid=told]').textContent.startsWith('Not copied')"
    )
    assert "saves the picture to a file" in tab.testid("told").inner_text()


BINDS = """
    .config(20, 400, 200);  Crank : .bar O=[100,100] P=[150,100];  Rod : .bar A=[150,100] B=[195,100];
    @0 Crank.O = [100,100];  Crank.angle = 90*.t;  Rod.A = Crank.P;  Rod.B.y = 100;  Rod.A.x < Rod.B.x;
    @2
"""


def test_a_plot_has_a_gap_where_there_is_no_solution(bench: Callable[[str], Bench]) -> None:
    there = bench(BINDS)
    plot(there.worker, PlotRequest(1, "Rod.B.x"))
    (told,) = there.said
    assert isinstance(told, Plotted)
    times = np.arange(len(told.rows)) / 20.0
    heights = 50.0 * np.sin(np.radians(90.0 * times))
    assert [row[0] is None for row in told.rows] == (heights > 45.0).tolist()


def test_no_help_is_for_a_command_line(bench: Callable[[str], Bench]) -> None:
    there = bench(BINDS)
    told = diagnostics_data(there.job.revision.diagnostics, there.job.revision.source)
    (found,) = [each for each in told if each["code"] == "solve/unreachable"]
    assert found["message"]
    assert not [text for each in told for text in each["helps"] if "--" in text]
