"""What editors ask about texts: in the gallery, in texts that are broken anywhere, and across files."""

from __future__ import annotations

import random
from itertools import pairwise

import pytest

from movimentum.editing.about import NO_FACTS, about, renamed
from movimentum.editing.completion import proposals
from movimentum.editing.marks import entries, folds, marks
from movimentum.editing.project import Project
from movimentum.editing.word_help import FUNCTION_HELP, KIND_HELP, OPTION_HELP
from movimentum.errors import MovimentumError, ScriptError
from movimentum.source import SourceText, edited
from movimentum.syntax.parser import parse
from movimentum.syntax.vocabulary import FUNCTIONS
from movimentum.things.registry import KINDS
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import understand
from tests.broad import broad
from tests.command import ROOT

GALLERY = sorted((ROOT / "scripts").glob("*.mov"))
SMALL = [path for path in GALLERY if path.stem not in ("penrose-five", "penrose-twenty")]
BASE = """\
.config(10, 100, 100);
Rod : .bar A = [0,0] B = A + [3,0];
D : .disc(3) C = [1,1];
.part P(a) { x : .bar U = [0,0] V = [a,0]; @0 x.U = [0,0]; x.angle = 0; }
S[1..3] : P(3);
.let k = 3;
@0 Rod.A = [1,2]; Rod.angle = 0; v = 3; D.C = [k,1];
"""


def project(**texts: str) -> Project:
    files = {f"/w/{name}.mov": text for name, text in texts.items()}
    return Project(files.get)


def labels(tail: str) -> list[str]:
    """What is proposed at the mark ``|``."""
    text = BASE + tail
    at = text.index("|")
    made = proposals(project(a=text.replace("|", "", 1)), "/w/a.mov", at, lambda _folder: ["p.mov", "q.png", "sub/"])
    return [each.label for each in made]


@pytest.mark.parametrize(
    ("tail", "some", "none"),
    [
        ("Rod.|", ["A", "B", "angle", "opacity"], ["Rod", "C", ".sin", "x"]),
        ("x = 3*Rod.A.|", ["x", "y", "l", "r"], ["A", "angle"]),
        ("Rod.A.x.|", [], ["x", "A"]),
        ("S[2].|", ["x"], ["Rod", "angle"]),
        ("S[k - 1].x.|", ["U", "V", "angle"], ["A"]),
        ("S[2].x.U.|", ["x", "y"], ["U"]),
        ("(Rod.A - D.C).|", ["x", "l"], ["A", "C"]),
        ("[1,2].|", ["x", "r"], ["A"]),
        ("y = .s|", [".sin", ".sqrt", ".s"], [".bar", ".size"]),
        ("y = R|", ["Rod"], ["D", ".bar"]),
        ("Q : .|", [".bar", ".gear"], [".sin", ".color"]),
        ("Q : |", [".bar", "P"], ["Rod"]),
        ("Q : .bar A = [0,0] B = A + [1,0] .|", [".color", ".pins"], [".sin", ".teeth", ".scale"]),
        ("Q : .gear(12, 3) C = [0,0] .|", [".inner"], [".coils"]),
        ("Q : .bar A = [0,0] B = |", ["A", "k"], ["P"]),
        ("Q : P(3) .|", [".at", ".turned", ".mirrored"], [".color"]),
        ("Q : .bar A = [0,0] .color('dark|", ["darkblue"], ["red"]),
        (".config(1,2,3) .theme('|", ["textbook"], []),
        (".config(1,2,3) .|", [".theme", ".background"], [".color"]),
        ("L : .label('{Rod.|')", ["A", "angle"], ["Rod"]),
        ("L : .label('{R|", ["Rod"], []),
        (".include '|", ["p.mov", "sub/"], ["q.png"]),
        ("Q : '|", ["q.png", "sub/"], ["p.mov"]),
        (".let u = 3 .|", [".range", ".unit"], [".sin"]),
        (".claim v = 3 .|", [".within"], [".weight"]),
        (".goal v = 3 .|", [".weight", ".at"], [".within"]),
        ("v ~ 4 .|", [".speed"], [".color"]),
        ("// Rod.|", [], ["A"]),
        ("v = 2.|", [], ["x"]),
        ("|", [".let", "Rod", "v"], ["P"]),
    ],
)
def test_only_what_fits_is_proposed(tail: str, some: list[str], none: list[str]) -> None:
    found = labels(tail)
    assert set(some) <= set(found), found
    assert not set(none) & set(found), found


