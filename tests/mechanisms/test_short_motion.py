"""Steps' shares, transitions, choices, lines and films without end, against what they are defined to be."""

from __future__ import annotations

import base64
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from tests.command import movimentum

NEAR = 1e-9
BAR = ".config(16); A : .bar P = [0,0] Q = [50,0]; "


def solved(text: str):
    return mv.loads(text).solve()


def ease(u):
    u = np.clip(u, 0.0, 1.0)
    return u * u * (3 - 2 * u)


# --- .s and transitions ---------------------------------------------------------------------------


def test_the_share_of_a_step() -> None:
    motion = solved(BAR + "@1 A.P = [0,0]; x = .s; v = .d(.s); w = .i(.s); A.angle = 10*.s; @3 y = .s; @3.5 z = 1; @5")
    t = motion.times
    share = np.clip((t - 1) / 2, 0, 1)
    assert np.abs(motion["x"] - share).max() < 1e-14
    assert motion["x"][t >= 3].tolist() == [1.0] * int((t >= 3).sum())  # exactly
    assert np.abs(motion["v"] - np.where(t < 3, 0.5, 0.0)).max() < 1e-14
    assert np.abs(motion["w"] - np.where(t < 3, (t - 1) ** 2 / 4, 1 + (t - 3))).max() < 1e-12
    later = t >= 3
    assert np.abs(motion["y"][later] - np.clip((t[later] - 3) / 0.5, 0, 1)).max() < 1e-14


def test_shares_without_a_length() -> None:
    motion = solved(BAR + "@0 x = 2 + .s; A.P = [9,9]; @0 y = .s; @1 z = 5 + .s;")
    assert motion["x"].tolist() == [3.0] * 17  # a step at the same time follows
    assert motion["z"][-1] == 5.0
    assert motion["y"][8] == 0.5


def test_the_velocity_of_an_eased_share() -> None:
    motion = solved(
        BAR + "@0 A.P = [0,0]; A.angle = 90*.ease(.s); v = .d(A.angle); w = .i(.ease(.s)); @2 A.opacity = 1; @3"
    )
    u = np.minimum(motion.times / 2, 1)
    assert np.abs(motion["v"] - 90 * 6 * u * (1 - u) / 2).max() < 1e-11
    assert np.abs(motion["w"] - (2 * (u**3 - u**4 / 2) + np.maximum(motion.times - 2, 0))).max() < 1e-12


@pytest.mark.parametrize(("start", "end"), [(60, 85), (0.1, 0.3), (-7, 1e3)])
def test_transitions_of_scalars(start: float, end: float) -> None:
    motion = solved(BAR + f"@0 A.P = [0,0]; A.angle = 0; c = {start} -> {end}; @2 A.opacity = 1; @3")
    assert np.abs(motion["c"] - (start + (end - start) * ease(motion.times / 2))).max() < 1e-12 * max(
        abs(start), abs(end)
    )
    assert motion["c"][0] == start
    assert set(motion["c"][motion.times >= 2].tolist()) == {float(end)}


def test_transitions_of_vectors_that_move() -> None:
    motion = solved(
        BAR + "B : .bar P = [0,0] Q = [0,30]; @0 A.P = [0,0]; A.angle = 90*.T; B.P = [100,0]; B.angle = 30*.T;"
        "v = A.Q -> B.Q; @2 A.opacity = 1; @4"
    )
    u = ease(motion.times / 2)[:, None]
    assert np.abs(motion["v"] - (motion["A.Q"] * (1 - u) + motion["B.Q"] * u)).max() < 1e-12


def test_one_after_the_other() -> None:
    motion = solved(BAR + "@0 A.P = [0,0]; A.angle = 0 -> 30; @1 A.P = [0,0] -> [8,4]; @2 A.angle = 30 -> -10; @3 @4")
    t = motion.times
    expected = 30 * ease(t) - 40 * ease(t - 2)
    assert np.abs(motion["A.angle"] - expected).max() < 1e-12
    assert np.abs(motion["A.P"] - ease(t - 1)[:, None] * [8, 4]).max() < 1e-12


def test_a_wish_with_a_transition() -> None:
    motion = solved(BAR + "@0 A.P = [100,100]; A.angle ~ 0 -> 60; @2 A.opacity = 1; @5")
    assert abs(motion["A.angle"][-1] - 60) < 0.1


