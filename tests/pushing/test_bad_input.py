"""What cannot push: things inside each other, stops that contradict, walls that nothing moves, no outline, many."""

from __future__ import annotations

import re

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad


def error_of(text: str) -> mv.Diagnostic:
    with pytest.raises((mv.ScriptError, mv.NoSolutionError)) as told:
        mv.loads(text).solve()
    return next(each for each in told.value.diagnostics if each.severity == "error")


OVERLAPS = {
    "polygons": (
        "A : .polygon P=[0,0] Q=[20,0] R=[20,20] S=[0,20];  B : .polygon P=[15,5] Q=[35,5] R=[35,25] S=[15,25];",
        "A.P = [0,0];  A.angle = 0;  B.angle = 0;",
        5.0,
    ),
    "curve": (
        "A : .curve C=[0,0] .polar(th, 40 + 9*.cos(2*th));  B : .disc(5) P=[45,0];",
        "A.C=[0,0]; A.angle=0;",
        9.0,
    ),
    "one in the other": ("A : .disc(10) C=[0,0];  B : .disc(5) P=[0,0];", "A.C = [0,0];", 15.0),
    "margin": ("A : .disc(10) C=[0,0];  B : .disc(5) P=[18,0];", "A.C = [0,0];", 2.0),
}


@pytest.mark.parametrize("name", OVERLAPS)
def test_an_overlap_is_told_with_a_pose_that_is_free(name: str) -> None:
    things, says, depth = OVERLAPS[name]
    least = 5 if name == "margin" else 0
    push = f".gap(A, B) >= {least} .pushes;"
    error = error_of(f"{things} @0 {says} B.P = [x, y]; {push} @2")
    assert error.code == "contact/start"
    assert f"overlap by {depth:g} " in error.message
    x, y = map(float, re.findall(r"\[([-0-9.e]+), ([-0-9.e]+)\]", str(error.helps[0]))[0])
    moved = re.sub(r"(B : .*?P=)\[[-0-9.]+,[-0-9.]+\]", lambda found: f"{found[1]}[{x},{y}]", things)
    if "polygon P=[15" in things:  # the whole of it is moved
        corners = [(x, y), (x + 20, y), (x + 20, y + 20), (x, y + 20)]
        anchors = " ".join(f"{name}=[{u},{v}]" for name, (u, v) in zip("PQRS", corners, strict=True))
        moved = re.sub(r"P=\[15,5\].*;", f"{anchors};", things)
    mv.loads(f"{moved} @0 {says} B.P = [x, y]; {push} @2").solve()


def test_an_overlap_where_a_step_begins() -> None:
    error = error_of(
        "A : .disc(10) C=[0,0]; B : .disc(5) C=[3,0]; @0 A.C=[0,0]; B.C=[x,0]; @1 .gap(A, B) >= 0 .pushes; @2"
    )
    assert error.code == "contact/start"
    assert "overlap by 12 at t = 1" in error.message


def test_driven_things_that_overlap() -> None:
    error = error_of(
        "A : .disc(10) C=[0,0]; B : .disc(5) C=[3,0]; @0 A.C=[0,0]; B.C=[3,0]; .gap(A, B) >= 0 .pushes; @2"
    )
    assert error.code == "contact/start"


@pytest.mark.parametrize("held", ["", "W.P = [50,0];  W.angle = 0;"])
@pytest.mark.parametrize("margin", [0, 7])
def test_a_push_through_a_fixed_wall(held: str, margin: int) -> None:
    error = error_of(
        f"""W : .bar P=[50,0] Q=[50,50];  A : .disc(5) C=[0,20];
        @0 A.C = [30*.t, 20];  {held}  .gap(A, W) >= {margin} .pushes;
        @4"""
    )
    assert error.code == "solve/binds"
    assert float(re.findall(r"t = ([0-9.]+)", error.message)[0]) == pytest.approx((45.0 - margin) / 30.0, abs=1e-8)