def test_every_word_of_the_language_has_help() -> None:
    assert set(FUNCTIONS) <= set(FUNCTION_HELP)
    assert set(KINDS) <= set(KIND_HELP)
    assert {rule.name for kind in KINDS.values() for rule in kind.options} <= set(OPTION_HELP)


@broad("path", SMALL, ids=lambda path: path.stem, every=3)
def test_names_of_the_gallery_are_those_of_the_scene(path) -> None:
    text = path.read_text(encoding="utf-8")
    shown = Project({str(path): text}.get)
    uses = shown.uses(str(path))
    assert [use.piece.text for use in uses if use.symbol is None and use.owner is None] == []
    scene = understand(SourceText(str(path), text), Choices())
    known = {use.symbol.name for use in uses if use.symbol is not None}
    names = [thing.name for thing in scene.things] + [anchor.name for thing in scene.things for anchor in thing.anchors]
    assert {part.split("[")[0] for name in names for part in name.split(".")} <= known
    assert set(scene.variables) <= known
    assert marks(shown, str(path))
    assert folds(shown.outline(str(path)))


@broad("path", SMALL, every=9, ids=lambda path: path.stem)
def test_another_name_leaves_the_scene_as_it_is(path) -> None:
    """Every ninth name, changed and changed back; with the new name the script says the same."""
    text, where = path.read_text(encoding="utf-8"), str(path)
    shown = Project({where: text}.get)
    places = sorted(
        {use.symbol.place: use for use in shown.uses(where) if use.symbol}.values(), key=lambda u: u.piece.start
    )
    for use in places[::9]:
        old = use.symbol.name
        after = edited(text, renamed(shown, where, use.piece.start, "Zz9")[where])
        scene = understand(SourceText(where, after), Choices())
        assert len(scene.things) == len(understand(SourceText(where, text), Choices()).things)
        again = Project({where: after}.get)
        first = next(each for each in again.uses(where) if each.piece.text == "Zz9")
        assert edited(after, renamed(again, where, first.piece.start, old)[where]) == text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["four-bar", "geneva", "scissor-lift", "walschaerts", "locomotive"])
def test_a_text_that_is_broken_at_any_letter_is_answered(name: str) -> None:
    answers_anywhere(name, 1)


@pytest.mark.parametrize("name", ["four-bar", "scissor-lift", "locomotive"])
def test_a_text_that_is_broken_is_answered(name: str) -> None:
    answers_anywhere(name, 29)


def answers_anywhere(name: str, step: int) -> None:
    text = (ROOT / "scripts" / f"{name}.mov").read_text(encoding="utf-8")
    r = random.Random(2)
    for end in range(0, len(text) + 1, step):
        broken = text[:end] + r.choice(["", "", ".", "{", "}", "'", "[", " : ", "@", "/*"])
        shown = Project({"/w/a.mov": broken}.get)
        for at in (len(broken), r.randrange(len(broken) + 1)):
            proposals(shown, "/w/a.mov", at, lambda _folder: [])
            about(shown, "/w/a.mov", at, lambda _name: NO_FACTS)
        found = marks(shown, "/w/a.mov")
        assert all(one.span.end <= other.span.start for one, other in pairwise(found))
        entries(shown.outline("/w/a.mov"))
        folds(shown.outline("/w/a.mov"))


@pytest.mark.parametrize("name", ["D", "k", "v", "P", "1a", "a-b", "", "ü", "_"])
def test_a_name_that_clashes_or_is_none_is_refused(name: str) -> None:
    with pytest.raises(ScriptError, match="name"):
        renamed(project(a=BASE), "/w/a.mov", BASE.index("Rod"), name)


def test_a_name_across_files() -> None:
    part = ".let len = 3;\n.part Arm(r) { b : .bar A = [0,0] B = A + [r,len]; }\n"
    main = ".include 'part.mov';\nS[1..2] : Arm(len);\n@0 x = S[2].b.B.y;\n"
    main += "L : .label('{S[1].b.B.x:.0f}') at = [0,0];\n"
    shown = project(part=part, main=main)
    edits = renamed(shown, "/w/main.mov", main.index("len"), "long")
    assert edited(part, edits["/w/part.mov"]) == part.replace("len", "long")
    assert edited(main, edits["/w/main.mov"]) == main.replace("len", "long")
    edits = renamed(project(part=part, main=main), "/w/main.mov", main.index("B.y"), "End")
    assert edited(main, edits["/w/main.mov"]) == main.replace("b.B", "b.End")
    assert edited(part, edits["/w/part.mov"]) == part.replace("B = A", "End = A")
    with pytest.raises(MovimentumError):
        renamed(project(part=part, main=main), "/w/main.mov", main.index("len"), "S")
    assert parse(SourceText("a", main))
