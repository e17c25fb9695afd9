"""Every fix that is shown works: its diagnostic goes away, no error comes instead, and the layout stays.

What is shown is taken from `check --format json` and SARIF, and the edits are made by this module, from lines and
columns. Whether they worked is asked of `check` again.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from movimentum.analysis.examine import examine
from movimentum.cancellation import look
from movimentum.cli.check import check_json, check_sarif
from movimentum.diagnostics import Diagnostic, limited, to_json
from movimentum.errors import MovimentumError
from movimentum.repl.session import opened
from movimentum.repl.shell import answer
from movimentum.settings import Advice
from movimentum.source import SourceText
from movimentum.workflow import fixes
from movimentum.workflow.check import check
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine
from movimentum.workflow.fixes import diagnosed, with_fixes
from tests.broad import broad
from tests.command import ROOT
from tests.families.scripts_in_tests import scripts
from tests.families.spoiled import LAYOUTS, Spoiled, spoiled

Told = dict[str, Any]


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test depends on how fast the machine is."""
    monkeypatch.setattr("movimentum.workflow.check.with_fixes", partial(with_fixes, seconds=300.0))
    monkeypatch.setattr("movimentum.repl.session.PATIENCE_S", 300.0)


def checked(text: str, folder: Path) -> tuple[list[Told], Told]:
    """The diagnostics as JSON, and the SARIF run, of a script in ``folder``."""
    path = folder / "script.mov"
    path.write_bytes(text.encode("utf-8"))
    report, source = check(str(path), Choices())
    return json.loads(check_json(report, source))["diagnostics"], json.loads(check_sarif(report, source))["runs"][0]


def offset(text: str, line: int, column: int) -> int:
    """Where a place is, counted as people count: lines end at CR LF, LF or CR."""
    ends = [0, *(match.end() for match in re.finditer(r"\r\n|\r|\n", text))]
    return ends[line - 1] + column - 1


def applied(text: str, fix: Told) -> str:
    edits = [
        (offset(text, e["line"], e["column"]), offset(text, e["end_line"], e["end_column"]), e["text"])
        for e in fix["edits"]
    ]
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def keys(told: list[Told], severity: str | None = None) -> Counter[tuple[str, str]]:
    return Counter((d["code"], d["message"]) for d in told if severity in (None, d["severity"]))


def assert_works(text: str, item: Told, fix: Told, before: list[Told], folder: Path) -> None:
    source = SourceText(str(folder / "script.mov"), applied(text, fix))
    after = to_json(limited(diagnosed(source, Choices()) or ()), source)
    key = item["code"], item["message"]
    assert keys(after)[key] < keys(before)[key], (fix, text)
    assert not keys(after, "error") - keys(before, "error"), (fix, text)


def assert_all_work(text: str, folder: Path) -> int:
    """Check every fix of a script; how many there are."""
    told, run = checked(text, folder)
    count = 0
    for item, result in zip(told, run["results"], strict=True):
        fixes = item.get("fixes", [])
        assert len(fixes) == len(result.get("fixes", []))
        for fix, other in zip(fixes, result.get("fixes", []), strict=True):
            same_in_sarif(fix, other)
            assert_works(text, item, fix, told, folder)
            count += 1
    return count


def same_in_sarif(fix: Told, other: Told) -> None:
    assert other["description"]["text"] == fix["title"]
    (change,) = other["artifactChanges"]
    replaced = [(r["deletedRegion"], r["insertedContent"]["text"]) for r in change["replacements"]]
    assert replaced == [
        (
            {
                "startLine": e["line"],
                "startColumn": e["column"],
                "endLine": e["end_line"],
                "endColumn": e["end_column"],
            },
            e["text"],
        )
        for e in fix["edits"]
    ]


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A folder in which the gallery's pictures are found."""
    (tmp_path / "sprites").symlink_to(ROOT / "scripts" / "sprites")
    return tmp_path


# --- every script that the tests and the documentation contain --------------------------------------------------------

ALL = scripts()
PARTS = 48


def test_there_are_many_scripts() -> None:
    assert len(ALL) > 500


@pytest.mark.slow
@pytest.mark.parametrize("part", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, PARTS))])
def test_every_fix_for_every_script_in_the_tests_works(part: int, room: Path) -> None:
    for text in ALL[part::PARTS]:
        assert_all_work(text, room)


# --- scripts of the gallery with one fault ----------------------------------------------------------------------------

