"""Options as text: what is accepted, and what it means."""

from __future__ import annotations

from fractions import Fraction

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from movimentum.cli.common import anchor, frames, number, positive, words_of
from tests.command import movimentum


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12", Fraction(12)),
        ("2.5", Fraction(5, 2)),
        (".5", Fraction(1, 2)),
        ("3.", Fraction(3)),
        ("24000/1001", Fraction(24000, 1001)),
        ("-1/3", Fraction(-1, 3)),
        ("0.1", Fraction(1, 10)),
    ],
)
def test_numbers_are_kept_exactly(text: str, value: Fraction) -> None:
    assert number(text) == value


@pytest.mark.parametrize("text", ["", "x", "1/0", "1e999999999", "1e3", "nan", "inf", "1//2", "1/2/3", "--1", "9" * 40])
def test_other_texts_are_refused_as_numbers(text: str) -> None:
    with pytest.raises(click.BadParameter):
        number(text)


@pytest.mark.parametrize("text", ["0", "-5", "0/7"])
def test_a_rate_is_positive(text: str) -> None:
    with pytest.raises(click.BadParameter):
        positive(text)


bound = st.none() | st.integers(-30, 30)


@given(start=bound, stop=bound, count=st.integers(1, 20))
def test_ranges_count_as_python_slices(start: int | None, stop: int | None, count: int) -> None:
    text = f"{'' if start is None else start}:{'' if stop is None else stop}"
    first, end = frames(text)(count)
    assert list(range(first, end)) == list(range(count))[start:stop]


@given(frame=st.integers(-30, 30), count=st.integers(1, 20))
def test_one_number_is_that_frame(frame: int, count: int) -> None:
    first, end = frames(str(frame))(count)
    inside = -count <= frame < count
    assert list(range(first, end)) == ([range(count)[frame]] if inside else [])


@pytest.mark.parametrize("text", ["", "a:b", "1:2:3", "1-2", "1.5:2", "1 2", "9" * 20])
def test_other_texts_are_refused_as_ranges(text: str) -> None:
    with pytest.raises(click.BadParameter):
        frames(text)


def test_words_come_in_any_order_and_once() -> None:
    words = words_of("names", "free", "anchors")
    assert words("free, names,free") == {"names", "free"}
    with pytest.raises(click.BadParameter, match="'name' is not one of"):
        words("name")


def test_a_trace_names_a_thing_and_an_anchor() -> None:
    assert anchor(" Rod.B") == "Rod.B"
    for text in ("Rod", "Rod.", ".B", "1.B"):
        with pytest.raises(click.BadParameter):
            anchor(text)


@pytest.mark.parametrize(("limit", "code"), [("100", 1), ("300", 0)])
def test_the_limit_of_nesting_can_be_raised(tmp_path, limit, code):
    script = tmp_path / "deep.mov"
    script.write_text(f"Dot : .disc(2) c=[0,0]; @0 Dot.c = [{'(' * 150}1{')' * 150}, 0];")
    done = movimentum("check", script, "--max-nesting", limit)
    assert done.returncode == code
    assert ("limit/nesting" in done.stdout + done.stderr) == (code == 1)
    assert code == 0 or "--max-nesting 300" in done.stdout + done.stderr
