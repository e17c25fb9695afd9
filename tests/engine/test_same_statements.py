"""Texts that state the same."""

from __future__ import annotations

import time

from movimentum.source import SourceText
from movimentum.workflow.same_statements import items_of


def test_comments_behind_the_last_statement_cost_nothing() -> None:
    text = "A : .disc(3) O = [1, 2];\n@0\n@2\n" + "".join(f"// line {n}\n" for n in range(2000))
    begun = time.monotonic()
    items = items_of(SourceText("x.mov", text))
    assert time.monotonic() - begun < 1.0
    assert len(items.texts) == 2
