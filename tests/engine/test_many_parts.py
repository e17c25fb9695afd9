"""Scripts of many parts: an edit is answered as from nothing, and what it does not touch costs nothing more."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from movimentum.source import SourceText
from movimentum.workflow.engine import Engine
from tests.broad import broad
from tests.engine.families import bars, chain, copies, dyads, four_bars
from tests.engine.test_engine import _counting, _same_as_fresh  # pyright: ignore[reportPrivateUsage]

FAMILIES: dict[str, Callable[[int], str]] = {
    "bars": bars,
    "chain": chain,
    "dyads": dyads,
    "four-bars": four_bars,
    "copies": copies,
}


@broad(
    ("name", "seed"),
    [(name, seed) for name in FAMILIES for seed in range(3)],
    every=4,
)
def test_many_parts_are_answered_as_from_nothing(name: str, seed: int) -> None:
    _same_as_fresh(Path(f"{name}.mov"), FAMILIES[name](3), seed, 5)


def _blocks_solved(text: str, monkeypatch: pytest.MonkeyPatch) -> int:
    with monkeypatch.context() as patch:
        solved = _counting(patch, "movimentum.solver.kinds.kernels", "begin")
        motion = Engine().revise(SourceText("x.mov", text)).motion
        assert any(segment.failures for segment in motion.segments)
    return solved["begin"]


def test_where_one_linkage_cannot_close_the_others_are_not_searched_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first solution is looked for at 64 times: only in what has none."""
    few, many = (_blocks_solved(four_bars(count, 200.0), monkeypatch) for count in (2, 6))
    assert few > 64
    assert many < few + 4 * 40  # four linkages more, each of ten blocks, tried some few times


def test_an_edit_of_one_part_makes_one_run_of_blocks_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    written = _counting(monkeypatch, "movimentum.planning.blocks.fused_runs", "_function")
    engine = Engine()
    text = bars(60)
    engine.revise(SourceText("x.mov", text)).motion.poses(0, 5)
    first = written["_function"]
    written.clear()
    engine.revise(SourceText("x.mov", text.replace("B30.angle = 90", "B30.angle = 91"))).motion.poses(0, 5)
    assert first > 3
    assert written["_function"] <= 2
