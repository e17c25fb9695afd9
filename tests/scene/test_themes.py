"""Themes in files: what they may say, and what is said of those that are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

import movimentum as mv
from movimentum.source import FarSpan
from movimentum.things.registry import KINDS

SCRIPT = """.config(10, 300, 200) .theme('own.theme');
Rod  : .bar A = [50,50] B = A + [100,0];
Arm  : .bar A = [0,0] B = A + [100,0] .color('red') .pins(9);
Name : .label('x') Rod.B;
Big  : .label('y') Rod.A .size(40);
Lift : .graph(Rod.B.x, Rod.B.y) at = [200,100] .size(50,50);
@0 Rod.A = [50,50]; Rod.angle = 90*.t; Arm.A = Rod.B; Arm.angle = 0;
@1
"""


def looks(folder: Path, said: str) -> dict[str, object]:
    (folder / "own.theme").write_text(said, encoding="utf-8")
    (folder / "a.mov").write_text(SCRIPT, encoding="utf-8")
    return {thing.name: thing.look for thing in mv.load(folder / "a.mov").scene.things}


def codes(folder: Path, said: str | bytes) -> list[tuple[str, str]]:
    """What is said of a theme: codes, and the line that each is about."""
    (folder / "own.theme").write_bytes(said.encode() if isinstance(said, str) else said)
    (folder / "a.mov").write_text(SCRIPT, encoding="utf-8")
    with pytest.raises(mv.ScriptError) as error:
        mv.load(folder / "a.mov")
    spans = [(item.code, item.span) for item in error.value.diagnostics]
    return [(code, span.file.slice(span)) if isinstance(span, FarSpan) else (code, "") for code, span in spans]


def test_a_file_changes_what_it_names_and_definitions_stay(tmp_path: Path) -> None:
    plain = looks(tmp_path, "")
    assert plain == looks(tmp_path, "theme = 'textbook'")
    found = looks(
        tmp_path,
        "ink='#010203'\nfills=['gold', 'tan']\nlink-width=20\ncurves=['navy']\n"
        "[label]\nsize=22\nitalic=true\n[bar]\nfill='teal'\npins=5\nopacity=0.5",
    )
    rod, arm, name, big, lift = (found[each] for each in ("Rod", "Arm", "Name", "Big", "Lift"))
    assert (rod.paint, rod.width, rod.pins, rod.opacity) == ((0, 128, 128), 20.0, 5.0, 0.5)
    assert (arm.paint, arm.pins) == ((255, 0, 0), 9.0)
    assert (name.size, name.italic, big.size, name.paint) == (22.0, True, 40.0, (1, 2, 3))
    assert lift.curves == ((0, 0, 128),)
    assert looks(tmp_path, "[bar]\ndash=[3]")["Rod"].dash == (3.0, 3.0)
    assert looks(tmp_path, "[bar]\npins=false")["Rod"].pins is None
    assert looks(tmp_path, "theme='dark'")["Rod"].ink == (226, 229, 236)


def test_every_kind_may_have_a_section(tmp_path: Path) -> None:
    sections = "\n".join(f"[{word}]\nopacity = 0.5" for word, kind in KINDS.items() if "opacity" in str(kind.options))
    assert looks(tmp_path, sections)["Rod"].opacity == 0.5


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ("ink = navy", [("theme/syntax", "ink = navy")]),
        ("\n\n[label", [("theme/syntax", "[label")]),
        ("ink = 'nvy'\n[bar]\nwidth = 'x'", [("theme/value", "ink = 'nvy'"), ("theme/value", "width = 'x'")]),
        ("inks = 'navy'", [("theme/unknown", "inks = 'navy'")]),
        ("[[bar]]\nwidth = 3", [("theme/unknown", "[[bar]]")]),
        ("[bars]\nwidth = 3", [("theme/unknown", "[bars]")]),
        ("[label]\npins = 3", [("theme/unknown", "pins = 3")]),
        ("theme = 'house.theme'", [("theme/value", "theme = 'house.theme'")]),
        ("fills = []\nlink-width = nan", [("theme/value", "fills = []"), ("theme/value", "link-width = nan")]),
        ("[bar]\ndash = [1, true]\nopacity = 2", [("theme/value", "dash = [1, true]"), ("theme/value", "opacity = 2")]),
        (b"\xff", [("syntax/encoding", "")]),
        ("a = " + "[" * 5000, [("theme/syntax", "a = " + "[" * 5000)]),
    ],
)
def test_what_is_wrong_with_a_theme_is_told_at_its_place(
    tmp_path: Path, said: str | bytes, expected: list[tuple[str, str]]
) -> None:
    assert codes(tmp_path, said) == expected


def test_a_theme_that_is_not_there_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.mov").write_text(SCRIPT, encoding="utf-8")
    with pytest.raises(mv.ScriptError, match="asset/missing"):
        mv.load(tmp_path / "a.mov")
    (tmp_path / "own.theme").mkdir()
    with pytest.raises(mv.ScriptError, match="asset/missing"):
        mv.load(tmp_path / "a.mov")