def test_a_pose_that_pushes_nothing_may_be_driven_by() -> None:
    text = """W : .bar P=[50,0] Q=[50,50];  A : .disc(5) C=[0,70];
        @0 A.C = [30*.t, 70];  .gap(A, W) >= 0 .pushes;
        @4"""
    assert len(mv.loads(text).solve()) > 2


@pytest.mark.parametrize(
    ("says", "code", "when"),
    [
        ("x >= 3 .pushes;  x <= 2 .pushes;", "constraint/conflict", "t = 0"),
        ("x >= .t .pushes;  x <= 2 .pushes;", "solve/binds", "t = 2"),
        ("x <= 2 .pushes;  @1 x >= 3 .pushes;", "solve/binds", "t = 1"),
    ],
)
def test_two_stops_that_contradict(says: str, code: str, when: str) -> None:
    error = error_of(f"A : .bar P=[0,0] Q=[5,0]; @0 A.P = [x, 0]; A.angle = 0; {says} @4")
    assert error.code == code
    assert when in error.message


def test_a_picture_without_an_outline(tmp_path) -> None:
    from PIL import Image

    Image.new("RGB", (20, 20)).save(tmp_path / "dot.png")
    script = tmp_path / "film.mov"
    script.write_text(
        "S : 'dot.png' C=[5,5]; A : .disc(5) C=[0,20]; @0 A.C=[30*.t,20]; S.C=[x,0]; .gap(A, S) >= 0 .pushes; @4"
    )
    with pytest.raises(mv.ScriptError) as told:
        mv.load(script).solve()
    assert [each.code for each in told.value.diagnostics if each.severity == "error"] == ["contact/outline"]


@pytest.mark.slow
@pytest.mark.parametrize("count", [1000])
def test_a_thousand_contacts(count: int) -> None:
    things = " ".join(f"D{k} : .bar P=[0,{4 * k}] Q=[3,{4 * k}];" for k in range(count))
    says = " ".join(f"D{k}.P.y={4 * k}; D{k}.angle=0; D{k}.P.x - P.O.x >= 0 .pushes;" for k in range(count))
    motion = mv.loads(
        f".config(10, 500, 100); P : .bar O=[-5,0] Q=[-5,5000]; {things} @0 P.O=[-5 + 5*.t, 0]; P.angle=0; {says} @2"
    ).solve()
    assert motion["D999.P"][-1, 0] == pytest.approx(5.0, abs=1e-9)


# --- copies that are drawn in one place


def narrowest(points: np.ndarray) -> float:
    """The least width of a convex polygon (N, 2)."""
    edges = np.roll(points, -1, axis=0) - points
    normals = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / np.hypot(*edges.T)[:, None]
    return float(min(np.ptp(points @ normal) for normal in normals))


@broad("corners", [3, 4, 5, 8, 40], first=2)
@pytest.mark.parametrize("turned", [0.0, 17.0])
def test_copies_in_one_place_overlap_by_their_width(corners: int, turned: float) -> None:
    """Nothing crosses, and no corner of the one is inside the other."""
    angles = np.radians(turned) + np.sort(np.random.default_rng(corners).uniform(0.7, 1.3, corners).cumsum())
    angles *= 1.9 * np.pi / angles[-1]
    points = 100.0 + np.stack([60.0 * np.cos(angles), 40.0 * np.sin(angles)], axis=1)
    shape = " ".join(f"P{k} = [{x:.12g}, {y:.12g}]" for k, (x, y) in enumerate(points.tolist()))
    through = ", ".join(f"P{k}" for k in range(corners))
    text = f"""
        N[1..2] : .polygon {shape} .through({through});
        @0 .for k = 1..2 {{ N[k].P0.y = {points[0, 1]:.12g};  N[k].angle = 0; }}
           .gap(N[1], N[2]) >= 0 .pushes;
        @1
    """
    (error,) = [each for each in mv.loads(text).diagnostics if each.severity is mv.Severity.ERROR]
    assert error.code == "contact/start"
    assert f"overlap by {narrowest(points):.4g} at" in error.message
