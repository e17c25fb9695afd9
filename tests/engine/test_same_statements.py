"""Texts that state the same."""

from __future__ import annotations

from movimentum.source import SourceText
from movimentum.workflow.same_statements import Items, items_of
from tests.work import calls


def test_comments_behind_the_last_statement_cost_nothing() -> None:
    text = "A : .disc(3) O = [1, 2];\n@0\n@2\n" + "".join(f"// line {n}\n" for n in range(2000))
    found: list[Items] = []
    assert calls(lambda: found.append(items_of(SourceText("x.mov", text)))) < 3 * 2000
    assert len(found[0].texts) == 2
