"""What is kept, and for how long."""

from __future__ import annotations

import pytest

from movimentum.cancellation import Cancelled, cancellable, look
from movimentum.memo import Memo
from movimentum.solver.basis.block_memo import memoized, use_memo
from movimentum.solver.basis.effort import EffortExceeded, charge_effort, limit_effort


def test_what_nobody_asks_for_is_forgotten() -> None:
    memo = Memo(2)
    memo.keep("word", "a", "first")
    memo.keep("word", "b", "second")
    for _ in range(5):
        memo.begin()
        assert memo.get("word", "a") == "first"
    assert memo.get("word", "b") is None
    assert (len(memo), memo.made["word"]) == (1, 2)


def test_kinds_and_numbers_are_told_apart() -> None:
    memo = Memo(2)
    assert [memo.of("one", 1, lambda: "one"), memo.of("other", 1, lambda: "other")] == ["one", "other"]
    assert memo.of("one", 1, lambda: "never asked") == "one"
    assert memo.number("a") == memo.number("a") != memo.number("b")


def _found(key: object, calls: list[object]) -> str:
    def find() -> str:
        calls.append(key)
        return f"found {key}"

    return memoized(lambda: key, find)


def test_what_is_remembered_is_found_once() -> None:
    calls: list[object] = []
    memory = Memo(4)
    with use_memo(memory):
        assert [_found(key, calls) for key in (1, 2, 1)] == ["found 1", "found 2", "found 1"]
        assert [_found(None, calls) for _ in range(2)] == ["found None"] * 2
    assert calls == [1, 2, None, None]
    _found(1, calls)
    assert calls[-1] == 1  # outside, nothing is looked up


def test_what_is_given_up_does_not_depend_on_what_was_found_before() -> None:
    def dear() -> str:
        charge_effort(10)
        return "dear"

    with use_memo(Memo(4)):
        assert memoized(lambda: "dear", dear) == "dear"
        with pytest.raises(EffortExceeded), limit_effort(5):
            memoized(lambda: "dear", dear)
        with limit_effort(25) as left:
            assert memoized(lambda: "dear", dear) == "dear"
            assert memoized(lambda: "more", lambda: memoized(lambda: "dear", dear)) == "dear"
        assert left == [5]
        with pytest.raises(EffortExceeded), limit_effort(5):
            memoized(lambda: "more", dear)


def test_work_within_other_work_is_given_up_with_it() -> None:
    asked: list[int] = []
    with pytest.raises(Cancelled), cancellable(lambda: len(asked) > 2), cancellable(lambda: False):
        for n in range(9):
            asked.append(n)
            look()
    assert asked == [0, 1, 2]
