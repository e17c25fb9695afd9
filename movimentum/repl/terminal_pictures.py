"""Shows pictures in terminals that support them: the protocols of kitty and iTerm2, and sixel."""

from __future__ import annotations

import os
import re
import select
import sys
import time
from collections.abc import Mapping
from contextlib import suppress

from movimentum.console import is_terminal
from movimentum.rendering.terminal_pictures import PictureProtocol, encoded

SETTING = "MOVIMENTUM_PICTURES"
"""The environment variable: a protocol's name forces it, `none` forbids pictures; `auto`, or nothing, looks."""
PATIENCE_S = 0.3
"""How long the terminal may take to say what it can do."""


def protocol() -> PictureProtocol | None:
    """The picture protocol of this process's terminal; None for no pictures."""
    if not is_terminal(sys.stdout) or not is_terminal(sys.stdin):
        return None
    found = named(os.environ)
    return found if found is None or isinstance(found, PictureProtocol) else _detected()


def named(environment: Mapping[str, str]) -> PictureProtocol | str | None:
    """The choice in the environment: a protocol, none, or "ask"."""
    wanted = environment.get(SETTING, "").strip().lower()
    if wanted in ("none", "off", "0"):
        return None
    with suppress(ValueError):
        return PictureProtocol(wanted)
    term, program = environment.get("TERM", ""), environment.get("TERM_PROGRAM", "")
    if environment.get("TMUX") or term.startswith(("screen", "tmux", "dumb", "linux")):
        return None  # they swallow the sequences
    if "KITTY_WINDOW_ID" in environment or term == "xterm-kitty" or program == "ghostty" or term == "xterm-ghostty":
        return PictureProtocol.KITTY
    if program in ("iTerm.app", "WezTerm") or environment.get("LC_TERMINAL") == "iTerm2":
        return PictureProtocol.ITERM2
    return "ask"


def _detected() -> PictureProtocol | None:
    """Ask the terminal for its primary attributes: 4 among them is sixel. Nothing of the answer is left to be read."""
    try:
        import termios
        import tty
    except ImportError:  # Windows
        return None
    stream = sys.stdin.fileno()
    try:
        before = termios.tcgetattr(stream)
    except termios.error:
        return None
    said = b""
    try:
        tty.setcbreak(stream)
        os.write(sys.stdout.fileno(), b"\x1b[c")
        until = time.monotonic() + PATIENCE_S
        while b"c" not in said and (left := until - time.monotonic()) > 0:
            if select.select([stream], [], [], left)[0]:
                said += os.read(stream, 256)
    except OSError:
        return None
    finally:
        termios.tcsetattr(stream, termios.TCSADRAIN, before)
    return PictureProtocol.SIXEL if has_sixel(said) else None


def has_sixel(attributes: bytes) -> bool:
    """Whether a terminal's primary attributes (``ESC [ ? 62 ; 4 c``) have sixel among them."""
    found = re.search(rb"\x1b\[\?([\d;]*)c", attributes)
    return found is not None and b"4" in found[1].split(b";")[1:]


def show(picture: bytes, how: PictureProtocol) -> None:
    """Put a picture on the terminal."""
    sys.stdout.flush()
    with suppress(OSError, ValueError):
        sys.stdout.buffer.write(encoded(picture, how))
        sys.stdout.buffer.flush()