# --- choices --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("sign", "at"), [("<", 2), ("<=", 1), (">", 2), (">=", 1)])
def test_choices_are_exact_at_the_bound(sign: str, at: int) -> None:
    motion = solved(BAR + f"@0 A.P = [9,9]; A.angle = 0; x = {{ .t {sign} 1 : 1; 2 }}; @2")
    there = float(motion["x"][motion.times == 1.0][0])
    assert there == at
    before, after = (1.0, 2.0) if "<" in sign else (2.0, 1.0)
    assert set(motion["x"][motion.times < 1].tolist()) == {before}
    assert set(motion["x"][motion.times > 1].tolist()) == {after}


def test_choices_and_ranges_agree() -> None:
    """The first edition's form and this one drive a four-bar alike, to the last bit."""
    text = (
        ".config(25); C : .bar O=[0,0] P=[40,0]; R : .bar A=[0,0] B=[120,0]; L : .bar O=[0,0] Q=[80,0];"
        "@0 C.O=[100,100]; L.O=[200,100]; R.A=C.P; R.B=L.Q; R.B.y>100; C.angle = %s; @4"
    )
    one = solved(text % "{ .t <= 1.3 : 200*.t; .t <= 2.7 : 260; 260 + 90*(.t - 2.7) }")
    other = solved(text % "{ .t : 200*.t > 1.3 : 260 > 2.7 : 260 + 90*(.t - 2.7) }")
    for name in ("C.angle", "R.B", "L.Q"):
        assert np.array_equal(one[name], other[name])
    assert np.abs(np.hypot(*(one["R.A"] - one["R.B"]).T) - 120).max() < 1e-11


def test_choices_by_what_moves() -> None:
    motion = solved(BAR + "@0 A.P = [0,0]; A.angle = 100*.t; v = { A.Q.y > 40 : A.Q; A.Q.x < 0 : [0,1]; -A.Q }; @3.5")
    q = motion["A.Q"]
    expected = np.where((q[:, 1] > 40)[:, None], q, np.where((q[:, 0] < 0)[:, None], [[0.0, 1.0]], -q))
    assert np.abs(motion["v"] - expected).max() < NEAR


# --- lines ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [0.0, 31.0, 90.0, 200.0, -77.0])
def test_a_slider_on_a_guide_in_any_pose(turn: float) -> None:
    """A slider-crank whose guide is turned: its closed form turned with it."""
    u = np.array([math.cos(math.radians(turn)), math.sin(math.radians(turn))])
    n = np.array([-u[1], u[0]])
    begin = (np.array([100, 100]) - 30 * u + 7 * n).tolist()
    end = (np.array([100, 100]) + 50 * u + 7 * n).tolist()
    ahead = (np.array([100, 100]) + u).tolist()
    motion = solved(
        f".config(20); C : .bar O=[0,0] P=[40,0]; R : .bar A=[0,0] B=[130,0]; G : .bar A=[0,0] B=[80,0];"
        f"@0 C.O=[100,100]; R.A=C.P; C.angle={turn} + 90*.t; G.A = {begin}; G.angle = {turn};"
        f".across(R.B, G.A, G.B) = 0; .along(R.B, G.A, G.B) > 30; x = .along(R.B, [100,100], {ahead});"
        f"y = .across(R.B, G.A, {end}); @5"
    )
    angle = np.radians(90 * motion.times)
    way = 40 * np.cos(angle) + np.sqrt(130**2 - (40 * np.sin(angle) - 7) ** 2)
    assert np.abs((motion["R.B"] - [100, 100]) @ u - way).max() < NEAR
    assert np.abs((motion["R.B"] - [100, 100]) @ n - 7).max() < NEAR
    assert np.abs(motion["x"] - way).max() < NEAR
    assert np.abs(motion["y"]).max() < NEAR


@pytest.mark.parametrize("offset", [0.0, 6.0, -3.5])
@pytest.mark.parametrize("drawn", ["A=[0,0] B=[120,0]", "A=[3,4] B=[63,84]"])
def test_a_pin_in_a_slot(offset: float, drawn: str) -> None:
    """The quick return of Whitworth: the lever points at the crank's pin, or past it by an offset."""
    motion = solved(
        f".config(20); C : .bar O=[0,0] P=[40,0]; L : .bar {drawn} M=B+[5,5];"
        f"@0 C.O=[100,100]; C.angle = 90*.t; L.A=[100,30]; .across(C.P, L.A, L.B) = {offset};"
        f".along(C.P, L.A, L.B) > 0; s = .along(C.P, L.A, L.B); @5"
    )
    apart = motion["C.P"] - [100, 30]
    far = np.hypot(*apart.T)
    lever = np.arctan2(apart[:, 1], apart[:, 0]) - np.arcsin(offset / far)
    along = motion["L.B"] - motion["L.A"]
    seen = np.arctan2(along[:, 1], along[:, 0])
    assert np.abs(np.sin(seen - lever)).max() < NEAR
    assert np.cos(seen - lever).min() > 0
    assert np.abs(motion["s"] - np.sqrt(far**2 - offset**2)).max() < NEAR


