"""Whatever a file of formulas holds, importing it ends in a script that can be checked, or in a message with a code."""

from __future__ import annotations

import random
import re

import pytest

from movimentum.diagnostics import render_text
from movimentum.errors import ScriptError
from movimentum.interop.formula_script import formula_script
from movimentum.interop.formulas import read_formulas
from movimentum.interop.recognised import FileKind, kind_of
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, understand
from tests.families.triangle_chains import chain

BITS = [
    *("1e308", "-1e300", "nan", "inf", "0", "-0.0", "1e-320", "1_0", "1e-9", "-5"),
    *(
        "[",
        "]",
        "(",
        ")",
        ",",
        "#",
        "#[",
        "#]",
        ";",
        "=",
        "T",
        "F",
        "true",
        "null",
        "{}",
        "[]",
        "[[]]",
        "[1]",
        "[1,2,3]",
    ),
    *("[[1,2],[3,4]]", "P0", "O0", "O1", "L0", "a0", "PLAP", "PLLP", "PLA[", "angle", "x", "_", "__"),
    *("fps = 0", "fps = [1,2]", "fps=1e-7", "\ufeff", "\0", "é", "٣", "\r", "\n", "\x85", "\u2028", "'"),
]


def torn(choose: random.Random) -> str:
    """A file of formulas with a few places changed: words, numbers and names exchanged for others."""
    text = chain(choose.randrange(400)).text(choose)
    for _ in range(choose.choice([1, 1, 1, 2, 3])):
        match choose.randrange(6):
            case 0:
                text = text[: choose.randrange(len(text) + 1)]
            case 1:
                words = re.split(r"([\s,\[\]();=])", text)
                words[choose.randrange(len(words))] = choose.choice(BITS)
                text = "".join(words)
            case 2:
                place = choose.randrange(len(text) + 1)
                text = text[:place] + choose.choice(BITS) + text[place:]
            case 3:
                text = re.sub(r"\d+(\.\d+)?", lambda m: choose.choice([*[m[0]] * 6, "0", "-5", "3e5", "1e-300"]), text)
            case _:
                names = re.findall(r"[A-Za-z_]\w*", text) or ["P0"]
                text = text.replace(choose.choice(names), choose.choice(names))
    return text


def survives(seed: int) -> bool:
    """Whether a torn file could be imported; what it became is checked."""
    source = SourceText("torn.txt", torn(random.Random(seed)))
    try:
        if kind_of(source) is not FileKind.FORMULAS:
            return False
        script, found = formula_script(read_formulas(source), "torn.txt")
    except ScriptError as error:
        told = render_text(error.diagnostics, source)
        assert re.search(r"^error\[(formula|import)/[a-z]+\]", told, re.MULTILINE), told
        return False
    assert re.search(r"(?<![\w.])(nan|inf)\b(?!\.)", re.sub(r"//.*", "", script)) is None
    assert all(item.code == "formula/unreachable" for item in found)
    scene = understand(SourceText("imported.mov", script))
    assert examined(arranged(scene, Choices()), Choices()).fault in (0, 1, 3)
    return True


@pytest.mark.slow
def test_torn_formulas_are_refused_or_can_be_checked() -> None:
    assert sum(survives(seed) for seed in range(150)) >= 10


@pytest.mark.slow
def test_many_torn_formulas_are_refused_or_can_be_checked() -> None:
    assert sum(survives(seed) for seed in range(10_000, 12_000)) >= 150
