"""What is said about a GIF: what it cannot show, and what it weighs."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.encoding.gif import FASTEST, SEEN, GifWriter
from movimentum.encoding.palette import MOST
from movimentum.terminal import typed
from movimentum.text import counted

HEAVY = "render/weight"
_HEAVY = 1_000_000  # bytes
_FEW = 25  # pixels: fewer wrong ones are not seen


def too_fast(fps: Fraction) -> Diagnostic:
    """Of more frames a second than are shown."""
    return Diagnostic(
        "render/gif-rate",
        Severity.WARNING,
        f"GIF shows at most {FASTEST} frames a second: {float(fps):g} are thinned out to {FASTEST}",
        notes=("browsers slow faster films down to 10 frames a second",),
        helps=(f"--fps {FASTEST}", "-o out.webp"),
    )


def colors(writer: GifWriter, lossy: int, path: Path) -> list[Diagnostic]:
    """Of pixels that are not as they were drawn, and are seen not to be; and of half-transparent ones."""
    found: list[Diagnostic] = []
    if writer.missed > _FEW and writer.worst > lossy + SEEN:
        what = f"{counted(writer.missed, 'pixel')} of a frame are off by up to {writer.worst} of 255"
        message = f"a GIF has {MOST} colours, and this film has more: {what}"
        found.append(Diagnostic("render/gif-colors", Severity.WARNING, message, helps=(_as_webp(path),)))
    if writer.cut:
        message = "a pixel of a GIF is opaque or clear: edges that were half-transparent are jagged"
        notes = (f"{counted(writer.cut, 'pixel')} of a frame", "--background: the colour that edges are blended with")
        helps = ("--background white", _as_webp(path))
        found.append(Diagnostic("render/gif-alpha", Severity.WARNING, message, notes=notes, helps=helps))
    return found


def weight(size: int, path: Path, frames: int, picture: tuple[int, int], fps: Fraction, lossy: int) -> list[Diagnostic]:
    """What a large file weighs, and what would make it lighter."""
    if size <= _HEAVY:
        return []
    each = f"{counted(frames, 'frame')} of {picture[0]} x {picture[1]} pixels, {size / frames / 1000:.1f} kB each"
    helps = (
        *(() if lossy else ("--lossy 8",)),
        f"-o {typed(path.with_suffix('.mp4'))}",
        f"--fps {max(1, round(fps / 2))}",
        "--scale 0.7",
    )
    return [Diagnostic(HEAVY, Severity.NOTE, f"`{path.name}` has {size / 1e6:.1f} MB: {each}", helps=helps)]


def _as_webp(path: Path) -> str:
    return f"-o {typed(path.with_suffix('.webp'))}"
