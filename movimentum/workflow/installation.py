"""The installation, for bug reports: versions of everything that may matter, and where they are."""

from __future__ import annotations

import locale
import os
import platform
import re
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import movimentum.version as own
from movimentum.terminal import visible


def installation() -> str:
    """Several lines, ``what: which``."""
    return "".join(f"{what}: {visible(which)}\n" for what, which in _lines())


def _lines() -> Iterator[tuple[str, str]]:
    yield "installed in", f"{Path(own.__file__).parent} ({_how()})"
    yield "Python", f"{platform.python_version()} ({platform.python_implementation()}), {sys.executable}"
    yield "platform", f"{platform.platform()}, {os.cpu_count()} processors"
    yield "encodings", _encodings()
    needed, extras = _requirements()
    yield "libraries", ", ".join(map(_shown, needed)) or "unknown: the package is not installed"
    for extra, names in sorted(extras.items()):
        if extra not in ("dev", "docs", "test"):
            yield f"extra {extra}", ", ".join(map(_shown, names))
    yield "fonts", _fonts()


def _how() -> str:
    if own.is_checkout():
        return "a checkout with changes" if own.git("status", "--porcelain", "-uno") else "a checkout"
    return "a package" if _requirements()[0] else "a folder"


def _encodings() -> str:
    out = getattr(sys.stdout, "encoding", None)
    terminal = "a terminal" if sys.stdout is not None and sys.stdout.isatty() else "no terminal"  # pyright: ignore[reportUnnecessaryComparison]
    return f"{out or 'none'} on standard output ({terminal}), {locale.getpreferredencoding(False)} in files"


def _requirements() -> tuple[list[str], dict[str, list[str]]]:
    """The names of what is needed always, and by each extra."""
    needed: list[str] = []
    extras: dict[str, list[str]] = {}
    try:
        declared = metadata.requires("movimentum") or []
    except metadata.PackageNotFoundError:
        declared = []
    for line in declared:
        name = re.split(r"[^\w.-]", line, maxsplit=1)[0]
        if (extra := re.search(r"extra == ['\"]([\w-]+)['\"]", line)) is None:
            needed.append(name)
        elif name != "movimentum":
            extras.setdefault(extra[1], []).append(name)
    return needed, extras


def _shown(name: str) -> str:
    try:
        return f"{name} {metadata.version(name)}"
    except metadata.PackageNotFoundError:
        return f"{name} (not installed)"


def _fonts() -> str:
    from movimentum.rendering.faces import SHIPPED, installed

    return f"{', '.join(SHIPPED)}; of the system's: {', '.join(installed()) or 'none'}"