QUICK = ("four-bar", "slider-crank")
OTHERS = ("acceleration", "maximum", "trammel", "pantograph", "scotch-yoke", "hoecken", "peaucellier")


def gallery(name: str) -> str:
    return (ROOT / "scripts" / f"{name}.mov").read_bytes().decode("utf-8")


def assert_mended(fault: Spoiled, folder: Path) -> None:
    """There is a fix, and one gives back the good script (or one that is as good)."""
    told, _ = checked(fault.text, folder)
    fixes = [(item, fix) for item in told for fix in item.get("fixes", [])]
    assert fixes, (fault.kind, told)
    results = [applied(fault.text, fix) for _, fix in fixes]
    assert fault.good in results or fault.kind == "no first step", (fault.kind, fixes)
    for item, fix in fixes:
        assert_works(fault.text, item, fix, told, folder)


def cases(names: tuple[str, ...], layouts: tuple[str, ...], places: tuple[int, ...]) -> list[tuple[str, str, int]]:
    return [(name, layout, place) for name in names for layout in layouts for place in places]


FEW = cases(("four-bar",), ("CRLF",), (0,))
MORE = cases(QUICK, tuple(LAYOUTS), (0, 1, 2)) + cases(OTHERS, tuple(LAYOUTS), (0, 2))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "layout", "place"),
    [*FEW, *(pytest.param(*case, marks=pytest.mark.slow) for case in MORE if case not in FEW)],
)
def test_a_slip_in_a_gallery_script_is_mended(name: str, layout: str, place: int, room: Path) -> None:
    good = LAYOUTS[layout](gallery(name))
    for fault in spoiled(good, place):
        if fault.kind == "a text without end" and layout == "one line":
            continue  # the next quote ends it, so nobody can say where it should have ended
        assert_mended(fault, room)


# --- what only solving shows ------------------------------------------------------------------------------------------

CRANK = """.config(10, 300, 300);{end}Crank : .bar O = [0,0] P = [50,0];  // 🦿 the crank{end}\
Rod :\t.bar A = [0,90] B = A + [130,40];{end}@0\tCrank.O = [80,100];  Crank.angle = 90*.t;  // 長{end}\
\tRod.A = Crank.P; Rod.B = [x,100];{more}{end}@2{end}"""
ENDS = {"LF": "\n", "CRLF": "\r\n", "CR": "\r", "one line": " "}


def crank(end: str, more: str = "") -> str:
    text = CRANK.format(end=ENDS[end], more=more)
    return re.sub(r"//[^;@]*?(?=Rod :|\tRod)", "", text) if end == "one line" else text


KINDS = {
    "ambiguous": ("", "constraint/ambiguous"),
    "contradiction": (" Rod.B = [400,100];", "constraint/conflict"),
    "inequalities": (" x > 90; Rod.A.x < Rod.B.x; x < 60;", "constraint/conflict"),
    "nothing to end": (" Rod.A.x < Rod.B.x; @1 Rodd = _;", "timeline/nothing-to-end"),
    "a clock": (" Rod.A.x < Rod.B.x; q = 2*t;", "constraint/free-motion"),
    "free": (" Rod.A.x < Rod.B.x; q + r = 3;", "constraint/free-motion"),
    "a claim": (" Rod.A.x < Rod.B.x; .claim x = 210 + 50*.cos(90*.t) .within(1e-9); .claim x < 260;", "claim/broken"),
}


@pytest.mark.parametrize("end", ["LF", *(pytest.param(end, marks=pytest.mark.slow) for end in ENDS if end != "LF")])
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.slow] * (kind == "contradiction")) for kind in KINDS]
)
def test_fixes_that_solving_shows(kind: str, end: str, room: Path) -> None:
    more, code = KINDS[kind]
    text = crank(end, more)
    told, _ = checked(text, room)
    assert code in {item["code"] for item in told}, told
    if kind not in ("a claim", "nothing to end"):
        assert any(item["code"] == code and item.get("fixes") for item in told), told
    assert_all_work(text, room)


REACH = """.config(10);
L : .bar O = [0,0] P = [60,0];  R : .bar O = [100,0] P = [100,70];  C : .bar A = [0,60] B = A + [50,0];
@0 L.O = [0,0];  L.angle = {speed}*.t;  R.O = [100,0];  C.A = L.P;  C.B = R.P;  C.B.y > 0;
@4
"""


