"""What people write first gets a help of its own."""

from __future__ import annotations

import pytest

import movimentum as mv

BAR = "R : .bar A=[0,0] B=[9,0]"


@pytest.mark.parametrize(
    ("text", "help_"),
    [
        (f"{BAR} color('red'); @0", "write `.color(…)`"),
        ("R : .bar width(3) A=[0,0] B=[9,0]; @0", "write `.width(…)`"),
        (f"{BAR} hidden; @0", "write `.hidden`"),
        (f"{BAR}; L : .line R.A R.B color('red'); @0", "write `.color(…)`"),
        (f"{BAR}; @0 if (R.A.x > 3) R.angle = 4;", "{ .t < 3 : 4; 5 }"),
        (f"{BAR}; @0 R.angle = if (.t > 3) 4 else 5;", "{ .t < 3 : 4; 5 }"),
        (f"{BAR}; @0 R.angle = .t > 3 ? 4 : 5;", "{ .t < 3 : 4; 5 }"),
        (f"{BAR}; L : .rope R.A R.B; @0", "write `.cord`, such as `Name : .cord A.P Wheel B.Q;`"),
        (f"{BAR}; L : .plot(R.A.x) at=[0,0]; @0", "write `.graph`"),
        ("f(x) = x^2; @0", "you cannot define functions"),
        (f"{BAR}; @0 speed(t, u) = 3;", "you cannot define functions"),
        (f"{BAR}; .label('A') R.A; @0", "a thing has a name: `A : .label…`"),
        (f"{BAR}; L : .label(R.A); @0", "put the text in quotes"),
        (f"{BAR}; L : .area R; @0", "name one of its anchors: `R.P`"),
        (f"{BAR}; L : .graph R.A.x at=[0,0]; @0", "write `.graph(R.A.x)`"),
    ],
)
def test_a_first_guess_is_told_how_it_is_written(text: str, help_: str) -> None:
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads(text)
    assert help_ in str(caught.value)


def test_a_label_at_an_anchor_is_what_people_write() -> None:
    assert mv.loads(f"{BAR}; L : .label('A') R.A; @0").solve().timeline.frame_count == 1


@pytest.mark.parametrize("text", ["y = 3*(R.A.x + 1) + 4;", "f = 3;  f*(R.B.x - 3) < 90;"])
def test_other_brackets_are_no_functions(text: str) -> None:
    mv.loads(f"{BAR}; @0 {text}")
