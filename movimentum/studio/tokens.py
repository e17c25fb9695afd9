"""The words of the language for the page's editor, generated from the terminals of the grammar.

After editing the grammar, this command writes ``web/src/tokens.js`` again (then build the page's script)::

    python -m movimentum.studio.tokens
"""

from __future__ import annotations

import json
from pathlib import Path

TARGET = Path(__file__).resolve().parent / "web" / "src" / "tokens.js"


def tokens_script() -> str:
    """A module of JavaScript: for each terminal its pattern and the kind of its colour, in the order to try them."""
    from movimentum.highlight import textmate

    grammar = json.loads(textmate())
    rows = [
        [item["match"], item["name"].removesuffix(".movimentum")]
        for item in grammar["patterns"]
        if "match" in item
    ]  # fmt: skip
    lines = ",\n".join(f"  {json.dumps(row)}" for row in rows)
    return f"// Written by `python -m movimentum.studio.tokens`.\nexport const TOKENS = [\n{lines},\n];\n"


if __name__ == "__main__":
    TARGET.write_text(tokens_script(), encoding="utf-8", newline="\n")
