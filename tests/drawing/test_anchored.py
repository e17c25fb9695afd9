"""Areas, labels and signs at anchors and at points of the canvas, and what is seen only inside another thing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from movimentum.drawing import free_places
from movimentum.drawing.compose import compose
from movimentum.drawing.model import SymbolMark
from movimentum.drawing.picture_options import PictureOptions
from movimentum.drawing.symbols import caption, moving_parts
from movimentum.rendering.whole_film import settled
from tests.command import movimentum
from tests.drawing.test_figures import solved, symbol

SQUARE = "Q : .polygon A = [0,0] B = [100,0] C = [100,100] D = [0,100] .hidden;\n"


def area(edges: str = "") -> np.ndarray[Any, Any]:
    scene, poses = solved(f"{SQUARE}G : .area Q.A Q.B Q.C Q.D {edges}; @0 Q.A = [10,20]; Q.angle = 30*.t; @1")
    parts = moving_parts(symbol(scene, poses, "area"), poses)
    return parts[0].points


def extent(points: np.ndarray[Any, Any]) -> float:
    x, y = np.moveaxis(points, -1, 0)
    return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def test_an_area_goes_through_anchors_and_follows_them() -> None:
    corners = area()
    assert corners.shape[1:] == (4, 2)
    assert corners[0] == pytest.approx(np.array([[10, 20], [110, 20], [110, 120], [10, 120]]))
    turn = math.radians(30)
    assert corners[-1, 1] == pytest.approx([10 + 100 * math.cos(turn), 20 + 100 * math.sin(turn)])


@pytest.mark.parametrize("order", ["Q.A Q.B Q.C Q.D", "Q.D Q.C Q.B Q.A"])
@pytest.mark.parametrize("height", [0.5, 0.2, -0.2])
def test_bulges_are_arcs_that_point_outwards(order: str, height: float) -> None:
    scene, poses = solved(f"{SQUARE}G : .area {order} .bulge({height}); @0")
    found = abs(extent(moving_parts(symbol(scene, poses, "area"), poses)[0].points[0]))
    half = 2 * math.atan(2 * abs(height))
    radius = 50 / math.sin(half)
    segment = radius**2 * (half - math.sin(half) * math.cos(half))
    assert found == pytest.approx(100**2 + math.copysign(4 * segment, height), abs=120)


def test_each_edge_may_have_a_bulge_of_its_own() -> None:
    points = area(".bulge(0.2, 0)")[0]
    assert points[:, 1].min() == pytest.approx(0.0, abs=1e-9), "20 below the lower edge"
    assert points[:, 0].max() == pytest.approx(110.0), "the edge on the right is straight"


def test_a_smooth_area_goes_through_all_corners() -> None:
    points = area(".smooth")
    assert points[:, ::16] == pytest.approx(area())
    turns = np.diff(points[0], axis=0, append=points[0, :1])
    angle = np.degrees(np.arctan2(*turns.T[::-1]))
    assert np.abs((np.diff(angle) + 180) % 360 - 180).max() < 20, "without a kink"


LABELS = """.config(10, 300, 200);
R : .bar A = [100,100] B = A + [80,0] .width(4) .color('red');
L : .label('A') R.B .offset(OFFSET) SAID;
@0  R.A = [100,100];  R.angle = 90*.t;  @1
"""


@pytest.mark.parametrize(
    ("offset", "said", "place", "align"),
    [
        ("8,8", "", (8, 8), "left"),
        ("-8,8", "", (-8, 8), "right"),
        ("0,8", "", (0, 8), "center"),
        ("8,-8", "", (8, -8 - 0.72 * 16), "left"),
        ("8,0", "", (8, -0.36 * 16), "left"),
        ("8,8", ".align('right')", (8, 8), "right"),
    ],
)
def test_a_label_stands_beside_its_anchor(offset: str, said: str, place: tuple[float, float], align: str) -> None:
    scene, poses = solved(LABELS.replace("OFFSET", offset).replace("SAID", said))
    words = caption(symbol(scene, poses, "label"), poses)
    assert words is not None
    assert words.align == align
    assert words.place - poses.world(0, scene.things[0].anchors[1].local) == pytest.approx(np.tile(place, (11, 1)))


def test_a_label_finds_a_place_that_crosses_nothing_and_stays_there() -> None:
    text = """.config(10, 300, 300);
    R : .bar A = [0,0] B = A + [80,0] .width(4) .color('red');
    O : .disc(60) C = [150,150] .width(2);
    N : .label('name') O.C;   M : .label('end') R.B;
    @0  R.A = [150,150];  R.angle = 20*.t;  @10"""
    scene, poses = solved(text)
    end = caption(symbol(scene, poses, "label"), poses)
    marks = [item for item in __import__("movimentum.rendering.prepare", fromlist=["x"]).prepare_drawing(
        scene, (poses,)).things if getattr(item.mark, "spot", None) is not None]  # fmt: skip
    again = [item.mark.spot for item in marks]
    assert end is not None
    assert len(again) == 2
    at = caption(marks[1].mark, poses)
    assert at is not None
    local = poses.world(0, scene.things[0].anchors[1].local)
    away = at.place - local
    assert np.abs(np.diff(np.hypot(*away.T))).max() < 3.0, "it does not hop"
    mid = (local + at.place) / 2 - poses.world(0, scene.things[0].anchors[0].local)
    assert np.hypot(*mid.T).min() > 70, "it is beyond the end of the bar, or beside it"


def test_points_of_the_canvas_stand_for_anchors() -> None:
    text = """.part Hung(x = 0) { B : .bar P = [0,0] Q = [40,0];  S : .spring B.Q [x,90] .coils(4);  @0 B.P = [0,0]; }
    H[1..2] : Hung(10) .at([100,0]);
    R : .bar A = [0,0] B = [50,0];   L : .line R.A [0,20] R.B [30,-40];   D : .dimension [0,0] [30,40];
    @0  R.A = [5,5];"""
    scene, poses = solved(text)
    line = next(thing for thing in scene.things if thing.name == "L")
    places = [poses.world(ref.thing, scene.local(ref))[0].tolist() for ref in line.through]
    assert places == [[5, 5], [0, 20], [55, 5], [30, -40]]
    spring = next(thing for thing in scene.things if thing.name == "H[1].S")
    assert scene.local(spring.through[1]) == pytest.approx((110, 90)), "placed with the copy"
    found = caption(symbol(scene, poses, "dimension"), poses)
    assert found is not None
    assert found.texts == ["50"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("R : .bar A=[0,0] B=[9,0]; L : .line R.A [x,0]; @0 x = 3; R.A = [0,0];", "must be a constant"),
        ("R : .bar A=[0,0] B=[9,0]; L : .line R.A; @0 R.A = [0,0];", "at least 2 anchors"),
        ("R : .bar A=[0,0] B=[9,0]; L : .area R.A R.B; @0 R.A = [0,0];", "at least 3 anchors"),
        ("R : .disc(9) A=[0,0] .clip R; @0 R.A = [0,0];", "cannot be cut off by itself"),
        ("R : .bar A=[0,0] B=[9,0]; D : .disc(4) A=[0,0] .clip R; @0 R.A = [0,0];", "which has no inside"),
        ("R : .bar A=[0,0] B=[9,0]; D : .disc(4) A=[0,0] .clip(Q); @0 R.A = [0,0];", "no thing called `Q`"),
        ("R : .bar A=[0,0] B=[9,0]; L : .label('x') R.A R.B; @0 R.A = [0,0];", "is drawn at 1 anchor"),
        ("R : .bar A=[0,0] B=[9,0]; L : .label('x') R.A .offset(3); @0 R.A = [0,0];", "`.offset` takes 2 arguments"),
    ],
)
def test_what_cannot_be_drawn_is_told(text: str, told: str) -> None:
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads(text)
    assert told in str(caught.value)


def test_what_is_clipped_is_seen_inside_only(tmp_path: Path) -> None:
    text = """.config(10, 200, 100);
    T : .disc(30) C = [60,50] .hidden;
    B : .bar P = [0,50] Q = [200,50] .width(20) .color('#ff0000') .clip T .opacity(0.5);
    W : .area [0,0] [200,0] [200,40] [0,40] .color('#0000ff') .clip(T);
    @0"""
    motion = mv.loads(text).solve()
    motion.render(tmp_path / "a.png", frames=0)
    image = Image.open(tmp_path / "a.png").convert("RGB")
    assert image.getpixel((60, 47)) == (255, 127, 127)
    assert image.getpixel((60, 75)) == (0, 0, 255)
    assert {image.getpixel(place) for place in ((20, 50), (100, 50), (10, 75), (60, 90))} == {(255, 255, 255)}


def test_a_body_clips_by_all_its_pieces_and_not_in_their_holes(tmp_path: Path) -> None:
    text = """.config(10, 200, 100);
    Big : .disc(30) C = [50,50];  Hole : .disc(8) C = [40,50];  Eye : .disc(6) C = [65,60];
    Far : .disc(20) C = [150,50];
        .body Two = Big + Far - Hole - Eye .hidden;
    W : .area [0,0] [200,0] [200,100] [0,100] .color('#0000ff') .clip Two;
    @0 Big.C = [50,50]; Two.angle = 90*.t; @1"""
    motion = mv.loads(text).solve()
    for frame, there in ((0, [(1, 0), (0, 1)]), (10, [(0, 1), (-1, 0)])):
        motion.render(tmp_path / "a.png", frames=frame)
        image = Image.open(tmp_path / "a.png").convert("RGB")
        (ux, uy), (vx, vy) = there

        def color(x: float, y: float, image: Image.Image = image, frame: Any = (ux, uy, vx, vy)) -> object:
            a, b, c, d = frame
            return image.getpixel((round(50 + x * a + y * c), round(100 - (50 + x * b + y * d))))

        inside = [(0, 0), (-20, 0), (0, 20), (25, 0), (0, -25)] + ([(100, 0), (100, 15)] if frame == 0 else [])
        assert {color(*place) for place in inside} == {(0, 0, 255)}
        assert {color(*place) for place in ((-10, 0), (-7, 3), (15, 10), (33, 0), (45, 0))} == {(255, 255, 255)}


def test_an_area_of_hidden_things_is_drawn() -> None:
    assert extent(area()[0]) == pytest.approx(10_000)


def test_thousands_of_labels_are_drawn(tmp_path: Path) -> None:
    bars = "".join(f"L{k} : .label('{k}') R.A;\n" for k in range(2000))
    (tmp_path / "a.mov").write_text(f"R : .bar A=[0,0] B=[99,0];\n{bars}@0 R.A = [0,0];\n", encoding="utf-8")
    done = movimentum("run", tmp_path / "a.mov", "-o", tmp_path / "a.png")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_label_is_compared_with_what_is_near(monkeypatch: pytest.MonkeyPatch) -> None:
    """So a thousand bars cost each label as much as some do; and the places are those of comparing with all."""

    def places(count: int, near: bool = True) -> tuple[list[object], int]:
        compared = 0
        plain = free_places._Lines.near  # pyright: ignore[reportPrivateUsage]

        def counted(lines: Any, low: Any, high: Any) -> Any:
            nonlocal compared
            some = plain(lines, low, high) if near else lines
            compared += some.ends.shape[1]
            return some

        bars = "".join(
            f"B{k} : .bar a=[0,0] b=[{9 + k % 7},{k % 5}]; L{k} : .label('n{k}') B{k}.a;\n" for k in range(count)
        )
        put = "".join(f"B{k}.a = [{k % 10 * 41},{k // 10 * 37}]; B{k}.angle = {k * k}*.t;\n" for k in range(count))
        scene, poses = solved(f".config(4); {bars}@0 {put}@1")
        with monkeypatch.context() as patched:
            patched.setattr(free_places._Lines, "near", counted)
            drawn = compose(scene, PictureOptions())
            marks = settled(drawn.things, scene, (poses,), PictureOptions())
        return [mark.spot for mark in marks if isinstance(mark, SymbolMark) and mark.kind.word == "label"], compared

    few, many = places(20), places(200)
    assert len(set(few[0])) > 3
    assert places(20, near=False)[0] == few[0]
    assert many[1] / 200 < 1.5 * few[1] / 20


def test_supports_has_an_older_word_that_is_told() -> None:
    text = ".config(10,200,100); R : .bar A=[40,40] B=[90,40] SAID; @0 R.A=[40,40]; R.angle = 0;"
    new, old = (mv.loads(text.replace("SAID", said)) for said in (".supports", ".fixed"))
    assert new.scene.things[0].look == old.scene.things[0].look
    assert not new.diagnostics
    assert [item.code for item in old.diagnostics] == ["option/fixed"]


def test_a_hidden_ground_leaves_a_support_out() -> None:
    text = ".config(10,200,100) .theme('textbook'); R : .bar A=[40,40] B=[90,40]; MORE @0 R.A=[40,40]; R.angle = 0;"
    count = [len(mv.loads(text.replace("MORE", more)).scene.grounds) for more in ("", "No : .ground R.A .hidden;")]
    assert count == [1, 0]


@pytest.mark.parametrize("text", ["A", "a long name of a pin", "P = ({R.B.x:.0f}, {R.B.y:.0f})"])
@pytest.mark.parametrize(("wide", "high"), [(300, 300), (420, 260), (260, 420)])
@pytest.mark.parametrize("seed", range(6))
def test_a_label_that_finds_a_place_is_on_the_canvas(text: str, wide: int, high: int, seed: int) -> None:
    """Wherever there is one: the anchors are anywhere on it, and each point has more room on one of its sides."""
    at = np.random.default_rng([seed, wide]).uniform(20.0, [wide - 20.0, high - 20.0])
    scene, poses = solved(
        f""".config(10, {wide}, {high});
        R : .bar A = [0,0] B = A + [9,0] .width(2);   N : .label('{text}') R.A {".leader" * (seed % 2)};
        @0  R.A = [{at[0]},{at[1]}];  R.angle = 20*.t;  @2"""
    )
    drawn = compose(scene, PictureOptions())
    (mark,) = [
        each
        for each in settled(drawn.things, scene, (poses,), PictureOptions())
        if isinstance(each, SymbolMark) and each.kind.word == "label"
    ]
    words = caption(mark, poses)
    assert words is not None
    for place, letters in zip(words.place, words.texts, strict=True):
        half = np.array([free_places.broad(letters, mark.size) / 2.0, mark.size / 2.0])
        shift = half * [{"left": 1.0, "right": -1.0}.get(words.align, 0.0), 0.0]
        assert np.all(place + shift - half > -0.5)
        assert np.all(place + shift + half < [wide + 0.5, high + 0.5])
