"""Letters along curves, where closed forms say that they are."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import movimentum as mv
from movimentum.drawing.along import placed_letters
from movimentum.drawing.model import Along

LETTERS = tuple((10.0 * k + 5.0, 10.0, ((0.0, 0.0), (0.0, 3.0))) for k in range(4))


def feet(along: Along, points: list[tuple[float, float]], closed: bool) -> np.ndarray:
    return np.array([each[0] for each in placed_letters(along, np.array([points]), closed)])


@pytest.mark.parametrize("offset", [0.0, 8.0, -8.0])
@pytest.mark.parametrize("turns", [1, -1])
def test_on_a_circle_letters_stand_outside_about_the_top(offset: float, turns: int) -> None:
    circle = [
        (50 + 40 * math.sin(turns * k / 500 * math.tau), 20 + 40 * math.cos(k / 500 * math.tau)) for k in range(500)
    ]
    found = feet(Along(LETTERS, 40.0, None, (0.0, offset)), circle, closed=True)
    radius = 40.0 + offset
    for k, (foot, tip) in enumerate(found):
        angle = (10.0 * k - 15.0) / radius
        away = np.array([math.sin(angle), math.cos(angle)])
        assert foot == pytest.approx([50, 20] + radius * away, abs=0.02)
        assert tip == pytest.approx([50, 20] + (radius + 3.0) * away, abs=0.02)


@pytest.mark.parametrize(("align", "first"), [("left", 5.0), ("center", 35.0), ("right", 65.0), (None, 5.0)])
def test_on_a_line_letters_are_aligned_and_go_straight_on(align: str | None, first: float) -> None:
    found = feet(Along(LETTERS, 40.0, align, (0.0, 0.0)), [(0, 0), (60, 80)], closed=False)
    assert found[:, 0] == pytest.approx(np.outer(first + 10.0 * np.arange(4), [0.6, 0.8]))
    short = feet(Along(LETTERS, 40.0, align, (0.0, 2.0)), [(0, 0), (6, 8)], closed=False)
    assert np.diff(short[:, 0], axis=0) == pytest.approx(np.tile([6.0, 8.0], (3, 1)))
    point = feet(Along(LETTERS, 40.0, align, (0.0, 0.0)), [(7, 7), (7, 7)], closed=False)
    assert np.isfinite(point).all()


@pytest.mark.parametrize(
    ("label", "code"),
    [
        (".label('a') .follows(D);", None),
        (".label('') .follows(D);", None),
        (".label('F_{12}^{a}') .follows(D);", None),
        (".label('a') .follows(Ink);", None),
        (".label('{D.C.x} a') .follows(D);", "kind/mismatch"),
        (".label('a') at = [0,0] .follows(D);", "kind/mismatch"),
        (".label('a') D.C .follows(D);", "kind/mismatch"),
        (".label('a') .follows(T);", "kind/mismatch"),
        (".label('a') .follows(Nothing);", "name/unknown-thing"),
        (".label('a') .follows('D');", "kind/mismatch"),
        (".label('a') .follows(D.C);", "name/unknown-thing"),
        (".label('a');", "kind/anchors"),
        (".disc(5) C = [0,0] .follows(D);", "syntax/misplaced-option"),
    ],
)
def test_what_letters_cannot_follow_is_told(label: str, code: str | None, tmp_path: Path) -> None:
    text = f"D : .disc(40) C = [50,50];\nInk : .trace D.C .while(1 < 0);\nT : {label}\n@0 D.C = [50,50];\n@1"
    if code is None:
        mv.loads(text).solve().render(tmp_path / "a.svg")
        return
    with pytest.raises(mv.ScriptError) as error:
        mv.loads(text)
    assert error.value.diagnostics[0].code == code
