"""`.cut` in the language: its messages, its formats, and what depends on it."""

from __future__ import annotations

from pathlib import Path

import pytest

import movimentum as mv
from movimentum.cli.app import run_command_line
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from tests.understand import codes_of

HEAD = """.config(10, 300, 300);
Shaft  : .disc(8) C = [150,130] P = C + [6,0];
Roller : .disc(12) C = [150,190];
Word   : .label('a') at = [10,10];
"""
FILM = """@0 Shaft.C = [150,130];   Shaft.angle = 90*.t;
   Roller.C = [150, 190 + 12*(1 - .cos(180*.t))];   Roller.angle = 0;
@4
"""


@pytest.mark.parametrize(
    ("words", "codes"),
    [
        ("", ["cut/shape"]),
        ("Roller", ["cut/shape"]),
        ("Roller .in", ["cut/shape"]),
        ("Roller Shaft", ["cut/shape"]),
        (".in Shaft", ["cut/shape"]),
        ("Cam .in Shaft", ["cut/shape"]),
        ("Rollr .in Shaft", ["name/unknown-thing"]),
        ("Roller .in Roller", ["kind/anchors"]),
        ("Roller .in Shaft.C", ["kind/mismatch"]),
        ("Word .in Shaft", ["contact/outline"]),
        ("Roller .in Shaft .in Shaft", ["name/duplicate", "cut/shape", "kind/anchors"]),
        ("Roller .in Shaft .radius(3)", ["syntax/misplaced-option"]),
        ("Roller .in Shaft", []),
    ],
)
def test_every_mistake_has_its_message(words: str, codes: list[str]) -> None:
    assert set(codes_of(f"{HEAD}Cam : .cut {words};\n{FILM}")) <= set(codes)
    assert bool(codes_of(f"{HEAD}Cam : .cut {words};\n{FILM}")) == bool(codes)


def test_what_only_the_profile_moves_cuts_nothing() -> None:
    film = "@0 Shaft.C = [150,130];   Shaft.angle = 90*.t;   Roller.C.x = 150;   .gap(Roller, Cam) = 0;\n@4\n"
    assert codes_of(f"{HEAD}Cam : .cut Roller .in Shaft;\n{film}") == ["cut/nothing"]
    rests = "@0 Shaft.C = [150,130];   Shaft.angle = 0;   Roller.C = [150,190];\n@4\n"
    assert codes_of(f"{HEAD}Cam : .cut Roller .in Shaft;\n{rests}") == ["cut/nothing"]


def test_cuts_that_wait_for_each_other() -> None:
    assert set(codes_of(f"{HEAD}A : .cut B .in Shaft;\nB : .cut A .in Shaft;\n{FILM}")) == {"cut/shape"}


def test_errors_of_the_film_are_told_once() -> None:
    assert codes_of(f"{HEAD}Cam : .cut Roller .in Shaft;\n{FILM.replace('190 +', 'Roller.Q.x +')}") != []


@pytest.mark.slow
def test_a_cut_may_be_a_tool() -> None:
    """A profile moves with what it is cut in, so it cuts something else in a third thing."""
    more = "Plate : .disc(3) C = [150,60];\nCam : .cut Roller .in Shaft;\nMould : .cut Cam .in Plate;\n"
    film = FILM.replace("@4", "   Plate.C = [150,60];   Plate.angle = 20*.t;\n@4")
    motion = mv.loads(HEAD + more + film).solve()
    assert motion.timeline.scene.things[-1].own.outline is not None


def test_it_is_written_as_it_is_read() -> None:
    from tests.syntax.scripts_of_trees import script_text

    text = "Cam : .cut Roller .in Shaft .outer .color('gold');"
    assert parse(SourceText("a", script_text(parse(SourceText("a", text))))) == parse(SourceText("a", text))


def test_it_turns_with_what_is_cut_and_has_its_anchor() -> None:
    motion = mv.loads(f"{HEAD}Cam : .cut Roller .in Shaft;\n{FILM}").solve()
    assert abs(motion["Cam.angle"] - motion["Shaft.angle"]).max() == 0.0
    assert abs(motion["Cam.C"] - motion["Shaft.C"]).max() == 0.0


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".html", ".gif"])
def test_it_is_drawn_in_every_format(suffix: str, tmp_path: Path) -> None:
    with_it, without = (tmp_path / f"{name}{suffix}" for name in ("with", "without"))
    mv.loads(f"{HEAD}Cam : .cut Roller .in Shaft .color('gold');\n{FILM}").solve().render(with_it)
    mv.loads(HEAD + FILM).solve().render(without)
    assert with_it.read_bytes() != without.read_bytes()


def test_it_may_belong_to_a_copy() -> None:
    script = """.config(10, 400, 300);
.part drive(x) {
  Shaft  : .disc(8) C = [x,130];
  Roller : .disc(12) C = [x,190];
  Cam    : .cut Roller .in Shaft;
  @0 Shaft.C = [x,130];   Shaft.angle = 90*.t;   Roller.C = [x, 190 + 12*(1 - .cos(180*.t))];   Roller.angle = 0;
  @4
}
L : drive(100);
R : drive(300);
"""
    things = {thing.name: thing for thing in mv.loads(script).solve().timeline.scene.things}
    assert things["L.Cam"].own.outline.polyline == things["R.Cam"].own.outline.polyline


def test_its_points_are_a_table_that_can_be_read_again(tmp_path: Path) -> None:
    """As a curve through its points it touches the roller, as it does itself."""
    script = tmp_path / "cam.mov"
    script.write_text(f"{HEAD}Cam : .cut Roller .in Shaft;\n{FILM}")
    assert run_command_line(["export", str(script), "-o", str(tmp_path / "cam.csv"), "--format", "profiles"]) == 0
    assert run_command_line(["export", str(script), "-o", str(tmp_path / "cam.dxf")]) == 0
    again = tmp_path / "again.mov"
    turned = FILM.replace("@4", "   Cam.C = Shaft.C;   Cam.angle = Shaft.angle;\n@4")
    again.write_text(f"{HEAD}Cam : .curve C = [150,130] .points('cam.csv');\n{turned}")
    assert abs(mv.load(again).solve()[".gap(Roller, Cam)"]).max() < 1e-5
