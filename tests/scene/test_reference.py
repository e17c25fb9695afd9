"""The reference of the language says every word. (tests/docs tries its examples.)"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs/reference/language").glob("*.md")))


def test_the_words_are_those_of_the_language() -> None:
    from movimentum.syntax.vocabulary import CLOCKS, FUNCTIONS, SYNONYMS, THING_MEMBERS, VECTOR_MEMBERS
    from movimentum.things.registry import KINDS, SHAPES

    options = {rule.name for kind in KINDS.values() for rule in kind.options}
    for word in (*FUNCTIONS, *SYNONYMS, *options):
        assert re.search(rf"`\.{word}[(`]", PAGE), word
    for word in (*CLOCKS, *SHAPES):
        assert f".{word}" in PAGE
    for word in VECTOR_MEMBERS:
        assert f"`v.{word}`" in PAGE
    for word in THING_MEMBERS:
        assert f"`Thing.{word}`" in PAGE
