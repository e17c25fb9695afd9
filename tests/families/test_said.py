"""What is said of families of scenes whose truth is known: choices, turns, jumps, help."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw

import movimentum as mv
from movimentum.analysis.examine import examine
from movimentum.diagnostics import Severity
from movimentum.rendering.off_canvas import leaving
from tests.broad import broad
from tests.families.said_scenes import cylinder, linkage, loose, tied, turning
from tests.solver.scenes import motion_of, residuals


def said(text):
    motion = motion_of(text)
    return motion, examine(motion, drawn=leaving)


def coded(examination, code, severity=Severity.WARNING):
    return [d for d in examination.diagnostics if d.code == code and d.severity is severity]


def family(small, large):
    return [*range(small), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(small, large))]


@pytest.mark.parametrize("drawn", ["closed", "moved"])
@pytest.mark.parametrize("seed", family(3, 50))
def test_what_is_drawn_closed_is_no_choice(seed, drawn):
    made = linkage(seed, drawn)
    motion, examination = said(made.text.format(more=""))
    assert examination.fault == 0
    bodies = [k for k, name in enumerate(made.things) if name != "Mark"]
    directions = motion.poses(0, 1).direction[bodies, 0]
    taken = bool(np.allclose(directions, directions[0], atol=1e-6))  # the drawing, all of it turned alike
    assert taken or drawn == "moved"
    assert bool(coded(examination, "constraint/ambiguous")) == (not taken), made.text
    assert bool(coded(examination, "constraint/as-drawn", Severity.NOTE)) == taken


@pytest.mark.parametrize("seed", family(3, 30))
def test_a_real_choice_is_told_and_each_help_selects_its_solution(seed):
    made = linkage(seed, "open")
    motion, examination = said(made.text.format(more=""))
    warnings = coded(examination, "constraint/ambiguous")
    assert len(warnings) == 1
    count = int(warnings[0].message.split()[0])
    assert 2 <= count <= 2**made.dyads
    words = [note.split(": ", 1)[1] for note in warnings[0].notes if re.match(r"(chosen|solution \d+):", note)]
    first = [line.split(",")[0] for line in words]
    assert len(set(words)) == len(words) == count
    if count == 2:
        assert first[0] != first[1]  # what differs comes first
    seen = []
    for line in warnings[0].helps:
        text = re.match(r"`(.+?)` selects", line).group(1)
        again, examined = said(made.text.format(more=text))
        assert examined.fault == 0
        assert not coded(examined, "constraint/ambiguous"), (made.text, text)
        assert max(residuals(again, again.poses(0, 1)).values()) < 1e-9
        seen.append(np.round(again.poses(0, 1).direction[:, 0], 6))
    assert all(not np.array_equal(a, b) for a, b in itertools.combinations(seen, 2))
    if seen and "the one chosen" in warnings[0].helps[0]:
        assert np.allclose(seen[0], motion.poses(0, 1).direction[:, 0], atol=1e-5)


@pytest.mark.parametrize("seed", family(3, 30))
def test_angles_that_are_found_have_no_full_turns(seed):
    motion, examination = said(cylinder(seed))
    assert examination.fault == 0
    angles = motion.poses(0, 1).angle[:, 0]
    assert (angles > -180.0).all()
    assert (angles <= 180.0).all()
    for warning in coded(examination, "constraint/ambiguous"):
        told = [float(turn) for note in warning.notes for turn in re.findall(r"turned (-?[\d.e+]+) degrees", note)]
        assert all(-180.0 < turn <= 180.0 for turn in told)


@pytest.mark.parametrize("seed", family(3, 30))
def test_tied_angles_are_as_small_as_their_tie_lets_them_be(seed):
    text, apart = tied(seed)
    motion, examination = said(text)
    if examination.fault:
        pytest.skip("out of reach")
    a, b = motion.poses(0, 1).angle[:2, 0]
    assert abs(b - a - apart) < 1e-6
    assert all(a**2 + b**2 <= (a + turn) ** 2 + (b + turn) ** 2 + 1e-6 for turn in (-360.0, 360.0))


@pytest.mark.parametrize("seed", family(12, 150))
def test_jumps_of_what_has_one_anchor(seed):
    text, jump, frame = turning(seed)
    _, examination = said(text)
    jumped = coded(examination, "solve/jump")
    seen = abs((jump + 180.0) % 360.0 - 180.0)
    if abs(seen - 1.5 * abs(frame)) < 1e-6:
        return
    assert bool(jumped) == (seen > max(1.5 * min(abs(frame), 180.0), 1e-4)), text
    for told in jumped:
        assert f"{seen:.4g} degrees" in told.message


@pytest.mark.parametrize("seed", family(4, 50))
def test_every_help_does_what_it_promises(seed):
    text = loose(seed)
    _, examination = said(text.format(more=""))
    free = sum(step.freedom for step in examination.steps[:1])
    for item in examination.diagnostics:
        if item.code != "constraint/free-motion" or item.severity is not Severity.WARNING:
            continue
        assert item.helps
        for statement in re.findall(r"`([^`]*;)`", item.helps[0]):
            _, after = said(text.format(more=statement))
            assert not [d for d in after.diagnostics if d.severity is Severity.ERROR], (text, statement)
            assert after.steps[0].freedom == free - 1, (text, statement)


NAMES = {"t": "t", "T": "T", "iv": "iv", "pi": "pi", "Pi": "pi", "time": "t"}
USES = [
    "Rod.angle = 90*{};", "Rod.B.y = 20 + 9*{};", "Rod.opacity = {}/9;", "y = 3*{};", "v = [{}, 2];",
    "Rod.angle ~ 9*{};", "Rod.angle = 3; q = .i({});", "Rod.B = Rod.A + [100,0].r({});",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
@broad("use", USES, every=4)
def test_names_of_clocks_are_asked_about(name, use):
    text = f".config(10); Rod : .bar A=[0,0] B=[100,0]; @0 Rod.A=[20,20]; {use.format(name)} @2"
    _, examination = said(text)
    helps = " ".join(line for d in examination.diagnostics for line in d.helps)
    assert f"did you mean `.{NAMES[name]}`?" in helps
    _, right = said(text.replace(use.format(name), use.format(f".{NAMES[name]}")))
    assert "did you mean" not in " ".join(line for d in right.diagnostics for line in d.helps)


def test_a_clocks_name_that_is_determined_is_a_name_like_any_other():
    _, examination = said(".config(10); Rod : .bar A=[0,0] B=[100,0]; @0 Rod.A=[2,2]; Rod.angle = 9*t; t = 3*.t; @2")
    assert not [d for d in examination.diagnostics if d.severity is not Severity.NOTE]


def test_a_multiple_root_is_one_solution():
    # two bars that just reach each other: the knee lies on the line between the pins, whichever way one looks
    for seed in range(12):
        turn = np.radians(30.0 * seed)
        end = (130.0 * np.array([np.cos(turn), np.sin(turn)])).tolist()
        _, examination = said(f""".config(10);
        A : .bar P=[0,0] Q=[70,0]; B : .bar P=[0,0] Q=[60,0];
        @0 A.P = [0,0]; B.P = [{end[0]!r}, {end[1]!r}]; A.Q = B.Q;
        @1""")
        assert not coded(examination, "constraint/ambiguous")


def test_signs_of_what_is_not_drawn_are_no_choice():
    _, examination = said(""".config(10); Rod : .bar A=[0,0] B=[100,0];
    @0 Rod.A = [20,20]; Rod.angle = 33 + 9*.t; Rod.B = Rod.A + [r,0].rotate(th);
    @1""")
    assert not coded(examination, "constraint/ambiguous")


def test_backdrops_are_passed_over_and_forgotten_parts_are_not():
    text = """.config(10, 300, 300);
    Crank : .bar O=[0,0] P=[40,0]; {more}
    @0 Crank.O = [100,100]; Crank.angle = 90*.t;
    @2"""

    def noted(more):
        _, examination = said(text.format(more=more))
        return [d.message for d in coded(examination, "constraint/free-motion", Severity.NOTE)]

    for backdrop in (
        "Wall : .bar A=[10,10] B=[200,10];", "Pivot : .disc(4) C=[100,100];", "Title : .label('x') P=[9,9];",
        "Frame : 'a.png' O=[0,0];", "P1 : .disc(2) C=[3,3]; P2 : .disc(2) C=[5,5];",
    ):  # fmt: skip
        assert noted(backdrop) == []
    assert noted("Crank2 : .bar A=[9,9] B=[20,9];") == ["no constraint mentions `Crank2`; it stays where it is drawn"]
    assert noted("Pin : .disc(4) C=[140,100];") == ["no constraint mentions `Pin`; it stays where it is drawn"]


@pytest.mark.parametrize("seed", range(6))
def test_what_leaves_the_canvas_is_told_with_when_and_a_size_that_holds_all(seed):
    rng = np.random.default_rng(seed)
    width, height = (int(v) for v in rng.integers(200, 400, 2))
    speed = float(rng.uniform(60, 200))
    text = f""".config(10, {{size}}); Dot : .disc(10) C=[0,0];
    @0 Dot.C = [50 + {speed!r}*.t, {height // 2}];
    @4"""
    _, examination = said(text.format(size=f"{width}, {height}"))
    times = np.arange(41) / 10.0
    told = [d for d in examination.diagnostics if d.code.startswith("canvas/")]
    gone = 50 + speed * times - 10 >= width
    cut = 50 + speed * times + 10 >= width + 1
    assert bool(told) == bool(cut.any())
    if not told:
        return
    assert told[0].severity is Severity.NOTE  # it may be meant to leave
    assert told[0].code == ("canvas/outside" if gone.any() else "canvas/cut-off")
    first = times[int(np.argmax(gone if gone.any() else cut))]
    assert f"t = {first:g}" in told[0].message
    size = re.search(r"\.config\(10, (\d+, \d+)\)", told[0].helps[0]).group(1)
    _, again = said(text.format(size=size))
    assert not [d for d in again.diagnostics if d.code.startswith("canvas/")]


def test_what_has_no_value_is_told_and_is_not_0_in_a_table(tmp_path):
    from movimentum.source import SourceText
    from movimentum.workflow.choices import Choices
    from movimentum.workflow.tabulate import tabulate

    text = """.config(2); Rod : .bar A=[0,0] B=[9,0];
    @0 Rod.A = [1,1]; Rod.angle = 0;  @1 x = 5 + .t; v = [3, .t];  @2 x = _;  @3 x = 9;  @4"""
    motion, examination = said(text)
    notes = {d.message.split("`")[1]: d.message for d in coded(examination, "name/no-value", Severity.NOTE)}
    assert "before t = 1 and from t = 2 to t = 3" in notes["x"]
    assert "before t = 1:" in notes["v"]
    target = tmp_path / "a.csv"
    outcome = tabulate(SourceText("a.mov", text), target, Choices(), None, lambda _done, _all: None)
    assert {d.code for d in outcome.notes} == {"name/no-value"}
    head, *rows = [line.split(",") for line in target.read_text().splitlines()]
    x = [float(row[head.index("x")]) for row in rows]
    assert x == [5, 5, 5, 5.5, 6, 6, 9, 9, 9]
    assert [float(row[head.index("v.x")]) for row in rows] == [3.0] * 9
    poses = motion.poses(0, 9)
    assert poses.missing["x"].tolist() == [True, True, False, False, True, True, False, False, False]


def test_anchors_that_are_not_drawn_may_leave_the_canvas() -> None:
    text = ".config(10, 200, 200); Arm : .bar A=[0,0] B=A+[50,0] C=A+[300,0] {}; "
    text += "@0 Arm.A = [100,100]; Arm.angle = 90*.t; @1"
    for option, expected in (("", ["canvas/cut-off"]), (".through(A, B)", [])):
        _, examination = said(text.format(option))
        assert [d.code for d in examination.diagnostics if d.code.startswith("canvas/")] == expected


def test_a_scene_without_things_leaves_nothing() -> None:
    assert not _canvas_codes(".config(10,100,100); .let w = 1.5; @0 @2")


def _canvas_codes(text: str, folder: Path | None = None) -> list[str]:
    from movimentum.source import SourceText
    from movimentum.workflow.choices import Choices
    from movimentum.workflow.stages import arranged, examined, understand

    source = SourceText("a.mov" if folder is None else str(folder / "a.mov"), text)
    solution = examined(arranged(understand(source), Choices()), Choices())
    return [d.code for d in solution.diagnostics if d.code.startswith("canvas/")]


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("letters", ["illi", "WWWW", "Illumination θ = 12°"])
def test_a_text_is_cut_where_its_letters_are(letters: str, moving: bool) -> None:
    from movimentum.rendering.layout import width_of

    wide = 16.0 * width_of(letters)
    for room, expected in ((wide + 4.0, []), (wide - 4.0, ["canvas/cut-off"])):
        where = "at = [1, 20]" if not moving else "P=[0,0]"
        text = f".config(10, {round(room)}, 60); L : .label('{letters}') {where}; @0"
        text += " L.P = [1, 20 + .t];" if moving else ""
        assert _canvas_codes(f"{text} @1") == expected, room


def _cut_pixels(text: str, folder: Path, size: tuple[int, int], beyond: int) -> bool:
    """Whether anything is drawn outside a canvas of ``size`` in any frame, from pixels: all is moved by ``beyond``."""
    wide, high = (side + 2 * beyond for side in size)
    (folder / "a.mov").write_text(text.format(size=f"{wide}, {high}", by=beyond))
    mv.load(folder / "a.mov").solve().render(folder / "a%d.png")
    for path in sorted(folder.glob("a?.png")):
        with Image.open(path) as picture:
            ink = np.asarray(picture.convert("L")) < 100
        inside = ink.copy()
        inside[beyond:-beyond, beyond:-beyond] = False
        if inside.any():
            return True
    return False


@pytest.mark.parametrize(
    "thing",
    [
        "W : 'w.png' O=[30,30]; .let far = 30;",
        "W : .bar O=[0,0] Q=O+[20,0]; L : .label('long {{.t:.5f}}') W.O .offset(9, 4); .let far = 94;",
        "W : .bar O=[0,0] Q=O+[0,50] .width(4); D : .dimension W.O W.Q .offset(-30); .let far = 38;",
        "W : .bar O=[0,0] Q=O+[-9,0] .width(4) .pins(7); .let far = 8;",
    ],
)
def test_what_is_cut_off_is_what_pixels_show(thing: str, tmp_path: Path) -> None:
    picture = Image.new("RGBA", (60, 60))
    ImageDraw.Draw(picture).ellipse((0, 0, 59, 59), fill="black")
    picture.save(tmp_path / "w.png")
    text = f".config(5, {{size}}); .let by = {{by}}; .let apart = {{apart}}; {thing}"
    text += " @0 W.O = [200 - far - apart + by, 60 + by]; W.angle = 3*.t; @1"
    truths: set[bool] = set()
    for apart in (-16, -3, 3, 8, 16):
        said = text.replace("{apart}", str(apart))
        cut = _cut_pixels(said, tmp_path, (200, 120), 90)
        truths.add(cut)
        assert _canvas_codes(said.format(size="200, 120", by=0), tmp_path) == ["canvas/cut-off"] * cut, apart
        meant = said.format(size="200, 120", by=0).replace("; .let far", " .offstage; .let far")
        assert _canvas_codes(meant.replace("; L :", " .offstage; L :"), tmp_path) == [], apart
    assert truths == {True, False}


def test_an_element_of_a_drawing_is_cut_where_it_is(tmp_path: Path) -> None:
    pytest.importorskip("resvg_py")
    wheel = '<circle id="wheel" cx="200" cy="150" r="20" fill="red"/>'
    (tmp_path / "a.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="400" height="300"><rect width="9" height="9"/>{wheel}</svg>'
    )
    for x, expected in ((40, []), (12, ["canvas/cut-off"]), (-30, ["canvas/outside"])):
        text = ".config(10, 120, 100); W : 'a.svg#wheel' O=[200,150]; "
        text += f"@0 W.O = [{x}, 50]; W.angle = 90*.t; @1"
        assert _canvas_codes(text, tmp_path) == expected, x