@pytest.mark.slow
def test_a_length_is_offered_with_which_the_mechanism_reaches_all_the_way(room: Path) -> None:
    told, _ = checked(REACH.format(speed=60), room)
    (bound,) = (item for item in told if item["code"] == "solve/unreachable")
    assert bound["fixes"]
    titles = [fix["title"] for fix in bound["fixes"]]
    lengths = [title for title in titles if title.startswith("make `")]
    assert lengths == titles[: len(lengths)] != []  # other pins come after them
    assert all("` instead of `" in title for title in titles[len(lengths) :])


@pytest.mark.slow
def test_all_that_is_offered_for_a_reach_works(room: Path) -> None:
    assert_all_work(REACH.format(speed=60), room)


def without_one(text: str) -> list[str]:
    """``text`` without each of its inequalities in turn."""
    found = re.finditer(r"(?<=[;\n])[^;@\n/'{}]*[<>][^;@{}']*;", text)
    return [text[: match.start()] + text[match.end() :] for match in found]


ALL_NAMES = sorted(path.stem for path in (ROOT / "scripts").glob("*.mov"))
MINUTES = {"walschaerts", "scissor-lift", "vending-latch"}
"""Scripts whose fixes take minutes to try, in each layout."""


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["as it is", "CRLF", "one line"])
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * (name in MINUTES)) for name in ALL_NAMES]
)
def test_the_pose_of_a_gallery_mechanism_is_selected_again(name: str, layout: str, room: Path) -> None:
    good = gallery(name)
    for text in (good, *without_one(good)):
        assert_all_work(LAYOUTS[layout](text), room)


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK + OTHERS)
def test_a_contradiction_in_a_gallery_script_is_mended(name: str, room: Path) -> None:
    good = gallery(name)
    fixed = re.search(r"(\w+\.\w+) = \[(\d+),\s*(\d+)\];", good)
    if fixed is None:
        pytest.skip("nothing is pinned at a place in numbers")
    text = good[: fixed.end()] + f" {fixed[1]} = [{fixed[2]}, {int(fixed[3]) + 7}];" + good[fixed.end() :]
    told, _ = checked(text, room)
    assert any(item["code"] == "constraint/conflict" and item.get("fixes") for item in told), told
    assert_all_work(text, room)


# --- what is not shown ------------------------------------------------------------------------------------------------


def helps(told: list[Told], code: str) -> list[str]:
    return [text for item in told if item["code"] == code for text in item["helps"]]


def test_a_help_that_other_statements_contradict_is_not_shown(room: Path) -> None:
    pinned = """.config(10);
Rod : .bar A = [0,0] B = [100,0];
@0 Rod.A = [0,0]; Rod.B = [x,0]; y = Rod.B.x; {}
   Rod.B = [90,0];
@1
"""
    assert any(text.startswith("make `Rod` 90 long") for text in helps(checked(pinned.format(""), room)[0], CONFLICT))
    # a second bar of the same points: with another length of the first, the second contradicts
    text = pinned.format("Tie.A = Rod.A; Tie.B = Rod.B;").replace("@0", "Tie : .bar A = [0,0] B = [100,0];\n@0", 1)
    told, _ = checked(text, room)
    assert not any(text.startswith("make `") for text in helps(told, CONFLICT)), told


CONFLICT = "constraint/conflict"
CRANK_FREE = ".config(10);\nRod : .bar A=[0,0] B=[50,0];\n@0 Rod.A=[0,0]; "


def test_a_nearest_name_has_the_anchor_that_is_asked_for(room: Path) -> None:
    text = ".config(9);\nRoda : .bar A=[0,0] B=[9,0];\nRodb : .bar C=[0,0] D=[9,0];\n@0 Rod.C = [1,1]; Rodb.angle = 0;"
    (item,) = checked(text, room)[0]
    assert item["helps"] == ["did you mean `Rodb.C`?"]
    assert applied(text, item["fixes"][0]) == text.replace("Rod.C", "Rodb.C")


def test_an_error_that_was_hidden_counts_as_new(room: Path) -> None:
    """So nobody who makes a fix is met by an error that was not there."""
    text = ".config(9);\nRod : .bar A=[0,0] B=[9,0];\n@0 Rod.A = [1,1]\n   Rod.angle = 0;  Wheel.C = [0,0];"
    (item,) = checked(text, room)[0]
    assert item["helps"] == ["end the statement with `;`"]
    assert "fixes" not in item
    (item,) = checked(text.replace("Wheel.C", "x"), room)[0][:1] or [{}]
    assert "kind/mismatch" not in json.dumps(item) or "fixes" not in item