def test_sides_of_a_line_choose() -> None:
    text = ".config(10); A : .bar P=[0,0] Q=[50,0]; B : .bar P=[0,0] Q=[40,0]; @0 A.P=[0,0]; B.P=[60,0]; A.Q=B.Q; %s @1"
    up = solved(text % ".across(A.Q, A.P, B.P) > 0;")["A.Q"]
    down = solved(text % ".across(A.Q, A.P, B.P) < 0;")["A.Q"]
    assert (up[:, 1] > 0).all()
    assert np.abs(up * [1, -1] - down).max() < NEAR


def test_a_claim_about_a_line() -> None:
    script = mv.loads(
        BAR
        + "@0 A.P=[10,20]; A.angle=90*.t; .claim .along([10,20], A.P, A.Q) = 0; .claim .across(A.Q, A.P, A.Q) = 0; @2"
    )
    assert not [item for item in script.diagnostics if item.severity is mv.Severity.ERROR]


def test_lines_are_solved_as_simply_as_joints(tmp_path: Path) -> None:
    """A pin in a slot of a body leaves no Newton's method."""
    path = tmp_path / "slot.mov"
    path.write_text(
        "C : .bar O=[0,0] P=[40,0]; L : .bar A=[0,0] B=[90,40]; @0 C.O=[100,100]; C.angle=90*.t; L.A=[100,30];"
        ".across(C.P, L.A, L.B) = 0; .along(C.P, L.A, L.B) > 0; @4"
    )
    done = movimentum("check", path, "--format", "json")
    kernels = {block["kernel"] for step in json.loads(done.stdout)["steps"] for block in step["blocks"]}
    assert "newton" not in kernels


# --- films without end ----------------------------------------------------------------------------

FILM = ".config({}); A : .bar P = [0,0] Q = [50,0]; @{} A.P = [60,60]; A.angle = 90*.t; @+{} {}"


@pytest.mark.parametrize(("fps", "length", "frames"), [(10, "4", 40), (10, "3.95", 40), (3, "1/2", 2), (24, "4", 96)])
def test_the_last_frame_is_not_the_first(fps: int, length: str, frames: int) -> None:
    assert len(solved(FILM.format(fps, 1, length, ".loop;")).times) == frames
    assert mv.loads(FILM.format(fps, 1, length, ".loop;")).timeline.loops


def codes(text: str) -> list[str]:
    return [item.code for item in mv.loads(text).diagnostics if item.code.startswith("loop/")]


def test_check_knows_films_that_could_begin_again() -> None:
    assert codes(FILM.format(10, 0, 4, "")) == ["loop/possible"]
    assert codes(FILM.format(10, 0, 8, "")) == ["loop/possible"]
    assert codes(FILM.format(10, 0, 4, ".loop;")) == []
    assert codes(FILM.format(10, 0, 3, "")) == []
    assert codes(FILM.format(10, 0, 3, ".loop;")) == ["loop/seam"]
    assert codes("A : .bar P = [0,0] Q = [50,0]; @0 A.P = [9,9]; A.angle = 0; @4") == []  # nothing moves


def test_the_help_for_a_film_can_be_typed() -> None:
    text = FILM.format(10, 0, 4, "")
    (note,) = [item for item in mv.loads(text).diagnostics if item.code == "loop/possible"]
    (edit,) = note.fixes[0].edits
    assert codes(text[: edit.span.start] + edit.text + text[edit.span.end :]) == []


@pytest.mark.parametrize(
    ("thing", "turn", "seam"),
    [
        (".gear(18, 4) C=[60,60]", 60, False),
        (".gear(18, 4) C=[60,60]", 50, True),
        (".gear(18, 4) C=[60,60] T=[80,60]", 60, True),
        (".disc(20) C=[60,60]", 50, False),
        (".disc(20) C=[60,60] P=[70,60]", 50, True),
    ],
)
def test_a_turn_that_nobody_sees_is_no_seam(thing: str, turn: int, seam: bool) -> None:
    said = codes(f"A : {thing}; @0 A.C = [60,60]; A.angle = {turn}*.t; @1 .loop;")
    assert said == (["loop/seam"] if seam else [])


