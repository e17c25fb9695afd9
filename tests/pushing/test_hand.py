"""What a hand pulls in a film in which something pushes, against closed forms: nothing goes through anything."""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence

import numpy as np
import pytest

from movimentum.analysis.diagnose.wishes import wish_diagnostics
from movimentum.analysis.interactive.drag import DragResult, Grip, drag
from movimentum.expressions import Expr, symbol
from movimentum.scene.model import AnchorCoordinate
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.solver import solve
from tests.broad import broad
from tests.pushing.scripts import PLACES, Place
from tests.understand import timeline_of


def place_of(motion: PathMotion, thing: str, anchor: str) -> list[Expr]:
    body = next(each for each in motion.timeline.scene.things if each.name == thing)
    number = next(n for n, each in enumerate(body.anchors) if each.name == anchor)
    return [symbol(AnchorCoordinate(body.number, number, axis)) for axis in (0, 1)]


def piece_of(motion: PathMotion) -> Piece:
    (piece, *_) = motion.segments[0].pieces
    assert isinstance(piece, Piece)
    return piece


def grip_of(motion: PathMotion, thing: str, anchor: str) -> Grip:
    return Grip(motion.segments[0], piece_of(motion), 0.0, place_of(motion, thing, anchor))


def pull(grip: Grip, to: Sequence[float]) -> None:
    """As a page does: again and again, while it comes nearer."""
    before = np.inf
    for _ in range(40):
        grip.move(to)
        if grip.off() > 0.999 * before:
            break
        before = grip.off()


def where(motion: PathMotion, grip: Grip, thing: str) -> np.ndarray:
    """The first anchor of a thing, while a grip holds something."""
    body = next(each for each in motion.timeline.scene.things if each.name == thing)
    (x, y, c, s), (u, v) = grip.placements()[body.number], body.anchors[0].local
    return np.array([x + c * u - s * v, y + s * u + c * v])


# --- blocks in a row between two walls: those that are met give way, the others stay


def row(widths: Sequence[float], starts: Sequence[float], end: float, outlines: bool) -> str:
    lines = [".config(10, 400, 100);"]
    said: list[str] = []
    for k, (width, x) in enumerate(zip(widths, starts, strict=True)):
        lines.append(
            f"B{k} : .polygon A = [{x},40] P = A + [{width},0] Q = A + [{width},20] R = A + [0,20] .through(A,P,Q,R);"
        )
        said.append(f"B{k}.A.y = 40; B{k}.angle = 0;")
    lines.append("Left : .polygon A = [-30,0] P = [0,0] Q = [0,100] R = [-30,100] .through(A,P,Q,R);")
    lines.append(f"Right : .polygon A = [{end},0] P = A + [30,0] Q = A + [30,100] R = A + [0,100] .through(A,P,Q,R);")
    said.append(f"Left.A = [-30,0]; Left.angle = 0; Right.A = [{end},0]; Right.angle = 0;")
    names = ["Left", *(f"B{k}" for k in range(len(widths))), "Right"]
    for one, other in itertools.pairwise(names):
        apart = f".gap({one}, {other}) >= 0" if outlines else f"{other}.A.x - {one}.P.x >= 0"
        said.append(f"{apart} .pushes;")
    return "\n".join([*lines, "@0", *said, "@1"])


def pushed(places: list[float], widths: Sequence[float], end: float, held: int, to: float) -> list[float]:
    """Where the blocks are when one of them has been dragged to a place."""
    to = min(max(to, sum(widths[:held])), end - sum(widths[held:]))
    found = list(places)
    found[held] = to
    for k in range(held + 1, len(widths)):
        found[k] = max(found[k], found[k - 1] + widths[k - 1])
    for k in reversed(range(held)):
        found[k] = min(found[k], found[k + 1] - widths[k])
    return found


@pytest.mark.parametrize("outlines", [False, True])
@broad("seed", range(3), first=1)
def test_blocks_in_a_row(seed: int, outlines: bool) -> None:
    chance = random.Random(seed)
    count = chance.randint(2, 4)
    widths = [round(chance.uniform(5, 40), 1) for _ in range(count)]
    x, starts = 0.0, list[float]()
    for width in widths:
        x += round(chance.uniform(3, 40), 1)
        starts.append(round(x, 1))
        x += width
    end = round(x + 20, 1)
    motion = solve(timeline_of(row(widths, starts, end, outlines)))
    truth, grip = list(starts), None
    for _ in range(12):
        held, to = chance.randrange(count), chance.uniform(-50, end + 50)
        before = grip
        grip = grip_of(motion, f"B{held}", "A")
        if before is not None:
            grip.follow_on(before)
        pull(grip, [to, 40.0])
        truth = pushed(truth, widths, end, held, to)
        found = [where(motion, grip, f"B{k}")[0] for k in range(count)]
        assert np.abs(np.subtract(found, truth)).max() < 0.05, (held, to)
        truth = found  # what a hand leaves is near to where it pulls, and blocks touch exactly
        tight = [b - a - w for a, b, w in zip(found, found[1:], widths, strict=False)]
        assert min(tight) > -1e-8


