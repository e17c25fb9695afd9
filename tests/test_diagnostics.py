"""Diagnostics as text and as JSON, and the positions they are at."""

from __future__ import annotations

import json
import re

from hypothesis import given
from hypothesis import strategies as st

from movimentum.diagnostics import Diagnostic, Label, Severity, render_text, to_json
from movimentum.source import SourceText, Span

SCRIPT = SourceText(
    "slider.mov", "// a crank\ncrank : .bar  O = [0,0]  P = O + [40,0];\n\n\n\n  crank.P = crank.O + [45,0].r(90*.t);\n"
)


def place(text: str, source: SourceText = SCRIPT, after: int = 0) -> Span:
    start = source.text.index(text, after)
    return Span(start, start + len(text))


CONFLICT = Diagnostic(
    "constraint/conflict",
    Severity.ERROR,
    "2 constraints contradict each other in step @0",
    place("crank.P = crank.O + [45,0].r(90*.t)"),
    "needs |crank.P - crank.O| = 45.00",
    (Label(place("O = [0,0]  P = O + [40,0]"), "rigid: |crank.P - crank.O| = 40.00"),),
    ("smallest conflicting set; 3 other constraints not involved",),
    ("use `[40,0]` on line 6, or `P = O + [45,0]` on line 2",),
)


def test_the_picture_in_the_architecture_page() -> None:
    assert render_text([CONFLICT], SCRIPT) == (
        "error[constraint/conflict]: 2 constraints contradict each other in step @0\n"
        "  --> slider.mov:6:3\n"
        "   |\n"
        " 2 | crank : .bar  O = [0,0]  P = O + [40,0];\n"
        "   |               ------------------------- rigid: |crank.P - crank.O| = 40.00\n"
        " 6 |   crank.P = crank.O + [45,0].r(90*.t);\n"
        "   |   ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ needs |crank.P - crank.O| = 45.00\n"
        "   = note: smallest conflicting set; 3 other constraints not involved\n"
        "   = help: use `[40,0]` on line 6, or `P = O + [45,0]` on line 2\n"
    )


def test_colour_only_when_asked_and_nothing_else_changes() -> None:
    plain = render_text([CONFLICT], SCRIPT)
    colored = render_text([CONFLICT], SCRIPT, color=True)
    assert "\x1b" not in plain
    assert "\x1b[1;31m" in colored
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == plain


def test_json() -> None:
    (item,) = json.loads(json.dumps(to_json([CONFLICT], SCRIPT)))
    assert (item["code"], item["severity"], item["file"]) == ("constraint/conflict", "error", "slider.mov")
    assert (item["line"], item["column"], item["end_line"], item["end_column"]) == (6, 3, 6, 38)
    assert set(item) == {
        "code", "severity", "message", "file", "line", "column", "end_line", "end_column", "labels", "notes", "helps",
    }  # fmt: skip
    own, label = item["labels"]
    assert (own["line"], own["column"], own["message"]) == (6, 3, "needs |crank.P - crank.O| = 45.00")
    assert (label["line"], label["column"], label["message"]) == (2, 15, "rigid: |crank.P - crank.O| = 40.00")
    assert item["notes"] == list(CONFLICT.notes)
    assert item["helps"] == list(CONFLICT.helps)
    (whole,) = to_json([Diagnostic("timeline/no-step", Severity.ERROR, "no step")], SCRIPT)
    assert whole["line"] is None


def rows(text: str, *marks: tuple[str, str]) -> list[str]:
    """The rows below the source line; the first mark is the primary one."""
    source = SourceText("x", text)
    (first, said), *others = marks
    labels = tuple(Label(place(what, source), message) for what, message in others)
    shown = render_text([Diagnostic("a/b", Severity.WARNING, "m", place(first, source), said, labels)], source)
    return [line[5:] for line in shown.splitlines()[3:]]


def test_labels_on_one_line_share_a_row_if_they_can() -> None:
    assert rows("aa bb cc", ("bb", "two"), ("aa", "one"), ("cc", "three")) == [
        "aa bb cc",
        "-- ^^ -- three",
        "   two",
        "one",
    ]
    assert rows("aabb", ("aabb", "all"), ("bb", "half")) == ["aabb", "^^^^ all", "  -- half"]
    assert rows("aa bb", ("bb", ""), ("aa", "")) == ["aa bb", "-- ^^"]


def test_tabs_and_wide_characters_are_underlined_where_they_are_seen() -> None:
    assert rows("\tab\tc", ("c", "here")) == ["    ab  c", "        ^ here"]
    assert rows("日本 x", ("x", "here")) == ["日本 x", "     ^ here"]
    assert rows("日本 x", ("本", "")) == ["日本 x", "  ^^"]
    assert rows("e\u0301 x", ("x", "")) == ["e\u0301 x", "  ^"]
    assert rows("a\x00b", ("b", "")) == ["a\ufffdb", "  ^"]


def test_long_lines_are_shown_in_part() -> None:
    shown = rows("a" * 5000 + "!" + "b" * 5000, ("!", "here"))
    assert all(len(row) < 200 for row in shown)
    assert shown[0].index("!") == shown[1].index("^")


def test_several_lines_and_the_end_of_the_text() -> None:
    source = SourceText("x", "one\ntwo\nthree")
    shown = render_text([Diagnostic("a/b", Severity.NOTE, "m", Span(1, 9), "from here")], source)
    assert " 1 | one\n   |  ^^ from here\n" in shown
    shown = render_text([Diagnostic("a/b", Severity.NOTE, "m", Span(13, 13), "end")], source)
    assert " 3 | three\n   |      ^ end\n" in shown


def test_several_diagnostics_have_a_blank_line_between_them() -> None:
    item = Diagnostic("a/b", Severity.NOTE, "m")
    assert render_text([item, item], SCRIPT).count("\n\n") == 1
    assert render_text([], SCRIPT) == ""


@given(st.text(alphabet="ab\n\r\t日", max_size=40), st.integers(0, 45), st.integers(0, 45), st.booleans())
def test_any_span_of_any_text(text: str, start: int, end: int, color: bool) -> None:
    source = SourceText("x", text)
    span = Span(min(start, end), max(start, end))
    item = Diagnostic("a/b", Severity.ERROR, "m", span, "l", (Label(Span(0, 1), "k"),))
    assert render_text([item], source, color=color).endswith("\n")
    (data,) = to_json([item], source)
    assert data["line"] <= len(re.split(r"\r\n|\r|\n", text))


@given(st.text(alphabet="ab\n\r", max_size=30))
def test_lines_are_those_of_the_text(text: str) -> None:
    source = SourceText("x", text)
    lines = re.split(r"\r\n|\r|\n", text)
    assert [source.line(number + 1) for number in range(len(lines))] == lines
    for number in range(len(lines)):
        assert source.position(source.line_start(number + 1)) == (number + 1, 1)