def test_traces_close(tmp_path: Path) -> None:
    """The last frame's trace reaches the first point again."""
    dark: list[int] = []
    for text in (FILM.format(8, 0, 4, ".loop;"), FILM.format(8, 0, "3.875", "")):
        target = tmp_path / f"film{len(dark)}.gif"
        mv.loads(text.replace("[50,0];", "[50,0] .width(2) .color('black');")).solve().render(target, trace="A.Q")
        with Image.open(target) as film:
            assert film.n_frames == 32
            assert film.info["loop"] == 0
            film.seek(31)
            dark.append(int((np.asarray(film.convert("L")) < 128).sum()))
    assert dark[0] > dark[1] + 4  # a chord of ten pixels, part of which the bar's end covers


def test_traces_close_in_vector_films(tmp_path: Path) -> None:
    motion = mv.loads(FILM.format(8, 0, 4, ".loop;")).solve()
    motion.render(tmp_path / "film.html", trace="A.Q")
    page = (tmp_path / "film.html").read_text().replace(" ", "")
    trace = re.search(r'"rows":(\d+),"path":\[\[(\d+)\],\[(\d+)\],', page)
    packed = re.search(r'"poses":"([^"]*)"', page)
    assert trace is not None
    assert packed is not None
    numbers = np.frombuffer(base64.b64decode(packed[1]), dtype="<f4")
    rows, *columns = map(int, trace.groups())
    for column, place in zip(columns, (110.0, 60.0), strict=True):  # the path ends where it begins
        assert numbers[[column, column + rows - 1]] == pytest.approx(place, abs=1e-3)
    motion.render(tmp_path / "film.svg", trace="A.Q")
    motion.render(tmp_path / "part.svg", trace="A.Q", frames="0:31")
    assert "indefinite" in (tmp_path / "film.svg").read_text()


@pytest.mark.parametrize("speed", [90, -250])
def test_an_angle_between_vectors_keeps_turning(speed: int) -> None:
    motion = solved(BAR + f"@0 A.P = [60,60]; .a([1,0], A.Q - A.P) = {speed}*.t; @12")
    assert np.abs(motion["A.angle"] - speed * motion.times).max() < NEAR


@pytest.mark.parametrize("name", ["t", "T", "s", "iv", "pi"])
def test_a_variable_named_like_a_clock_is_asked_about(name: str) -> None:
    text = BAR + f"@0 A.P = [60,60]; A.angle = 90*{name}; @4"
    (found,) = [item for item in mv.loads(text).diagnostics if item.code == "name/clock"]
    (edit,) = found.fixes[0].edits
    better = text[: edit.span.start] + edit.text + text[edit.span.end :]
    assert f"90*.{name};" in better
    assert not [item for item in mv.loads(better).diagnostics if item.severity is mv.Severity.WARNING]


@pytest.mark.parametrize(
    ("given", "written", "meant"),
    [
        (".let radius = 40;", "(A.Q - A.P).x = raduis;", "radius"),
        (".let Speed2 = 90;", "A.angle = speed2*.t;", "Speed2"),
        ("@0 swing = 90*.t;", "A.angle = swin + swing/2;", "swing"),
        ("@0 swing2 = 90*.t; A.Q.x = swing2;", "A.Q.y = swing1;", None),
        ("", "A.angle = swing1 + swing2;", None),
        (".let radius = 40;", "A.angle = turn;", None),
    ],
)
def test_a_variable_that_is_nearly_another_name_is_asked_about(given: str, written: str, meant: str | None) -> None:
    text = BAR + (f"{given} " if "@0" in given else f"{given} @0 ") + f"A.P = [60,60]; {written} @4"
    found = [item for item in mv.loads(text).diagnostics if any("did you mean" in each for each in item.helps)]
    assert [fix.edits[0].text for item in found for fix in item.fixes] == ([meant] if meant else [])


def test_a_place_may_be_called_s() -> None:
    """What the rest determines is not asked about, even if something else is free."""
    text = (
        "C : .bar O=[0,0] P=[40,0]; R : .bar A=[0,0] B=[120,0]; F : .bar A=[0,0] B=[30,0];"
        "@0 C.O=[100,100]; C.angle=90*.t; R.A=C.P; R.B=[s,100]; s>100; F.A=[9,9]; @4"
    )
    found = {item.code for item in mv.loads(text).diagnostics}
    assert "constraint/free-motion" in found
    assert "name/clock" not in found