# --- what is thin, and what is far: one move of a hand goes through nothing


@broad("place", PLACES, every=3)
def test_a_thin_wall_is_no_way_through(place: Place) -> None:
    middle, far, one, other = place.said(0, 0), place.at(300, 10), place.said(50, -40), place.said(50, 40)
    text = f"""
        Ball : .disc({6 * place.scale}) C = {middle};
        Wall : .bar A = {one} B = {other} .width({2 * place.scale});
        @0 Ball.angle = 0;  Wall.A = {one};  Wall.B = {other};  .gap(Ball, Wall) >= 0 .pushes;
        @1
    """
    motion = solve(timeline_of(text))
    grip = grip_of(motion, "Ball", "C")
    pull(grip, far)
    x, y = (np.linalg.inv(axes(place)) @ (where(motion, grip, "Ball") - place.at(0, 0))).tolist()
    assert x == pytest.approx(43.0, abs=1e-6)
    assert -20.0 < y < 20.0  # it has slid along, not about the end
    for share in np.linspace(0, 1, 8)[1:]:  # around the end, and then behind it
        pull(grip, place.at(43 - 30 * share, 90 * share))
    pull(grip, place.at(90, 90))
    pull(grip, place.at(90, 0))
    assert np.linalg.norm(where(motion, grip, "Ball") - place.at(90, 0)) < 0.1 * place.scale
    pull(grip, place.at(-100, 0))
    x, _ = (np.linalg.inv(axes(place)) @ (where(motion, grip, "Ball") - place.at(0, 0))).tolist()
    assert x == pytest.approx(57.0, abs=1e-6)


def axes(place: Place) -> np.ndarray:
    """(2, 2) the directions of the plain scene's axes, in columns."""
    return np.array([np.subtract(place.at(*unit), place.at(0, 0)) for unit in ((1, 0), (0, 1))]).T


# --- what is said of it

STOPPED = """
    Slide : .bar O = [0,0] P = [20,0];  Stop : .bar O = [60,-20] P = [60,20];
    @0 Slide.O.y = 0;  Slide.angle = 0;  Stop.O = [60,-20];  Stop.P = [60,20];
       60 - Slide.P.x >= 0 .pushes;
       {wish}
    @10
"""


def test_a_drag_against_a_stop_is_blocked() -> None:
    motion = solve(timeline_of(STOPPED.format(wish="")))
    found = drag(motion.segments[0], piece_of(motion), 0.0, place_of(motion, "Slide", "P"), [100.0, 0.0])
    assert found.outcome is DragResult.BLOCKED
    assert found.off == pytest.approx(40.0, abs=1e-6)
    found = drag(motion.segments[0], piece_of(motion), 0.0, place_of(motion, "Slide", "P"), [30.0, 0.0])
    assert found.outcome is DragResult.REACHED


def test_a_wish_that_a_stop_holds_is_blocked() -> None:
    motion = solve(timeline_of(STOPPED.format(wish="Slide.P.x ~ 100;")))
    (found,) = wish_diagnostics(motion)
    assert found.code == "wish/blocked"


@broad("count", [2, 3, 5], first=1)
def test_wishes_that_a_ram_holds_off_are_blocked(count: int) -> None:
    """Each of the blocks wants to go on, and the ram before them comes nearer: no push aside would help."""
    things, says = (
        ["Ram : .polygon P=[700,20] Q=[720,20] R=[720,60] S=[700,60];"],
        ["Ram.P = [700 - 60*.t, 20]; Ram.angle = 0;"],
    )
    for k in range(count):
        x = 60 * k
        things.append(f"B{k} : .polygon P=[{x},20] Q=[{x + 40},20] R=[{x + 40},60] S=[{x},60];")
        says.append(f"B{k}.P.y = 20; B{k}.angle = 0; B{k}.P.x ~ {700 - 60 * (count - k)} .speed(400);")
        says.append(f".gap(B{k}, {'Ram' if k == count - 1 else f'B{k + 1}'}) >= 0 .pushes;")
    motion = solve(timeline_of(" ".join([*things, "@0", *says, f"@{2 + count}"])))
    found = list(wish_diagnostics(motion))
    assert {item.code for item in found} == {"wish/blocked"}
    assert len(found) == count
