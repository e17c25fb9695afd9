"""Layers, visibility, scales, pens and groups that change in time."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from movimentum.analysis.shown_numbers import with_shown_numbers
from movimentum.drawing.picture_options import PictureOptions
from movimentum.drawing.slots import _assigned, _merged
from movimentum.rendering.prepare import prepare_drawing

ARM = "Arm : .bar O = [100,100] P = O + [60,0] .color('red') .width(12);\n"
TURNS = "@0 Arm.O = [100,100]; Arm.angle = 90*.t;"


def picture(text: str, folder: Path, frame: int, name: str = "a.png") -> Image.Image:
    mv.loads(text).solve().render(folder / name, frames=frame)
    return Image.open(folder / name).convert("RGB")


def test_every_order_of_layers_has_its_places() -> None:
    rng = random.Random(3)
    for _ in range(200):
        still, moving = list(range(rng.randint(0, 5))), set(range(10, 10 + rng.randint(1, 4)))
        orders = []
        for _ in range(rng.randint(1, 8)):
            order = list(still)
            for thing in moving:
                order.insert(rng.randint(0, len(order)), thing)
            orders.append(tuple(order))
        found: tuple[int, ...] = ()
        for order in orders:
            found = _merged(found, order, moving)
        assert all(found.count(thing) == 1 for thing in still)
        for order in orders:
            places = _assigned(found, order)
            assert places == sorted(set(places))
            assert [found[place] for place in places] == list(order)


@pytest.mark.parametrize(
    ("condition", "down"),
    [
        ("Arm.angle < 100", [(0.0, 100 / 90)]),
        ("Arm.angle >= 33, Arm.angle <= 77", [(33 / 90, 77 / 90)]),
        (".d(Arm.P.y) > 0", [(0.0, 1.0)]),
        ("{ .t < 0.11 : 0; .t < 0.57 : 1; .t < 1.03 : 0; 1 }", [(0.11, 0.57), (1.03, 2.0)]),
    ],
)
def test_a_pen_lifts_at_the_instant(condition: str, down: list[tuple[float, float]]) -> None:
    motion = mv.loads(f".config(5, 200, 200);\n{ARM}Ink : .trace Arm.P .while({condition});\n{TURNS}\n@2").solve()
    made = motion.solution.motion
    poses = with_shown_numbers(made, made.poses(0, motion.timeline.frame_count))
    path = prepare_drawing(motion.timeline.scene, poses, PictureOptions(motion=made.path)).traces[0].path
    shown = path[:, 2] > 0.0
    edges = np.flatnonzero(np.diff(shown.astype(int), prepend=0, append=0))
    found = [(path[a, 3], path[b - 1, 3]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    assert np.allclose(found, down, atol=2e-7)


def test_what_is_invisible_takes_what_is_drawn_at_it_along(tmp_path: Path) -> None:
    text = f".config(10, 200, 200);\n{ARM}Cord : .line Arm.P [20,20] .width(4);\nDot : .disc(9) C = [20,180];\n"
    hidden = f"{text}{TURNS} Arm.visible = {{ .t < 0.5 : 1; 0 }};\n@1"
    alone = ".config(10, 200, 200);\nDot : .disc(9) C = [20,180];\n@0 Dot.C = [20,180];\n@1"
    assert picture(hidden, tmp_path, 4) == picture(f"{text}{TURNS}\n@1", tmp_path, 4)
    assert picture(hidden, tmp_path, 5) == picture(alone, tmp_path, 5)


def test_a_layer_in_time_is_that_of_the_definition(tmp_path: Path) -> None:
    text = f".config(10, 200, 200);\n{ARM}Disc : .disc(30) C = [120,110] .color('navy');\n"
    changing = f"{text}{TURNS} Arm.layer = {{ .t < 0.5 : 5; -1 }};\n@1"
    for frame, layer in ((4, 5), (5, -1)):
        stated = f"{text.replace('.width', f'.layer({layer}) .width')}{TURNS}\n@1"
        assert picture(changing, tmp_path, frame) == picture(stated, tmp_path, frame)


def test_a_scale_is_that_of_larger_parts(tmp_path: Path) -> None:
    text = ".config(10, 200, 200);\nDot : .disc({}) C = [90,90] .fill('gold') .edge('navy') .width({});\n"
    text += "@0 Dot.C = [100,100];"
    scaled = picture(f"{text.format(10, 2)} Dot.scale = 1 + 10*.t;\n@1", tmp_path, 2)
    larger = picture(f"{text.format(30, 6)}\n@1", tmp_path, 2)
    assert np.abs(np.asarray(scaled, dtype=int) - np.asarray(larger, dtype=int)).max() <= 2


def test_a_group_fades_as_one(tmp_path: Path) -> None:
    text = ".config(10, 200, 200);\nA : .disc(40) C = [80,100] .color('red');\n"
    text += "B : .disc(40) C = [120,100] .color('blue');\n"
    faded = picture(f"{text}Both : .group A B;\n@0 Both.opacity = 0.5;\n@1", tmp_path, 0)
    assert faded.getpixel((100, 100)) == faded.getpixel((130, 100)), "nothing shows through twice"
    assert picture(f"{text}Both : .group A B;\n@0 A.C = [80,100];\n@1", tmp_path, 0) == picture(
        f"{text}@0 A.C = [80,100];\n@1", tmp_path, 0
    )


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("Note.visible = 0;", "look/never-seen"),
        ("Note.visible = 0.5;", "look/between"),
        ("Note.scale = -1;", "look/scale"),
        ("Note.scale = 0 -> 1;", None),
        ("Note.layer = 1e300*.t;", None),
        ("Cord.scale = 2;", "kind/mismatch"),
        ("Ink.layer = 2;", "kind/mismatch"),
        ("Ink.visible = 0;", "look/never-seen"),
    ],
)
def test_odd_values_are_told(line: str, code: str | None, tmp_path: Path) -> None:
    text = f".config(10, 200, 200);\n{ARM}Cord : .line Arm.P Arm.O;\nInk : .trace Arm.P .while(Arm.angle < 400);\n"
    text += f"Note : .label('here') at = [20,20];\n{TURNS} {line}\n@1"
    try:
        motion = mv.loads(text).solve()
        found = {item.code for item in motion.diagnostics}
        motion.render(tmp_path / "a.png", at=0)
    except mv.ScriptError as error:
        found = {item.code for item in error.diagnostics}
    assert {each for each in found if each.startswith(("look/", "kind/"))} == ({code} if code else set())
