"""The grammar file and the parser made from it, kept between runs where that is possible."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lark import Lark

GRAMMAR_NAME = "movimentum.lark"


def grammar_text() -> str:
    """The grammar's text: from the installed package, else from the checkout's ``grammar/``.

    Raises FileNotFoundError where neither has it (a broken installation).
    """
    packaged = resources.files("movimentum.syntax").joinpath(GRAMMAR_NAME)
    try:
        return packaged.read_text(encoding="utf-8")
    except FileNotFoundError:
        checkout = Path(__file__).resolve().parents[2] / "grammar" / GRAMMAR_NAME
        return checkout.read_text(encoding="utf-8")


@cache
def load_parser() -> Lark:
    """The LALR parser, whose rules call the functions of `movimentum.syntax.building`.

    Making it from the grammar takes about 35 ms, reading it from the user's cache folder about 4 ms. The cache is a
    convenience: whatever goes wrong with it (no home, read-only, damaged, another version) is passed over.
    ``MOVIMENTUM_CACHE=off`` does without.
    """
    import hashlib

    import lark

    text = grammar_text()
    version = f"{lark.__version__} {sys.version_info[:3]} {text}"
    path = cache_folder()
    if path is not None:
        path = path / f"parser-{hashlib.sha256(version.encode()).hexdigest()[:24]}.pickle"
        kept = _read_cache(path)
        if kept is not None:
            return kept
    parser = lark.Lark(
        text, parser="lalr", lexer="contextual", keep_all_tokens=True, maybe_placeholders=False, **_options()
    )
    if path is not None:
        _write_cache(parser, path)
    return parser


def cache_folder() -> Path | None:
    """Where the parser is kept, or None: ``movimentum`` in the user's cache folder."""
    choice = os.environ.get("MOVIMENTUM_CACHE")
    if choice == "off":
        return None
    if choice:
        return Path(choice)
    try:
        if sys.platform == "win32":
            base = os.environ.get("LOCALAPPDATA")
        else:
            base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    except (OSError, RuntimeError):
        return None
    return Path(base) / "movimentum" if base and os.path.isabs(base) else None


def _options() -> dict[str, Any]:
    from movimentum.syntax.building import Builder

    return {"transformer": Builder()}


def _read_cache(path: Path) -> Lark | None:
    """The parser kept at ``path``; None where there is none that is ours to trust."""
    import pickle

    from lark import Lark

    try:
        with path.open("rb") as file:
            # A pickle can run code, so only a file that is the user's own, and writable by nobody else, is opened.
            status = os.fstat(file.fileno())
            if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
                return None
            kept: dict[str, Any] = pickle.load(file)
        parser: Any = Lark.__new__(Lark)
        return parser._load(kept, **_options())
    except Exception:  # a cache that cannot be used is no cache; the grammar itself is at hand
        return None


def _write_cache(parser: Lark, path: Path) -> None:
    """Keep ``parser`` at ``path``, whole or not at all."""
    import tempfile

    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".parser-")
    except OSError:
        return
    try:
        with os.fdopen(handle, "wb") as file:
            parser.save(file, exclude_options=("transformer",))
        os.replace(name, path)
    except Exception:  # a full disk, a lark that cannot save: nothing is lost but time
        with suppress(OSError):
            os.unlink(name)
