"""Graphs: their curves against closed forms, their dots, their sizes, and what cannot be shown."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import movimentum as mv
from movimentum.analysis.shown_numbers import with_shown_numbers
from movimentum.drawing.compose import compose
from movimentum.drawing.graph_curves import curves_of
from movimentum.drawing.graphs import thinned
from movimentum.drawing.model import FigureMark, GraphMark, SymbolMark
from movimentum.drawing.picture_options import PictureOptions
from movimentum.drawing.symbols import moving_parts
from movimentum.rendering.prepare import prepare_drawing
from movimentum.things.kinds.graph import GRAPH
from tests.drawing.test_figures import solved

CRANK = """.config(FPS, 500, 300);
C : .bar O = [100,100] P = O + [60,0];
G : .graph(SHOWN) SAID at = [250,40] .size(200,100);
@0  C.O = [100,100];  C.angle = 90*.t;
@4  .loop;
"""


def script(shown: str, said: str = "", fps: str = "10") -> str:
    return CRANK.replace("FPS", fps).replace("SHOWN", shown).replace("SAID", said)


def is_dot(mark: object) -> bool:
    return isinstance(mark, SymbolMark) and mark.kind is GRAPH


def curves(text: str) -> list[np.ndarray]:
    whole = mv.loads(text).solve().solution.motion
    scene = whole.timeline.scene
    poses = with_shown_numbers(whole, whole.poses(0, whole.timeline.frame_count))
    (mark,) = (mark for mark in compose(scene, PictureOptions()).things if isinstance(mark, GraphMark))
    return curves_of(mark, scene, [poses], whole.path)


@pytest.mark.parametrize(
    ("shown", "truth"),
    [
        ("C.P.x", lambda t: 100 + 60 * np.cos(t * np.pi / 2)),
        (".d(C.P.x)", lambda t: -60 * np.pi / 2 * np.sin(t * np.pi / 2)),
        (".d(.d(C.P.x))", lambda t: -60 * (np.pi / 2) ** 2 * np.cos(t * np.pi / 2)),
        ("C.P.x*.d(C.P.y) + 3", lambda t: (100 + 60 * np.cos(t * np.pi / 2)) * 30 * np.pi * np.cos(t * np.pi / 2) + 3),
    ],
)
@pytest.mark.parametrize("fps", ["10", "1"])
def test_a_curve_has_the_exact_values_between_frames_too(shown, truth, fps) -> None:
    (rows,) = curves(script(shown, fps=fps))
    assert len(rows) > 40, "not only those of frames"
    assert rows[:, 0].min() == 0
    assert rows[:, 0].max() == pytest.approx(4), "up to where the film begins again"
    assert rows[:, 1] == pytest.approx(truth(rows[:, 0]), abs=1e-9 * np.abs(rows[:, 1]).max())


def test_a_graph_over_an_expression_is_an_orbit() -> None:
    x, y = curves(script(".d(C.P.x)", ".over(C.P.x)"))[0][:, :2].T
    assert ((x - 100) / 60) ** 2 + (y / (30 * np.pi)) ** 2 == pytest.approx(np.ones(len(x)), abs=1e-9)


def test_the_dot_is_on_the_curve() -> None:
    scene, poses = solved(script("C.P.y", ".over(C.angle)"))
    prepared = prepare_drawing(scene, (poses,))
    (dot,) = (item.mark for item in prepared.things if is_dot(item.mark))
    where = moving_parts(dot, poses)[-1].points[:, 0]
    low, high = dot.field.low, dot.field.high
    assert where[:, 0] == pytest.approx(250 + 200 * (poses.angle[0] - low[0]) / (high[0] - low[0]))
    value = 100 + 60 * np.sin(np.radians(poses.angle[0]))
    assert where[:, 1] == pytest.approx(40 + 100 * (value - low[1]) / (high[1] - low[1]))


def test_a_polar_graph_goes_round_its_middle() -> None:
    scene, poses = solved(script("80 + 0*C.P.x", ".over(C.angle) .polar"))
    prepared = prepare_drawing(scene, (poses,))
    (dot,) = (item.mark for item in prepared.things if is_dot(item.mark))
    away = moving_parts(dot, poses)[-1].points[:, 0] - np.array([350, 90])
    assert np.hypot(*away.T) == pytest.approx(np.full(len(away), 50 * 80 / dot.field.high[1]))
    assert np.unwrap(np.arctan2(away[:, 1], away[:, 0])) == pytest.approx(np.radians(poses.angle[0]), abs=1e-6)


def test_several_curves_share_the_field_and_differ_in_colour() -> None:
    scene, poses = solved(script("C.P.x, C.P.y, 2*C.P.y"))
    prepared = prepare_drawing(scene, (poses,))
    dots = [item.mark.paint.color for item in prepared.things if is_dot(item.mark)]
    assert len(set(dots)) == 3
    figures = [item.mark for item in prepared.things if isinstance(item.mark, FigureMark)]
    assert {part.color for part in figures[-1].parts} >= set(dots)


def test_points_that_nobody_sees_are_left_out() -> None:
    t = np.linspace(0, 1, 36_000)
    points = np.stack([200 * t, 50 * np.sin(20 * t)], axis=1)
    kept = thinned(points)
    assert len(kept) < 200
    back = np.interp(points[:, 0], kept[:, 0], kept[:, 1])
    assert np.abs(back - points[:, 1]).max() < 1.0
    assert kept[[0, -1]] == pytest.approx(points[[0, -1]])


@pytest.mark.parametrize("said", ["", ".over(C.P.x)"])
def test_the_svg_of_a_graph_is_small(tmp_path: Path, said: str) -> None:
    text = script(".d(C.P.y)", said, "25").replace("P = O + [60,0];", "P = O + [60,0] .hidden;")
    mv.loads(text).solve().render(tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size < 40_000


@pytest.mark.slow
@pytest.mark.parametrize("said", ["", ".over(C.P.x)"])
def test_a_long_film_has_no_longer_curve(tmp_path: Path, said: str) -> None:
    text = script(".d(C.P.y)", said, "50").replace("@4  .loop;", "@720").replace("[60,0];", "[60,0] .hidden;")
    motion = mv.loads(text).solve()
    motion.render(tmp_path / "a.svg", frames=35_000)
    assert (tmp_path / "a.svg").stat().st_size < 40_000


@pytest.mark.parametrize(
    ("shown", "said", "told"),
    [
        ("C.P", "", "a graph shows numbers, and this is a vector"),
        ("v", "", "no statement mentions `v`"),
        ("C.Q.x", "", "has no anchor `Q`"),
        (".i(C.P.x)", "", "state a variable in a step"),
        ("C.P.x", ".over('x')", "must be an expression"),
        ("C.P.x", ".over(C.P)", "this is a vector"),
        ("C.P.x", ".over(1,2)", "`.over` takes 1 argument"),
        ("C.P.x", ".width(-1)", "must be greater than 0"),
    ],
)
def test_what_is_no_value_is_told(shown: str, said: str, told: str) -> None:
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads(script(shown, said))
    assert told in str(caught.value)


def test_a_value_that_ends_leaves_a_gap() -> None:
    text = script("v").replace("@4  .loop;", "    v = C.P.x;\n@2  v = _;\n@4")
    rows = curves(text)[0]
    assert rows[rows[:, 2] > 0, 0].max() == pytest.approx(2, abs=0.11)
    assert re.search(r"nan", str(rows)) is None


def test_a_graph_of_what_never_has_a_value_is_drawn_empty(tmp_path: Path) -> None:
    solved = mv.loads(script(".sqrt(-C.P.x)")).solve()
    assert [item.code for item in solved.diagnostics] == ["graph/empty"]
    solved.render(tmp_path / "a.png", frames=0)
    assert (tmp_path / "a.png").exists()


def test_a_graph_that_the_canvas_cuts_off_is_told() -> None:
    codes = [item.code for item in mv.loads(script("C.P.x").replace("[250,40]", "[350,40]")).solve().diagnostics]
    assert codes == ["canvas/cut-off"]
    assert not mv.loads(script("C.P.x")).solve().diagnostics


def test_only_the_dots_of_a_graph_are_drawn_anew() -> None:
    text = (
        ".config(10,400,300); C:.bar A=[0,0] B=[40,0];"
        "G:.graph(C.B.y, .d(C.B.y)) .over(C.angle) at=[200,100] .title('g');"
        " @0 C.A=[80,80]; C.angle=90*.t; @4 .loop;"
    )
    motion = mv.loads(text).solve().solution.motion
    poses = with_shown_numbers(motion, motion.poses(0, 40))
    prepared = prepare_drawing(motion.timeline.scene, poses, PictureOptions(motion=motion.path))
    changing = [type(item.mark).__name__ for item in prepared.things if np.ptp(item.state(poses), axis=0).any()]
    assert changing == ["FigureMark", "SymbolMark", "SymbolMark"]  # the crank, the dots
