"""The display list: what is drawn, in which order, whatever draws it."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from movimentum.drawing.arrows import arrow_parts
from movimentum.drawing.compose import compose
from movimentum.drawing.figure_outlines import PartForm
from movimentum.drawing.model import (
    DiscMark,
    FigureMark,
    ImageMark,
    LinkMark,
    NoteMark,
    Paint,
    PolylineMark,
    SymbolMark,
    TextMark,
)
from movimentum.drawing.motion import paint_at, paint_over
from movimentum.drawing.picture_options import FreeMark, PictureOptions, Show
from movimentum.scene.model import AnchorRef
from tests.command import ROOT
from tests.rendering.scenes import poses
from tests.understand import scene_of

SCRIPT = """\
Back  : 'wheel.png' C = [90,90] .scale(0.5) .layer(-1);
Rod   : .bar A = [0,0] B = A + [30,40] .color('red') .width(4);
Gone  : .bar A = [0,0] B = A + [30,40] .hidden;
Tip   : .arrow A = [0,0] B = A + [30,0];
Ring  : .disc(9) O = [5,6] .width(2);
Cord  : .line Rod.B Ring.O;
Name  : .label('a & b') A = [7,8];
@0 Rod.A = [1,2];
@1
"""


def test_every_thing_is_a_mark_from_back_to_front() -> None:
    drawing = compose(scene_of(SCRIPT.replace(" .hidden", "")), PictureOptions())
    kinds = [type(mark) for mark in drawing.things]
    assert kinds == [ImageMark, PolylineMark, PolylineMark, PolylineMark, DiscMark, LinkMark, TextMark]
    rod, cord, name = drawing.things[1], drawing.things[5], drawing.things[6]
    assert isinstance(rod, PolylineMark)
    assert (rod.paint, rod.points, rod.width, rod.arrow) == (Paint(1, (255, 0, 0)), ((0, 0), (30, 40)), 4.0, False)
    assert isinstance(cord, LinkMark)
    assert cord.through == ((1, (30, 40)), (4, (5, 6)))
    assert isinstance(name, TextMark)
    assert (name.text, name.start) == ("a & b", (7, 8))


@pytest.mark.parametrize("kind", [".plate", ".polygon", ".gear(20, 4)", ".bar"])
@pytest.mark.parametrize("way", ["theme", "supports", "ground"])
def test_supports_are_over_what_would_hide_them_and_pins_over_these(kind: str, way: str) -> None:
    shape = f"W : {kind} A = [0,0] B = A + [60,0] C = A + [60,60] .pins"
    text = {
        "theme": f".config(10) .theme('textbook'); {shape};",
        "supports": f"{shape} .supports;",
        "ground": f"{shape}; G : .ground W.A;",
    }[way]
    motion = "@0 W.A = [99,99]; W.angle = 9*.t; @1"
    marks = compose(scene_of(f"{text} {motion}"), PictureOptions()).things
    names = ["support" if isinstance(mark, SymbolMark) else "body" for mark in marks]
    if kind == ".bar":
        assert names[0] == "support"
    else:
        assert names == ["body", "support", "body"]
        assert isinstance(marks[2], FigureMark)
        assert all(part.form in (PartForm.DOT, PartForm.RING) for part in marks[2].parts)
        assert isinstance(marks[0], FigureMark)
        assert all(part.form not in (PartForm.DOT, PartForm.RING) for part in marks[0].parts)
    if way != "ground":
        without = compose(scene_of(f"{text} G : .ground W.A .hidden; {motion}"), PictureOptions()).things
        assert not any(isinstance(mark, SymbolMark) for mark in without)


def test_what_is_asked_for_is_drawn_over_the_things() -> None:
    made = scene_of("Rod : .bar A = [0,0] B = A + [30,40];\n@0 Rod.A = [1,2];\n@1\n")
    free = (FreeMark(0, (30.0, 40.0), (0.0, 1.0), 1),)
    show = frozenset({Show.NAMES, Show.ANCHORS, Show.FREE})
    drawing = compose(made, PictureOptions(traces=(AnchorRef(0, 1),), show=show, free=free))
    assert [mark.local for mark in drawing.traces] == [(30, 40)]
    assert [mark.text for mark in drawing.overlays if isinstance(mark, NoteMark)] == ["A", "B", "Rod"]
    assert len(drawing.overlays) == 4
    assert not compose(made, PictureOptions(free=free)).overlays


def test_the_ground_is_a_colour_or_nothing() -> None:
    made = scene_of(".config(10, 9, 9) .background('blue');\n" + SCRIPT.replace(" .hidden", ""))
    assert compose(made, PictureOptions()).background == (0, 0, 255)
    assert compose(made, PictureOptions(background=(1, 2, 3))).background == (1, 2, 3)
    clear = compose(made, PictureOptions(transparent=True))
    assert (clear.background, clear.matte) == (None, (0, 0, 255))


def test_a_paint_is_the_same_for_one_frame_and_for_all() -> None:
    generator = np.random.default_rng(1)
    properties = {(0, name): generator.normal(128, 200, 20) for name in ("red", "blue")}
    properties[0, "opacity"] = generator.normal(0.5, 0.7, 20)
    made = poses((0, 0, 0), visible=[[False] * 3 + [True] * 17], properties=properties, frames=20)
    paint = Paint(0, (10, 20, 30))
    opacity, color = paint_over(paint, made)
    for frame in range(20):
        one, channels = paint_at(paint, made, frame)
        assert one == opacity[frame]
        if one:
            assert channels == tuple(color[frame])


def test_an_arrow_ends_at_its_point_and_is_shorter_where_there_is_no_room() -> None:
    parts = arrow_parts([(0.0, 0.0), (100.0, 0.0)], 4.0)
    assert parts is not None
    shaft, (tip, left, right) = parts
    assert tip == (100.0, 0.0)
    assert shaft[0] == (0.0, 0.0)
    assert math.dist(tip, shaft[1]) < 4.5 * 4.0
    assert (left, right) == ((82.0, 7.2), (82.0, -7.2))
    parts = arrow_parts([(0.0, 0.0), (9.0, 0.0)], 4.0)
    assert parts is not None
    assert parts[1][1] == (0.0, 3.6)
    assert arrow_parts([(1.0, 1.0), (1.0, 1.0)], 4.0) is None
    assert arrow_parts([(1.0, 1.0)], 4.0) is None


def test_the_display_list_needs_no_pillow() -> None:
    program = "import sys, movimentum.drawing.compose, movimentum.drawing.motion; print('PIL' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout == "False\n"
