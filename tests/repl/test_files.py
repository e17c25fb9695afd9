"""What is written by the debugger: nothing that somebody else has saved is lost."""

import random

import pytest

from movimentum.errors import MovimentumError
from movimentum.output.merging import merged
from movimentum.records import replace
from movimentum.repl.session import opened
from movimentum.repl.shell import answer
from movimentum.workflow.choices import Choices
from tests.command import CRANK, movimentum


@pytest.fixture
def crank(tmp_path):
    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    return path, opened(str(path), Choices())


def refusal(session, line):
    with pytest.raises(MovimentumError) as caught:
        answer(session, line)
    return caught.value.diagnostics[0]


def test_what_an_editor_has_saved_meanwhile_is_kept(crank):
    path, session = crank
    session, _ = answer(session, "y = 5")
    edited = CRANK.replace("90*.t", "80*.t")
    path.write_text(edited)
    said = refusal(session, "write")
    assert (said.code, said.helps[:2]) == ("repl/file-changed", ("write --merge", "write --force"))
    assert path.read_text() == edited
    session, told = answer(session, "write --merge")
    assert told.endswith("with 1 change that the file had")
    assert "80*.t" in path.read_text()
    assert "y = 5;" in path.read_text()
    assert "80*.t" in session.text
    assert answer(session, "diff")[1] == "nothing is changed"
    assert "80*.t" not in answer(session, "undo")[0].text


def test_a_clash_is_never_merged(crank):
    path, session = crank
    session, _ = answer(session, "Crank.angle = 70*.t")
    edited = CRANK.replace("90*.t", "80*.t")
    path.write_text(edited)
    for line in ("write", "write --merge"):
        said = refusal(session, line)
        assert said.code == "repl/file-changed"
        assert ": yours `" in said.message
        assert "80*.t" in said.message
        assert path.read_text() == edited
    answer(session, "write --force")
    assert "70*.t" in path.read_text()


def test_another_file_is_not_overwritten_without_a_word(crank):
    path, session = crank
    other = path.with_name("other.mov")
    other.write_text("precious")
    said = refusal(session, f"write {other}")
    assert said.code == "repl/file-exists"
    assert said.helps == (f"write --force {other}", f"write {other.with_name('other-2.mov')}")
    assert other.read_text() == "precious"
    assert "wrote" in answer(session, said.helps[1])[1]
    answer(session, said.helps[0])
    assert other.read_text() == CRANK


@pytest.mark.parametrize(
    ("reply", "kept"),
    [("m", ("80*.t", "y = 5")), ("o", ("90*.t", "y = 5")), ("", ("80*.t",)), ("n", ("80*.t",)), (None, ("80*.t",))],
)
def test_a_terminal_is_asked(crank, reply, kept):
    path, session = crank
    asked = []
    session = replace(session, ask=lambda question: asked.append(question) or reply)
    session, _ = answer(session, "y = 5")
    path.write_text(CRANK.replace("90*.t", "80*.t"))
    if len(kept) == 1:
        refusal(session, "write")
    else:
        answer(session, "write")
    assert all(part in path.read_text() for part in kept)
    assert ("y = 5" in path.read_text()) == (len(kept) == 2)
    assert "[m]erge" in asked[0]


def test_a_script_of_commands_ends_with_an_error_and_the_file_as_it_was(tmp_path):
    path, other = tmp_path / "crank.mov", tmp_path / "other.mov"
    path.write_bytes(b"\xef\xbb\xbf" + CRANK.encode())
    other.write_text("precious")
    done = movimentum("repl", path, "-c", f"y = 5; write {other}; write", cwd=tmp_path)
    assert done.returncode == 1
    assert "repl/file-exists" in done.stdout
    assert other.read_text() == "precious"
    assert path.read_bytes().startswith(b"\xef\xbb\xbf")  # a mark stays
    assert b"y = 5" in path.read_bytes()


def test_merging_is_symmetric_and_keeps_each_change():
    rng = random.Random(28)
    base = [f"line {k}\n" for k in range(30)]
    for _ in range(200):
        mine, theirs = list(base), list(base)
        ours, others = rng.sample(range(15), 3), rng.sample(range(16, 30), 3)
        for place in sorted(ours, reverse=True):
            mine[place : place + rng.choice([0, 1])] = rng.choice([[], ["mine\n"], ["mine\n", "too\n"]])
        for place in sorted(others, reverse=True):
            theirs[place : place + rng.choice([0, 1])] = rng.choice([[], ["theirs\n"]])
        expected = "".join(mine[: len(mine) - 15] + theirs[15:])
        for a, b in ((mine, theirs), (theirs, mine)):
            found = merged("".join(base), "".join(a), "".join(b))
            assert (found.text, found.clashes) == (expected, ())
    both = merged("a\nb\nc\n", "a\nX\nc\n", "a\nY\nc\n")
    assert [(clash.line, clash.mine, clash.theirs) for clash in both.clashes] == [(2, ("X\n",), ("Y\n",))]
    assert merged("a\nb\n", "a\nX\n", "a\nX\n").clashes == ()
    assert merged("a", "a", "b").text == "b"


def test_everything_of_a_script_can_be_typed(tmp_path):
    path = tmp_path / "crank.mov"
    path.write_text(".let r = 20;\n" + CRANK.replace("[20,0]", "[r,0]"))
    session = opened(str(path), Choices())
    said = refusal(session, "r = 25")
    assert (said.code, said.helps) == ("repl/constant", ("set r 25",))
    session, _ = answer(session, said.helps[0])
    assert session.text.startswith(".let r = 25;\n")
    moved = answer(session, "diff motion")[1]
    assert [row.split()[0] for row in moved.splitlines()][1:] == ["Crank.P", "Rod.A", "Rod.B"]
    assert moved.splitlines()[1].split()[1] == "5"
    for line in (".let q = 3", "Lamp : .disc(3) C=[9,9]", "@1/2 Crank.angle = 45", "// a remark", ".claim x > 3"):
        before = session
        session, said = answer(session, line)
        assert line in session.text
        assert "error" not in said
        assert answer(session, "undo")[0].text == before.text
    lines = session.text.splitlines()
    assert lines.index("@1/2 Crank.angle = 45;") == lines.index("@1") - 1
    number = lines.index("// a remark") + 1
    session, _ = answer(session, f"edit {number} // another")
    assert answer(session, f"list {number}")[1].split("|")[1].strip() == "// another"
    wrong = ["set", "set zz 3", "edit 99 x", "edit x", "list 99", "list x", ".let", "@", ".claim 3", "edit 3"]
    for line in wrong:
        refusal(session, line)
