"""Whatever a file holds, importing it ends in a script that can be checked, or in a message with a place."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from movimentum.diagnostics import render_text
from movimentum.errors import ScriptError, UsageError
from movimentum.interop.linkage_export import linkage_of
from movimentum.interop.linkages import Linkage, linkage_script, read_linkage
from movimentum.interop.mechanisms import mechanism_script, read_mechanism
from movimentum.interop.snapping import snapped
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, moved, understand
from tests.broad import broad
from tests.command import ROOT, movimentum

LINKAGE = "v\n0 0\n10 0\n10 10\n0 10\n4 5.5\nf\n0\n1\ne\n0 1\n1 2\n2 3\n3 0\n2 4\na\n0 1 3\n2 1 4\n"
MECHANISM = """# a comment
M[J[R, color[Green], P[0.0, 0.0], L[ground, link_1]], J[R, color[(1,2,3)], P[12.92, 32.53], L[link_1, link_2]],
  J[RP, A[30], P[60,0], L[ground, link_2]], #[ another #]
  J[P, A[0.5], P[5,5], L[link_2, c]], J[RP, A[90], P[1,2], L[c, ground]], J[R, P[33.3, 66.95], L[link_2]]]
"""
BITS = [
    *("1e308", "-1e300", "1e149", "nan", "inf", "999999999999999999999", "0", "-0.0", "1e-320", "1_0", "0x10", "1e400"),
    *("v", "e", "f", "a", "M", "J", "R", "P", "RP", "A", "L", "ground", "color", "[", "]", "(", ")", ",", "#", "#["),
    *("\ufeff", "\0", "é", "𝟙", "٣", "\r", "\r\n", "\n", "\x85", "\u2028", "'", '"', ";", "//", "/*", "*/", "@0", "\\"),
]


def torn(choose: random.Random) -> str:
    """One of the files, maimed."""
    text = choose.choice([LINKAGE, MECHANISM])
    match choose.randrange(7):
        case 0:
            return text[: choose.randrange(len(text) + 1)]
        case 1:
            lines = text.split("\n")
            choose.shuffle(lines)
            return "\n".join(lines)
        case 2:
            return "".join(chr(choose.randrange(choose.choice([128, 0x3000]))) for _ in range(choose.randrange(300)))
        case 3:
            words = re.split(r"([\s,\[\]])", text)
            for _ in range(choose.randint(1, 4)):
                words[choose.randrange(len(words))] = choose.choice(BITS)
            return "".join(words)
        case 4:
            place = choose.randrange(len(text))
            return text[:place] + choose.choice(BITS) + text[place:]
        case 5:
            numbers = ["0", "-5", "3e5", "1e30", "1e-300"]
            return re.sub(r"\d+(\.\d+)?", lambda m: choose.choice([m[0], m[0], m[0], choose.choice(numbers)]), text)
        case _:
            return random_linkage(choose)


def random_linkage(choose: random.Random) -> str:
    """A linkage with points that coincide, are in line, tiny or far apart."""
    count = choose.randint(2, 6)
    place = [0, 1, 2, 3, 7, 10, 10, 1e-9, 1e9]
    some = [*(f"{choose.choice(place)} {choose.choice(place)}" for _ in range(count)), "e"]
    some += [f"{choose.randrange(count)} {choose.randrange(count)}" for _ in range(choose.randint(1, 8))]
    some += ["f", *(str(choose.randrange(count)) for _ in range(choose.randrange(3)))]
    some += ["a", *(" ".join(str(choose.randrange(count)) for _ in "ijk") for _ in range(choose.randrange(3)))]
    return "v\n" + "\n".join(some) + "\n"


def script_of(text: str, choose: random.Random) -> str | None:
    """What importing makes of a text; None where it is refused in good order."""
    source = SourceText("torn.txt", text)
    try:
        if "M" in text[: text.find("[") + 1]:
            drives = [(choose.randrange(5), choose.randrange(5))] if choose.random() < 0.5 else []
            return mechanism_script(read_mechanism(source), drives, "torn.txt")
        linkage, found = read_linkage(source)
        assert render_text(found, source) or not found
        if choose.random() < 0.4:
            linkage = snapped(linkage).linkage
        return linkage_script(linkage, "torn.txt")
    except (ScriptError, UsageError) as error:
        refusal = render_text(error.diagnostics, source)
    assert refusal
    return None


def assert_checkable(script: str) -> None:
    assert re.search(r"(?<![\w.])(nan|inf)\b", script.split("\n\n", 1)[1]) is None
    scene = understand(SourceText("imported.mov", script))
    assert examined(arranged(scene, Choices()), Choices()).fault in (0, 1, 3)


@broad("seed", range(10), fast=(2, 3))
def test_what_is_torn_is_refused_or_can_be_checked(seed: int) -> None:
    made = 0
    for k in range(10):
        choose = random.Random(f"{seed} {k}")
        script = script_of(torn(choose), choose)
        if script is not None:
            made += 1
            assert_checkable(script)
    assert made


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1000, 1020))
def test_much_that_is_torn_is_refused_or_can_be_checked(seed: int) -> None:
    for k in range(20):
        choose = random.Random(f"{seed} {k}")
        script = script_of(torn(choose), choose)
        if script is not None:
            assert_checkable(script)


def test_ten_thousand_lines_of_junk_are_told_as_far_as_one_can_read() -> None:
    choose = random.Random(4)
    junk = "\n".join(" ".join(choose.choice(["x", "?", "1", "q2"]) for _ in range(4)) for _ in range(10_000))
    source = SourceText("junk.txt", f"{LINKAGE}{junk}\n")
    linkage, found = read_linkage(source)
    assert len(linkage.rods) == 5
    assert len(found) == 201
    assert (found[-1].code, found[-1].severity.value) == ("limit/messages", "note")
    assert "and 9,800 more" in found[-1].message
    with pytest.raises(ScriptError):
        read_mechanism(SourceText("junk.txt", f"M[{junk}"))


def test_link_names_of_any_script_become_names() -> None:
    text = "M[J[R, P[0, 0], L[ground, l_٣]], J[R, P[10, 20], L[l_٣, link_4, b-ä]], J[R, P[6, 0], L[link_4, ground]]]"
    script = mechanism_script(read_mechanism(SourceText("names.txt", text)), [], "names.txt")
    names = {thing.name for thing in understand(SourceText("names.mov", script)).things}
    assert len(names) == 3
    assert all(name.isascii() for name in names)


@pytest.mark.parametrize("line", ["1_0 20", "٣ 4", "0x1 2", "1,5 2", "1d3 2"])
def test_a_number_is_written_in_plain_digits(line: str) -> None:
    linkage, found = read_linkage(SourceText("numbers.txt", f"v\n0 0\n{line}\n"))
    assert linkage.vertices == ((0, 0),)
    assert [item.code for item in found] == ["import/line"]


@pytest.mark.parametrize("end", ["\r\n", "\r", "\n\n", " \t\n"])
def test_lines_may_end_as_on_any_system(end: str) -> None:
    plain, found = read_linkage(SourceText("linkage.txt", LINKAGE))
    assert read_linkage(SourceText("linkage.txt", LINKAGE.replace("\n", end))) == (plain, found)
    joints = read_mechanism(SourceText("mechanism.txt", MECHANISM))
    other = read_mechanism(SourceText("mechanism.txt", MECHANISM.replace("\n", "\n" if end == "\r" else end)))
    assert other == joints


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", 1),
        (b"\xef\xbb\xbf" + LINKAGE.encode(), 0),
        (LINKAGE.replace("\n", "\r\n").encode(), 0),
        (b"\xef\xbb\xbf" + MECHANISM.replace("\n", "\r\n").encode(), 0),
        (bytes(range(256)), 1),
        (b"v\n1e999 1e999\n1 2\n", 0),
        (b"M[", 1),
        (b"M[]", 1),
        (b"v\n" * 5000, 1),
        (("?" * 80 + "\n").encode() * 10_000, 1),
    ],
    ids=["empty", "BOM", "CRLF", "BOM and CRLF", "bytes", "huge", "truncated", "no joint", "no vertex", "junk"],
)
def test_the_command_line_says_what_it_makes_of_it(data: bytes, code: int, tmp_path: Path) -> None:
    source, script = tmp_path / "file.txt", tmp_path / "script.mov"
    source.write_bytes(data)
    done = movimentum("import", source, "-o", script)
    assert done.returncode == code, done.stderr
    assert script.exists() == (code == 0)
    assert len(done.stderr) < 100_000
    if code:
        assert re.search(r"^error\[[a-z]+/[a-z-]+\]", done.stderr, re.MULTILINE)
    else:
        assert movimentum("check", script).returncode in (0, 1, 3)


# --- export ---------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("form", ["linkages", "pyslvs"])
@pytest.mark.parametrize("script", sorted((ROOT / "scripts").glob("*.mov")), ids=lambda path: path.stem)
def test_every_script_is_exported_or_refused_with_a_code(script: Path, form: str, tmp_path: Path) -> None:
    target = tmp_path / "out.txt"
    done = movimentum("export", script, "--format", form, "-o", target)
    assert done.returncode in (0, 1)
    assert target.exists() == (done.returncode == 0)
    if done.returncode:
        assert re.search(r"^error\[export/[a-z-]+\]: .{1,300}$", done.stderr, re.MULTILINE), done.stderr
        return
    text = target.read_text()
    assert re.search(r"\b(nan|inf)\b", text) is None
    if form == "linkages":
        linkage, found = read_linkage(SourceText("out.txt", text))
        assert found == ()
        assert linkage.rods


def exported(linkage: Linkage) -> tuple[Linkage, list[int]]:
    """A linkage imported and exported, and the number that each of its vertices has got."""
    motion = moved(arranged(understand(SourceText("test.mov", linkage_script(linkage, "test"))), Choices()))
    back, names, left_out = linkage_of(motion.timeline.scene, motion.timeline.segments[0].active, motion.poses(0, 1))
    assert left_out == ()
    number = {int(name.split(".V")[-1]): k for k, name in enumerate(names)}
    return back, [number[k] for k in range(len(linkage.vertices))]


@pytest.mark.parametrize("seed", range(12))
def test_there_and_back_is_the_same_linkage_up_to_numbers(seed: int) -> None:
    choose = random.Random(seed)
    count = choose.randint(3, 8)
    points = [f"{choose.uniform(-90, 200)} {choose.uniform(-5, 300)}" for _ in range(count)]
    rods = [f"{choose.randrange(n)} {n}" for n in range(1, count)]
    corners = [choose.sample(range(count), 3) for _ in range(choose.randrange(3))]
    fixed = choose.sample(range(count), choose.randint(1, 2))
    text = "\n".join(["v", *points, "e", *rods, "f", *map(str, fixed), "a", *(f"{i} {j} {k}" for i, j, k in corners)])
    linkage, _ = read_linkage(SourceText("random.txt", text))
    back, number = exported(linkage)
    assert sorted(number) == list(range(count))
    for n, (x, y) in enumerate(linkage.vertices):
        assert back.vertices[number[n]] == pytest.approx((x, y), abs=1e-9)
    assert {frozenset(rod) for rod in back.rods} == {frozenset(number[n] for n in rod) for rod in linkage.rods}
    assert set(back.fixed) == {number[n] for n in linkage.fixed}
    assert [sorted((i, frozenset((j, k))) for i, j, k in back.angles)] == [
        sorted((number[i], frozenset((number[j], number[k]))) for i, j, k in linkage.angles)
    ]
