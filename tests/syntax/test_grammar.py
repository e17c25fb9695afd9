"""The parser is kept between runs where that is possible, and works where it is not."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from movimentum.syntax.grammar import cache_folder, grammar_text

ROOT = Path(__file__).parents[2]
PROGRAM = (
    "from movimentum.syntax.parser import parse\n"
    "from movimentum.source import SourceText\n"
    "print(len(parse(SourceText('x', '@0 x = 1; y = 2;')).items))\n"
)


def parse_elsewhere(**environment: str) -> None:
    """Parse in a process of its own."""
    kept = {key: value for key, value in os.environ.items() if key not in ("XDG_CACHE_HOME", "MOVIMENTUM_CACHE")}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PROGRAM],
        env={**kept, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "3\n", "")


def test_kept_and_read_back(tmp_path: Path) -> None:
    parse_elsewhere(XDG_CACHE_HOME=str(tmp_path))
    (kept,) = (tmp_path / "movimentum").iterdir()
    before = kept.read_bytes()
    parse_elsewhere(XDG_CACHE_HOME=str(tmp_path))
    assert [path.read_bytes() for path in (tmp_path / "movimentum").iterdir()] == [before]


def test_a_damaged_file_is_replaced(tmp_path: Path) -> None:
    parse_elsewhere(XDG_CACHE_HOME=str(tmp_path))
    (kept,) = (tmp_path / "movimentum").iterdir()
    good = kept.read_bytes()
    for damage in (b"", b"junk", good[: len(good) // 2], pickle.dumps({"data": 1, "memo": 2})):
        kept.write_bytes(damage)
        parse_elsewhere(XDG_CACHE_HOME=str(tmp_path))
        assert kept.read_bytes().startswith(good[:2])
        assert len(kept.read_bytes()) > len(good) // 2 + 100


def test_no_place_to_keep_it(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    parse_elsewhere(XDG_CACHE_HOME=str(tmp_path / "file"))
    parse_elsewhere(XDG_CACHE_HOME="/proc/nowhere")
    parse_elsewhere(HOME="/nonexistent")
    parse_elsewhere(MOVIMENTUM_CACHE="off", XDG_CACHE_HOME=str(tmp_path / "unused"))
    assert not (tmp_path / "unused").exists()


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes of POSIX")
def test_a_file_that_others_can_write_is_not_trusted(tmp_path: Path) -> None:
    parse_elsewhere(XDG_CACHE_HOME=str(tmp_path))
    (kept,) = (tmp_path / "movimentum").iterdir()
    kept.write_bytes(b"cos\nsystem\n(S'echo this must not run'\ntR.")
    kept.chmod(0o666)
    parse_elsewhere(XDG_CACHE_HOME=str(tmp_path))


def test_the_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MOVIMENTUM_CACHE", "off")
    assert cache_folder() is None
    monkeypatch.setenv("MOVIMENTUM_CACHE", str(tmp_path))
    assert cache_folder() == tmp_path


def test_the_grammar_is_one_file() -> None:
    assert grammar_text() == (ROOT / "grammar" / "movimentum.lark").read_text(encoding="utf-8")


def test_the_grammar_knows_the_same_words_as_the_tables() -> None:
    import re

    from movimentum.syntax.words import CLOCKS, FUNCTIONS, SYNONYMS

    def words(terminal: str) -> set[str]:
        match = re.search(rf"^{terminal}: /\\\.\(\?:(.*?)\)", grammar_text(), re.MULTILINE)
        assert match
        return {
            word for item in match[1].split("|") for word in ({item[:-2], item[:-1]} if item.endswith("?") else {item})
        }

    assert words("FUNCTION") == {*FUNCTIONS, *SYNONYMS}
    assert words("CLOCK") == set(CLOCKS)