def test_a_number_is_not_made_another_one(room: Path) -> None:
    """1½ is no 11/2."""
    (item,) = checked(CRANK_FREE + "Rod.angle = 1½;\n@4\n", room)[0]
    assert item["helps"] == ["write `1/2`"]
    assert "fixes" not in item


def test_what_cannot_be_tried_in_time_is_text_only() -> None:
    source = SourceText("x.mov", "@0 x = 3y; y = 2;")
    found = diagnosed(source, Choices())
    assert with_fixes(found, source, Choices())[0].fixes[0].tried
    (item,) = with_fixes(found, source, Choices(), seconds=0.0)
    assert item.fixes == ()
    assert item.helps == found[0].helps == ("to multiply, write `3*y`",)
    assert with_fixes(found, source, Choices(), took=100.0)[0].fixes == ()


def test_a_trial_without_end_leaves_time_for_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on by a millisecond whenever somebody looks at it."""
    now = count()
    monkeypatch.setattr(fixes.time, "thread_time", lambda: 0.001 * next(now))
    source = SourceText("x.mov", "@0 x = 3y; y = 2z; z = 1;")
    found = diagnosed(source, Choices())
    assert len(found) == 2

    def endless(after: SourceText, *others: object, **more: object) -> object:
        while "3*y" in after.text:
            look()
        return ()

    monkeypatch.setattr(fixes, "diagnosed", endless)
    one, two = with_fixes(found, source, Choices(), seconds=2.0)
    assert one.fixes == ()
    assert one.helps == ("to multiply, write `3*y`",)
    assert two.fixes[0].tried
    assert next(now) < 4_000


def test_fixes_are_tried_with_the_same_choices(room: Path) -> None:
    """With ``strict`` a warning is an error, and so is one that a fix brings."""
    text = "Rod : .bar A=[0,0] B=[9,0];\n@0 Rodd.A = [1,1];"
    (room / "script.mov").write_text(text)
    strict = Choices(strict=True)
    report, _ = check(str(room / "script.mov"), strict)
    assert not any(fix.tried for item in report.diagnostics for fix in item.fixes)
    report, _ = check(str(room / "script.mov"), Choices())
    assert any(fix.tried for item in report.diagnostics for fix in item.fixes)


CANVAS = """.config( 10, 100 , 80 ) .background('white');
Rod : .bar A=[0,0] B=[50,0];
@0 Rod.A=[{},20]; Rod.angle=0;
@2
"""
OTHER_SCRIPTS = {
    "a larger canvas": CANVAS.format("20+100*.t"),
    "a canvas that fits": CANVAS.format("50-100*.t"),
    "a wish in the way": CRANK_FREE + "Rod.B ~ [0,50]; x = Rod.B.x; x ~ 100;\n@4\n",
    "a claim with a tolerance": CRANK_FREE + "Rod.angle = 30*.t; .claim Rod.B.x <= 49.99 .within(1e-4);\n@4\n",
    "a clock in a claim": CRANK_FREE + "Rod.angle = 30*.t; .claim Rod.A.x = 0*t;\n@4\n",
    "an empty claim": CRANK_FREE + "Rod.angle = 30*.t; .claim Rod.A = [_, _];\n@4\n",
    "an inequality the wrong way round": CRANK_FREE + "Rod.B = [x, 30]; x > 60;\n@4\n",
    "a length by name": CRANK_FREE + "Rod.length = 50;\n@4\n",
    "a length in bars": CRANK_FREE + "Rod.angle = 20*π; d = |Rod.A - Rod.B|;\n@4\n",
    "functions of elsewhere": CRANK_FREE + "z = distance(Rod.A, Rod.B); Rod.angle = √4; w = rotate(Rod.B, 30);\n@4\n",
    "a square": CRANK_FREE + "Rod.angle = 3² + 2;  q = ½;  r = 2π;\n@4\n",
    "an anchor before its time": "Rod : .bar A = B + [50,0]  B = [0,0];\n@0 Rod.A = [0,0]; Rod.angle = 0;\n",
    "too few anchors": "Rod : .bar P = [0,0];\n@0 Rod.P = [0,0]; Rod.angle = 0;\n",
    "no anchors": "Rod : .bar .color('red');\n@0 Rod.angle = 0;\n",
    "half a size": ".config(10, 100);\nRod : .bar A=[0,0] B=[50,0];\n@0 Rod.A=[0,0]; Rod.angle=0;\n",
    "a third dimension": CRANK_FREE + "Rod.B = [50, 0, 7];\n",
    "a power that changes": CRANK_FREE + "Rod.angle = 2^.t;\n@4\n",
    "a thing for a point": CRANK_FREE + "Rod.angle = 0; p = 2*Rod;\n",
    "a vector that nothing shows": CRANK_FREE + "Rod.B = p*q; p = 2;\n",
    "an open comment": CRANK_FREE + "Rod.angle = 0; /* the end\n@4\n",
    "nothing": "",
    "no step": "Rod : .bar A=[0,0] B=[50,0]; // a rod",
}


@broad("kind", OTHER_SCRIPTS, every=3)
def test_there_is_a_fix_that_works(kind: str, room: Path) -> None:
    assert assert_all_work(OTHER_SCRIPTS[kind], room) > 0


def test_only_those_who_show_fixes_try_them(monkeypatch: pytest.MonkeyPatch, room: Path) -> None:
    from movimentum import loads

    def refuse(*_: object, **__: object) -> tuple[Diagnostic, ...]:
        raise AssertionError("somebody tries fixes")

    monkeypatch.setattr("movimentum.workflow.fixes.with_fixes", refuse)
    monkeypatch.setattr("movimentum.workflow.check.with_fixes", refuse)
    script = loads(crank("LF"))
    assert len(script.solve()) == 21
    assert any(item.fixes and not item.fixes[0].tried for item in script.diagnostics)


# --- the debugger -----------------------------------------------------------------------------------------------------


class Talk:
    def __init__(self, text: str, folder: Path) -> None:
        path = folder / "script.mov"
        path.write_bytes(text.encode("utf-8"))
        self.session = opened(str(path), Choices())

    def __call__(self, line: str) -> str:
        self.session, said = answer(self.session, line)
        return said


@pytest.mark.parametrize("end", ENDS)
def test_the_debugger_applies_fixes_and_takes_them_back(end: str, room: Path) -> None:
    text = crank(end)
    say = Talk(text, room)
    said = say("check")
    numbers = re.findall(r"= help: apply (\d+): `([^`]+;)` selects", said)
    assert [number for number, _ in numbers] == ["1", "2"]
    for number, statement in numbers:
        say("check")
        assert "everything is determined and agrees" in say(f"apply {number}")
        assert statement in say.session.text
        assert sorted(say.session.text.replace(statement, "").split()) == sorted(text.split())
        say("undo")
        assert say.session.text == text


def test_the_debugger_mends_a_script_that_cannot_be_read(room: Path) -> None:
    good = crank("CRLF", " Rod.A.x < Rod.B.x;")
    say = Talk(good.replace("90*.t;", "90*.t").replace("Rod.A = Crank", "Rod.A = Crnk"), room)
    assert "apply" not in say("check")  # the misspelt name comes to light only behind the `;`
    say = Talk(good.replace("Rod.A = Crank", "Rod.A = Crnk"), room)
    assert "= help: apply 1: did you mean `Crank.P`?" in say("check")
    assert say("apply 1").endswith("now everything is determined and agrees")
    assert say.session.text == good
    with pytest.raises(MovimentumError):
        say("apply 1")


def test_trying_a_fix_leaves_its_helps_untried(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Advice] = []

    def watched(*arguments: Any, **choices: Any) -> Any:
        asked.append(choices["advice"])
        return examine(*arguments, **choices)

    monkeypatch.setattr("movimentum.analysis.examine.examine", watched)
    source = SourceText("x.mov", crank("LF"))
    with_fixes(diagnosed(source, Choices()), source, Choices())
    assert asked == [Advice.PLAIN] * 3


@pytest.mark.slow
def test_a_fix_is_at_its_place_after_other_edits(room: Path) -> None:
    """The motion of the same statements is taken over; the edits are those of the text as it is."""
    engine = Engine()
    text = crank("LF")
    for other in (text, "// more\n\n" + text, text.replace("[x,100];", "[x,100] /* the slide */ ;  // and more")):
        revision = engine.revise(SourceText("x.mov", other))
        assert revision.diagnostics
        advice = revision.advice(300.0)
        (item,) = (item for item in advice if item.code == "constraint/ambiguous")
        assert len(item.fixes) == 2
        assert advice == Engine().revise(SourceText("x.mov", other)).advice(300.0)
