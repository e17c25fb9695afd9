"""Definitions: coordinates, options, colours, pictures."""

from __future__ import annotations

from fractions import Fraction

import pytest

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.scene.build import build
from movimentum.scene.model import AnchorRef
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.things.colors import INK, color, color_names
from tests.understand import codes_of, scene_of


def local(definition: str) -> dict[str, tuple[float, float]]:
    scene = scene_of(definition + "\n@0")
    return {anchor.name: anchor.local for anchor in scene.things[0].anchors}


def test_relative_anchors() -> None:
    assert local("B : .bar A = [1,2] B = A + [30,0] C = B - [0,10] D = [1,1] - [2,2] + [3,3] E = D;") == {
        "A": (1, 2), "B": (31, 2), "C": (31, -8), "D": (2, 2), "E": (2, 2),
    }  # fmt: skip


def test_coordinates_are_constant_expressions() -> None:
    assert local("B : .bar A = [2*(3+4), -2^2] B = [.cos(60), .q(16)/8];") == {
        "A": (14, -4), "B": (pytest.approx(0.5, abs=1e-15), 0.5),
    }  # fmt: skip


def test_sprites_are_measured_from_the_lower_left() -> None:
    assert local("S : 'a.png' A = [20,10] B = A + [0,5];") == {"A": (20, 10), "B": (20, 15)}


def test_topleft_measures_down_from_the_top() -> None:
    """The picture is 200 × 100: 10 below its top is 90 above its bottom; an offset of 5 goes down too."""
    assert local("S : 'a.png' .topleft A = [20,10] B = A + [0,5];") == {"A": (20, 90), "B": (20, 85)}


def test_scale_makes_world_pixels_of_image_pixels() -> None:
    assert local("S : 'a.png' A = [20,10] .scale(0.5);") == {"A": (10, 5)}
    assert local("S : 'a.png' A = [20,10] .topleft .scale(1/4);") == {"A": (5, 22.5)}


def test_shapes() -> None:
    scene = scene_of(
        "S : 'a.png';\nB : .bar A = [0,0] B = [0,0];\nA : .arrow A = [0,0] B = [1,0];\n"
        "D : .disc(2*3) C = [1,2];\nT : .label('it''s') C = [0,0];\nL : .line B.A D.C B.B;\n@0"
    )
    kinds = ["sprite", "bar", "arrow", "disc", "label", "line"]
    assert [thing.kind.word for thing in scene.things] == kinds
    assert [thing.number for thing in scene.things] == list(range(6))
    assert scene.things[3].radius == 6
    assert scene.things[4].text == "it's"
    assert scene.things[5].through == (AnchorRef(1, 0), AnchorRef(3, 0), AnchorRef(1, 1))
    assert [thing.is_body for thing in scene.things] == [True] * 5 + [False]


def test_options_before_and_after_anchors() -> None:
    scene = scene_of(
        "A : .bar .color('#F80') P = [0,0] .width(2.5) Q = [1,0] .layer(-3) .hidden;\nB : .bar P = [0,0] Q = [1,0];\n@0"
    )
    thing, plain = scene.things
    first, second = thing.look, plain.look
    assert (first.paint, first.width, first.layer, first.hidden) == ((255, 136, 0), 2.5, -3, True)
    assert (second.paint, second.width, second.layer, second.hidden) == (INK, 7.0, None, False)
    assert scene.drawing_order() == (0, 1)


def test_a_line_may_be_defined_before_what_it_is_drawn_through() -> None:
    scene = scene_of("L : .line B.Q B.P;\nB : .bar P = [0,0] Q = [1,0];\n@0")
    assert scene.things[0].through == (AnchorRef(1, 1), AnchorRef(1, 0))


def test_colors() -> None:
    assert len(color_names()) == 148
    assert color("white") == color("WHITE") == color("#fff") == color("#FFFFFF") == (255, 255, 255)
    assert color("rebeccapurple") == (0x66, 0x33, 0x99)
    assert color("orange") == (255, 165, 0)
    assert color("#12345") is None
    assert color("") is None


def test_colors_are_those_of_the_picture_library() -> None:
    from PIL import ImageColor

    for name, value in color_names().items():
        assert ImageColor.getrgb(name) == value


def test_a_pictures_path_starts_at_the_script() -> None:
    asked: list[str] = []

    def image_size(path: str) -> tuple[int, int]:
        asked.append(path)
        return 10, 10

    text = "S : 'sprites/a.png';\n@0"
    for path, expected in (
        ("there/x.mov", "there/sprites/a.png"),
        ("x.mov", "sprites/a.png"),
        ("<stdin>", "sprites/a.png"),
    ):
        source = SourceText(path, text)
        scene = build(parse(source), source, image_size)
        assert asked.pop() == expected == scene.things[0].picture.image
        assert scene.things[0].picture.image_size == (10, 10)


@pytest.mark.parametrize("raises", [False, True])
def test_what_is_wrong_with_a_picture_is_told_where_it_is_named(raises: bool) -> None:
    def image_size(path: str) -> Diagnostic:
        found = Diagnostic("asset/unreadable", Severity.ERROR, f"`{path}` is a folder")
        if raises:
            raise ScriptError([found])
        return found

    source = SourceText("x.mov", "S : 'a' C = [0,0];\nT : .disc(0);\n@0 S.C = 3;")
    with pytest.raises(ScriptError) as raised:
        build(parse(source), source, image_size)
    first, *rest = raised.value.diagnostics
    assert (first.code, source.slice(first.span)) == ("asset/unreadable", "'a'")
    assert {item.code for item in rest} == {"kind/out-of-range", "kind/anchors", "kind/mismatch"}


def test_config() -> None:
    config = scene_of(".config(24000/1001, 600, 400) .background('navy');\n@0").config
    assert (config.fps, config.size, config.background) == (Fraction(24000, 1001), (600, 400), (0, 0, 128))
    assert scene_of(".config(0.1);\n@0").config.fps == Fraction(1, 10)
    assert scene_of(".config(12);\n@0").config.size is None
    assert scene_of("@0").config.fps == 25


def test_the_limit_of_pixels_can_be_set() -> None:
    source = SourceText("x.mov", ".config(1, 10, 10);\n@0")
    assert build(parse(source), source, lambda path: (1, 1), max_pixels=100).config.size == (10, 10)
    with pytest.raises(ScriptError) as raised:
        build(parse(source), source, lambda path: (1, 1), max_pixels=99)
    assert raised.value.diagnostics[0].code == "limit/pixels"


def test_definitions_may_stand_anywhere() -> None:
    assert codes_of("@0 B.P = [0,0];\nB : .bar P = [0,0] Q = [1,0];\n.config(3);\n@1") == []
