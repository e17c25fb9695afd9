"""Pictures in terminals that can show them: the protocols of kitty and iTerm2, and sixel."""

from __future__ import annotations

import base64
import io
import os
import re
import select
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from enum import StrEnum
from typing import TYPE_CHECKING

from movimentum.console import is_terminal

if TYPE_CHECKING:
    from PIL.Image import Image

SETTING = "MOVIMENTUM_PICTURES"
"""The environment variable: a protocol's name forces it, `none` forbids pictures; `auto`, or nothing, looks."""
PATIENCE_S = 0.3
"""How long the terminal may take to say what it can do."""
_CHUNK = 4096
_COLOURS = 255


class Protocol(StrEnum):
    """How a picture gets to the terminal."""

    KITTY = "kitty"
    ITERM2 = "iterm2"
    SIXEL = "sixel"


def protocol() -> Protocol | None:
    """What the terminal of this process can show; None for no pictures."""
    if not is_terminal(sys.stdout) or not is_terminal(sys.stdin):
        return None
    found = named(os.environ)
    return found if found is None or isinstance(found, Protocol) else _asked()


def named(environment: Mapping[str, str]) -> Protocol | str | None:
    """What the environment says: a protocol, none, or "ask"."""
    wanted = environment.get(SETTING, "").strip().lower()
    if wanted in ("none", "off", "0"):
        return None
    with suppress(ValueError):
        return Protocol(wanted)
    term, program = environment.get("TERM", ""), environment.get("TERM_PROGRAM", "")
    if environment.get("TMUX") or term.startswith(("screen", "tmux", "dumb", "linux")):
        return None  # they swallow the sequences
    if "KITTY_WINDOW_ID" in environment or term == "xterm-kitty" or program == "ghostty" or term == "xterm-ghostty":
        return Protocol.KITTY
    if program in ("iTerm.app", "WezTerm") or environment.get("LC_TERMINAL") == "iTerm2":
        return Protocol.ITERM2
    return "ask"


def _asked() -> Protocol | None:
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
    return Protocol.SIXEL if has_sixel(said) else None


def has_sixel(attributes: bytes) -> bool:
    """Whether a terminal's primary attributes (``ESC [ ? 62 ; 4 c``) have sixel among them."""
    found = re.search(rb"\x1b\[\?([\d;]*)c", attributes)
    return found is not None and b"4" in found[1].split(b";")[1:]


def encoded(picture: Image, how: Protocol) -> bytes:
    """What a terminal has to be sent for a picture."""
    if how is Protocol.SIXEL:
        return sixel(picture)
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "PNG")
    data = base64.b64encode(stream.getvalue())
    if how is Protocol.ITERM2:
        return b"\x1b]1337;File=inline=1;size=%d:%s\x07\n" % (len(stream.getvalue()), data)
    parts = [data[k : k + _CHUNK] for k in range(0, len(data), _CHUNK)]
    last = len(parts) - 1
    return b"".join(
        b"\x1b_G%sm=%d;%s\x1b\\" % (b"" if n else b"a=T,f=100,q=2,", n < last, part) for n, part in enumerate(parts)
    ) + b"\n"  # fmt: skip


def sixel(picture: Image) -> bytes:
    """A picture as sixels: bands of six rows, each colour of a band after the other, with repeats in short."""
    import numpy as np

    small = picture.convert("RGB").quantize(_COLOURS)
    pixels = np.asarray(small)
    palette = small.getpalette() or []
    used = np.unique(pixels).tolist()
    out = [f'\x1bPq"1;1;{small.width};{small.height}']
    for n in used:
        red, green, blue = (round(part * 100 / 255) for part in palette[3 * n : 3 * n + 3])
        out.append(f"#{n};2;{red};{green};{blue}")
    for top in range(0, small.height, 6):
        band = pixels[top : top + 6]
        bits = 1 << np.arange(len(band))
        rows: list[str] = []
        for n in np.unique(band).tolist():
            codes = (bits[:, None] * (band == n)).sum(axis=0)
            edges = np.flatnonzero(np.diff(codes)) + 1
            starts, ends = [0, *edges.tolist()], [*edges.tolist(), len(codes)]
            runs = ((chr(63 + int(codes[a])), b - a) for a, b in zip(starts, ends, strict=True))
            rows.append(f"#{n}" + "".join(f"!{many}{sign}" if many > 3 else sign * many for sign, many in runs))
        out.append("$".join(rows) + "-")
    return "".join([*out, "\x1b\\\n"]).encode("ascii")


def show(picture: Image, how: Protocol) -> None:
    """Put a picture on the terminal."""
    sys.stdout.flush()
    with suppress(OSError, ValueError):
        sys.stdout.buffer.write(encoded(picture, how))
        sys.stdout.buffer.flush()
