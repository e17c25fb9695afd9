"""Scripted debugging sessions, against what is known of the scenes by hand."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document

from movimentum.errors import MovimentumError
from movimentum.repl.session import opened
from movimentum.repl.shell import COMMANDS, answer, split, step
from movimentum.workflow.choices import Choices
from tests.broad import broad
from tests.command import BINDS, movimentum
from tests.solver.scenes import motion_of

SLIDER = """.config(20, 300, 300);
Crank : .bar O=[100,100] P=[140,100];   // the crank
Rod   : .bar A=[140,100] B=[260,100];
@0 Crank.O=[100,100]; Crank.angle=90*.t;   // drives
   Rod.A=Crank.P;
   Rod.B=[x,100];  x > 100;
@2
   Crank.angle = 180;   /* stop */
@4
"""
OPEN = SLIDER.replace("  x > 100;", "")


class Talk:
    """A session, and what it says."""

    def __init__(self, folder, text: str) -> None:
        self.path = folder / "scene.mov"
        self.path.write_text(text)
        self.session = opened(str(self.path), Choices())

    def __call__(self, line: str) -> str:
        self.session, text = answer(self.session, line)
        return text

    def refuses(self, line: str) -> str:
        with pytest.raises(MovimentumError) as caught:
            self(line)
        return caught.value.diagnostics[0].code


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """No test depends on how fast the machine is."""
    monkeypatch.setattr("movimentum.repl.session.PATIENCE_S", 300.0)


@pytest.fixture
def talk(tmp_path):
    return lambda text=SLIDER: Talk(tmp_path, text)


def test_moving(talk):
    say = talk()
    assert say("at 1.5").startswith("t = 1.5 (frame 30), in step @0 (line 4)")
    assert say("at 15e-1").startswith("t = 1.5 ")
    assert "frame 31" in say("next")
    assert "frame 30" in say("back")
    assert say("at 4/3").startswith("t = 1.333333333 (between frames 26 and 27)")
    assert "frame 26" in say("back")
    assert say("frame -1").startswith("t = 4 (frame 80)")
    assert say.refuses("next") == "repl/frame"
    assert say.refuses("at 9") == say.refuses("at x") == say.refuses("at 1e9999999999") == "repl/time"
    assert say.refuses("frame 81") == "repl/frame"
    assert [line.split()[0] for line in say("steps").splitlines()] == ["@0", "@2", "->"]


def test_run_until_finds_the_first_frame(talk):
    say = talk()
    said = say("run until Crank.P.y >= 130")
    first = math.ceil(math.degrees(math.asin(30 / 40)) / 90 * 20)
    assert f"(frame {first})" in said
    assert say.refuses("run until x > 1000") == "repl/never"
    assert say.refuses("run") == "repl/argument"


def test_what_is_shown_is_where_things_are(talk):
    say = talk()
    say("at 0.5")
    assert say("show (Rod.B - Crank.P).l") == "(Rod.B - Crank.P).l = 120"
    height = 40 * math.sin(math.pi / 4)
    x = 100 + height + math.sqrt(120**2 - height**2)
    assert abs(float(say("show x").split()[-1]) - x) < 1e-7
    assert say("show .t") == ".t = 0.5"
    assert say("show Crank").splitlines()[0].split(None, 1) == ["Crank.O", "[100, 100]"]
    assert "Rod.angle" in say("show")
    assert say("watch Crank.angle") == "Crank.angle = 45"
    assert say("next").endswith("Crank.angle = 49.5")
    for wrong in ("show 3*", "show Rod.Q", "show x = 3", "plot"):
        say.refuses(wrong)


def test_constraints_tell_where_from_and_until_when(talk):
    say = talk()
    (head, row) = say("constraints Crank.angle").splitlines()
    assert row.split() == ["Crank.angle=90*.t", "4", "@0", "@2", "0"]
    assert head.split()[:2] == ["constraint", "line"]
    assert "holds, by 160" in say("constraints x >")
    say("at 3")
    assert "8" in say("constraints Crank.angle").splitlines()[1].split()
    assert say.refuses("constraints y") == "repl/key"


def test_why_names_what_determines_and_nothing_else(talk):
    say = talk(SLIDER.replace("@0 ", "Lamp : .disc(3) C=[9,9];\n@0 Lamp.C = [20,20]; "))
    found = [line.split(": ", 1)[1] for line in say("why Crank.P").splitlines()]
    assert sorted(found) == ["`Crank.O=[100,100]`", "`Crank.angle=90*.t`", "`Crank` is rigid"]
    found = say("why x")
    for part in ("Crank.O=[100,100]", "Rod.A=Crank.P", "Rod.B=[x,100]", "Crank.angle=90*.t", "`Rod` is rigid"):
        assert part in found
    assert "Lamp" not in found
    assert "Lamp.C" in say("why Lamp")
    assert "stays as drawn" in talk(SLIDER.replace("@0 ", "Wall : .bar A=[0,0] B=[1,0];\n@0 "))("why Wall")


@broad("name", ["x", "Rod.B.x", "Crank.P.y", "Rod.angle"], first=3)
def test_a_formula_agrees_with_the_motion(talk, name):
    say = talk()
    text = say(f"formula {name}").splitlines()[0].split(" = ", 1)[1]
    for time in ("0.1", "0.7", "1.3"):
        say(f"at {time}")
        apart = say(f"show {name} - ({text})")  # it is an expression of the language
        assert abs(float(apart.split()[-1])) < 1e-6


def test_no_formula_without_a_closed_form(talk):
    triad = """.config(10);
    Base : .bar A=[0,0] B=[26,0] C=[21,26];
    Plate : .bar P=[8,3] Q=[28,2] R=[10,28];
    L1 : .bar A=[0,0] B=[8,3]; L2 : .bar A=[26,0] B=[28,2]; L3 : .bar A=[21,26] B=[10,28];
    @0 Base.A=[0,0]; Base.angle=0; L1.A=Base.A; L2.A=Base.B; L3.A=Base.C; L1.B=Plate.P; L2.B=Plate.Q; L3.B=Plate.R;
    @1"""
    assert "no closed form" in talk(triad)("formula Plate.P")


def test_solutions_are_all_and_what_is_pasted_selects(talk, tmp_path):
    say = talk(OPEN)
    said = say(f"solutions -o {tmp_path / 'sheet.png'}")
    assert said.startswith("2 solutions for")
    assert [line.lstrip("-> ")[0] for line in said.splitlines()[1:] if re.match(r"\s*(->)?\s*\d\.", line)] == ["1", "2"]
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.width > 300
    before = float(say("show x").split()[-1])
    other = next(n for n, text in enumerate(say.session.suggestions, 1) if text == "Rod.A.x > Rod.B.x;")
    say(f"apply {other}")
    assert before == 260
    assert abs(float(say("show x").split()[-1]) - 20) < 1e-9
    assert "rejected by line 6: `x > 100`, by 80" in talk(SLIDER)("solutions")
    still = "Rod : .bar A=[0,0] B=[9,0]; @0 Rod.A = [1,1]; Rod.angle = 0; @1"
    assert talk(still)("solutions").startswith("there is one solution only")


def test_what_rejects_every_solution_is_told_and_turned_round(talk):
    say = talk(SLIDER.replace("x > 100", "x > 400"))
    said = say("solutions")
    assert said.startswith("there is no pose at t = 0: ")
    assert "rejected by line 6: `x > 400`, by 140" in said
    assert "rejected by line 6: `x > 400`, by 380" in said
    assert say("apply 1").endswith("everything is determined and agrees")
    assert "x < 400" in say("diff")
    assert abs(float(say("show x").split()[-1]) - 260) < 1e-9


@pytest.mark.slow
def test_exact_times(talk):
    say = talk(SLIDER)
    time = (180 / math.pi) * math.asin(0.5) / 90
    assert f"t = {time:.12g}" in say("when Crank.P.y = 120").replace("0.3333333333333", f"{time:.12g}")
    say("until Crank.P.y = 120")
    assert abs(float(say.session.time) - time) < 1e-15
    say("until Crank.P.y = 120")
    say("back until Crank.P.y = 120")
    assert abs(float(say.session.time) - time) < 1e-15
    assert say.refuses("back until x = 9999") == "repl/never"
    assert say("when x = 999").startswith("`x = 999` never holds; `x` goes from ")
    assert say("max Crank.P.y") == "Crank.P.y is largest at t = 1: 140"
    assert say("break when Crank.P.y = 130").endswith("2 times in the film")
    assert say("run").startswith("`Crank.P.y = 130` comes to hold")
    say("run")
    assert say("run").startswith("no breakpoint is reached\nt = 4 ")
    for wrong in ("when", "when x", "until", "back until", "max", "break x = 3", "when x = [1,2]", "when Rod.Q = 3"):
        say.refuses(wrong)


def test_thumbnails_show_the_whole_of_each_solution(talk, tmp_path):
    say = talk(OPEN.replace("B=[260,100]", "B=[330,100]"))  # ends at 330 and at -50, on a canvas of 300
    say(f"solutions -o {tmp_path / 'sheet.png'}")
    with Image.open(tmp_path / "sheet.png") as sheet:
        pixels = np.asarray(sheet.convert("L")).astype(int)
    half = len(pixels) // 2
    ends = [np.nonzero((part < 100).any(axis=0))[0] for part in (pixels[30:half], pixels[half + 30 :])]
    # nothing is cut off by the edge, which is 8 pixels of grey
    assert 0.8 * pixels.shape[1] < ends[0].max() < pixels.shape[1] - 11  # to the right in one,
    assert 11 < ends[1].min() < 0.2 * pixels.shape[1]  # to the left in the other


def test_free_motion_is_told_and_stopped(talk):
    say = talk(SLIDER.replace("   Rod.B=[x,100];  x > 100;\n", ""))
    assert "can still turn about `Rod.A`" in say("free")
    assert len(say.session.suggestions) == 1
    say("apply 1")
    assert say("free") == "nothing can move in a way that is not determined"


def test_wiggling_keeps_everything_else_true(talk, tmp_path):
    from movimentum.analysis.interactive.branches import free_swings

    say = talk(SLIDER.replace("   Rod.B=[x,100];  x > 100;\n", ""))
    said = say(f"wiggle {tmp_path / 'a.gif'}")
    assert "`Rod` can still turn about `Rod.A`" in said
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames > 10
    segment_motion = say.session.segment_motion
    ((_motion, moments),) = free_swings(segment_motion, segment_motion.pieces[0], 0.0)
    turns = []
    for moment in moments:
        rod = moment.things[1]
        assert abs(rod.x + 140 * rod.c - 100 * rod.s - 140) < 1e-9  # A stays on the crank pin
        assert abs(rod.y + 140 * rod.s + 100 * rod.c - 100) < 1e-9
        turns.append(math.degrees(math.atan2(rod.s, rod.c)))
    assert max(turns) > 3
    assert min(turns) < -3
    assert abs(turns[0]) < 1e-9
    assert abs(turns[-1]) < 1e-6
    assert talk()(f"wiggle {tmp_path / 'b.gif'}").startswith("nothing can move")


ARM = """.config(20, 300, 300);
Upper : .bar S=[100,100] E=[160,100];
Lower : .bar E=[160,100] H=[160,160];
Shelf : .bar P=[10,10] Q=[60,10];
@0 Upper.S=[100,100]; Lower.E=Upper.E; Shelf.P=[10,10];
@2
"""


def test_dragging_pulls_along_what_it_must_and_nothing_else(talk, tmp_path):
    say = talk(ARM)
    said = say("drag Lower.H to [60, 160]")
    assert said.startswith("`Lower.H` gets there")
    assert "`Upper` moves" in said
    assert "Shelf" not in said  # not connected
    assert "apply 1: Lower.H ~ [60, 160];" in said
    film = tmp_path / "drag.gif"
    assert f"wrote {film}" in say(f"drag Lower.H to [60, 160] -o {film}")
    with Image.open(film) as picture:
        assert picture.format == "GIF"
        assert picture.n_frames > 5


def test_dragging_ends_as_near_as_can_be(talk):
    # an arm of 60 + 60 from (100, 100) toward (400, 100) ends stretched, 180 away
    assert "comes no nearer than 180:" in talk(ARM)("drag Lower.H to [400, 100]")


def test_dragging_a_straight_arm_along_its_line_is_stuck(talk):
    straight = ARM.replace("H=[160,160]", "H=[220,100]")
    assert "is stuck 100 from there" in talk(straight)("drag Lower.H to [120, 100]")


def test_dragging_an_angle_and_what_cannot_be_dragged(talk):
    say = talk(ARM)
    assert say("drag Lower.angle to Upper.angle + 30").startswith("`Lower.angle` gets there")
    assert say("drag Upper.S to [0, 0]").startswith("`Upper.S` is determined, and cannot be dragged; it is 141.4")
    assert say.refuses("drag Lower.H") == "repl/argument"
    assert say.refuses("drag Lower.H to 3") == "repl/kind"
    assert say.refuses("drag Lower.X to [1,2]") == "name/unknown-anchor"
    assert talk(SLIDER)("drag Rod.B to [0,0]").startswith("`Rod.B` is determined")


def test_dragging_what_is_only_measured_drags_what_it_is_measured_of(talk):
    say = talk(ARM.replace("@2", "h = (Lower.H - Upper.S).l;\n@2"))
    said = say("drag h to 110")
    assert said.startswith("`h` gets there")
    assert "`Lower` moves" in said
    assert say("drag h to 200").startswith("`h` comes no nearer than 80:")


@pytest.mark.slow
def test_a_drag_can_be_kept(talk):
    say = talk(ARM)
    say("drag Lower.H to [60, 160]")
    say("apply 1")
    assert "Lower.H ~ [60, 160];" in say.session.work.source.text
    shown = say("show Lower.H")
    assert "60" in shown
    assert "160" in shown
    assert "(a wish says where it goes)" in say("free")


def test_branch_tells_how_near_the_other_solution_comes(talk):
    rows = talk()("branch").splitlines()
    assert len(rows) == 2  # the crank stands still from 2 on
    # the two solutions mirror each other about the crank pin: nearest where the pin is highest
    assert abs(float(rows[1].split()[-2]) - 2 * math.sqrt(120**2 - 40**2)) < 0.5


def test_a_statement_takes_effect_at_once_and_can_be_taken_back(talk):
    say = talk()
    say("at 1")
    say("Crank.angle = 45*.t")
    assert "Crank.angle = 45*.t;   // drives" in say.session.text  # in place of what the step said
    assert say("show Crank.angle") == "Crank.angle = 45"
    say("undo")
    assert say("show Crank.angle") == "Crank.angle = 90"
    assert say.session.text == SLIDER
    say("redo")
    assert say("show Crank.angle") == "Crank.angle = 45"
    assert "-@0 Crank.O=[100,100]; Crank.angle=90*.t;   // drives" in say("diff")
    say("undo")
    assert say("diff") == "nothing is changed"
    assert say.refuses("undo") == "repl/nothing-to-undo"


def test_a_new_statement_goes_to_the_end_of_its_step(talk):
    say = talk()
    say("Crank.opacity = 0.5;")
    assert "  x > 100;\n   Crank.opacity = 0.5;\n@2" in say.session.text
    say("at 3")
    say("x < 200")
    assert "/* stop */\n   x < 200;\n@4" in say.session.text
    say(f"write {say.path}")
    assert say.path.read_text() == say.session.text
    assert say("diff") == "nothing is changed"


TURNS = """.config(10, 200, 200);
Hand : .bar A = [100, 100] B = [150, 100];
@0 Hand.A = [100, 100];   Hand.angle = 10*.t;   side = 0;
.for k = 0..2 {
@k + 1   side = k;
}
@5
"""


def test_one_turn_of_a_loop_has_no_place_for_a_statement(tmp_path):
    path = tmp_path / "turns.mov"
    path.write_text(TURNS, encoding="utf-8")
    session = opened(str(path), Choices())
    later, _ = answer(session, "at 2.5")
    with pytest.raises(MovimentumError) as refusal:
        answer(later, "Hand.angle > -90")
    (item,) = refusal.value.diagnostics
    assert item.code == "repl/elsewhere"
    assert "one turn of a loop (k = 1)" in item.message
    assert item.helps[0] == "at 0"
    earlier, _ = answer(later, item.helps[0])
    changed, said = answer(earlier, "Hand.angle > -90")
    assert "everything is determined" in said
    assert "@0 Hand.A = [100, 100];   Hand.angle = 10*.t;   side = 0;\n     Hand.angle > -90;\n.for" in changed.text


def test_dropping(talk):
    say = talk()
    say("drop x >")
    assert say.session.text == OPEN
    say("undo")
    say("at 3")
    said = say("drop Crank.angle")  # from here on; it must not fall back to 90*.t
    assert "1 warning" in said
    assert "Crank.angle = _;" in say.session.text
    assert say("show Crank.angle") == "Crank.angle = 180"
    assert say.refuses("drop Rod.Q") == "repl/key"


def test_windows_line_ends_stay(tmp_path):
    path = tmp_path / "dos.mov"
    path.write_bytes(SLIDER.replace("\n", "\r\n").encode())
    session = opened(str(path), Choices())
    session, _ = answer(session, "Crank.opacity = 1")
    session, _ = answer(session, f"write {path}")
    data = path.read_bytes()
    assert b"\r\n   Crank.opacity = 1;\r\n@2" in data
    assert data.count(b"\n") == data.count(b"\r\n")


@pytest.mark.slow
def test_conflicts_are_named_and_earlier_times_still_work(talk):
    say = talk(SLIDER.replace("Crank.angle = 180;", "Crank.angle = 180; Rod.B = [300,100];"))
    assert "constraint/conflict" in say("conflicts")
    assert say("show Crank.angle") == "Crank.angle = 0"
    assert "no solution here" in say("at 3")
    say("drop Rod.B")
    assert "no solution" not in say("at 3")


def test_it_opens_on_what_is_broken(talk):
    say = talk(SLIDER.replace("Rod.A=", "Rod.Q="))
    assert say.refuses("show Crank") == "name/unknown-anchor"
    assert "name/unknown-anchor" in say("check")
    say = talk("Rod : .bar A=[0,0")
    assert say.refuses("at 0").startswith("syntax/")
    assert say.refuses("x = 3").startswith("syntax/")


def test_what_is_mistyped_is_shown_where_it_was_typed(talk):
    say = talk()
    with pytest.raises(MovimentumError) as caught:
        say("Rod.Q = [1,2]")
    (told,) = caught.value.diagnostics
    assert caught.value.source.text[told.span.start : told.span.end] == "Q"
    assert say.session.text == SLIDER


@pytest.mark.parametrize(
    "line",
    [
        "",
        "help",
        "help at",
        "why?",
        "foo",
        "apply 3",
        "at",
        "write /nowhere/x.mov",
        "x x",
        "; ;",
        "show '",
        "plot x -o a.txt",
        "picture a.gif",
        "0/0 = 1",
        "x = 1/0",
    ],
)
def test_nothing_typed_ends_the_session(talk, line, capsys):
    say = talk()
    session, _ = step(say.session, line)
    assert not session.ended
    assert "Traceback" not in capsys.readouterr().out


def test_plots_and_pictures(talk, tmp_path):
    say = talk()
    assert say("plot x").splitlines()[1].startswith("260 |")
    say(f"plot Rod.B -o {tmp_path / 'a.svg'}")
    assert (tmp_path / "a.svg").read_text().startswith("<svg")
    say("at 1")
    say(f"picture {tmp_path / 'a.png'}")
    with Image.open(tmp_path / "a.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape == (300, 300, 3)
    assert np.abs(pixels[300 - 120, 100] - pixels[5, 5]).max() > 50  # the crank stands upright


def test_suggestions_of_check_can_be_applied(talk):
    text = OPEN.replace("90*.t", "90*.t + 20").replace("angle = 180", "angle = 200")
    say = talk(text)
    assert "= help: apply 1: `Rod.A.x < Rod.B.x;` selects the one chosen" in say("check")
    assert say("apply 1").endswith("now everything is determined and agrees")
    say("undo")
    assert say.session.text == text


def test_every_command_says_what_it_takes(talk):
    say = talk()
    for name in COMMANDS:
        assert say(f"{name}?").splitlines()[0].startswith(name)


def test_commands_are_parted_outside_of_quotes():
    assert split("at 1; show .t ;; L = 'a;b'") == ["at 1", " show .t ", " L = 'a;b'"]


def test_completion(talk):
    from movimentum.repl.prompt import SessionCompleter

    say = talk()
    completer = SessionCompleter(lambda: say.session, list(COMMANDS))

    def offered(text):
        return [c.text for c in completer.get_completions(Document(text), CompleteEvent())]

    assert offered("so") == ["solutions"]
    assert offered("show Rod.") == ["Rod.A", "Rod.B", "Rod.angle"]
    assert offered("drop Cr") == ["Crank.O", "Crank.angle"]


def test_the_command_line(tmp_path):
    path = tmp_path / "scene.mov"
    path.write_text(SLIDER)
    done = movimentum("repl", path, "-c", "at 1; show .t; quit; foo")
    assert (done.returncode, done.stdout.splitlines()[-1], done.stderr) == (0, ".t = 1", "")
    done = movimentum("repl", path, "-c", "at 1\nshow .t", "-c", "show .t")
    assert (done.returncode, done.stdout.splitlines()[2:]) == (0, ["> show .t", ".t = 1", "> show .t", ".t = 1"])
    done = movimentum("repl", path, stdin="at 1\nfoo\nshow .t\n")
    assert done.returncode == 1
    assert done.stdout.splitlines()[-1] == ".t = 1"


def test_motion_of_edited_text_is_that_of_the_script(talk):
    say = talk()
    say("Crank.angle = 30*.t")
    motion = motion_of(say.session.text)
    assert (motion.poses(0, 5).origin == say.session.work.motion.poses(0, 5).origin).all()


@pytest.mark.slow
def test_the_session_in_the_documentation(tmp_path, monkeypatch):
    page = (Path(__file__).parents[2] / "docs" / "reference" / "debugger.md").read_text()
    script, session = re.findall(r"```(?:mov|text)\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("crank.mov").write_text(script)
    state = opened("crank.mov", Choices())
    for exchange in re.split(r"^> ", session, flags=re.MULTILINE)[1:]:
        line, _, expected = exchange.partition("\n")
        state, text = answer(state, line)
        assert text.strip() == expected.strip(), line


CONTRADICTORY = """.config(20, 360, 200);
B1 : .bar  C = [100,100]   P = C + [80,0];
B2 : .bar  A = [0,0]      B = A + [80,0];
@0   B1.C = [100,100];     B2.A = B1.P;  B2.B = [400,100];
@2
"""


@pytest.mark.slow
def test_a_drawing_is_not_shown_as_a_pose(talk):
    say = talk(CONTRADICTORY)
    assert say("show B2.B").splitlines() == ["there is no pose at t = 0; as drawn:", "B2.B = [80, 0]"]
    assert say("show").startswith("there is no pose at t = 0; as drawn:\n")
    assert "as drawn" in say("at 1")
    message = say("conflicts")
    amounts = {line.split()[0] for line in say("residuals").splitlines()[2:]}
    assert amounts == set(re.findall(r"off by ([\d.]+) where", message)) == {"140"}
    for line in ("formula B1.P", "free", "solutions"):
        assert say.refuses(line) == "repl/no-solution"


def test_after_a_bind_the_last_pose_is_shown(talk):
    say = talk(BINDS)
    say("at 0.7")
    assert say("show Rod.B").splitlines() == [
        "there is no pose at t = 0.7; the last one, of t = 0.525:",
        "Rod.B = [51, 40]",
    ]
