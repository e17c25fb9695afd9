"""What somebody else's folder may hold: pictures, recordings and names that mean harm. Seeded where there is chance."""

from __future__ import annotations

import io
import json
import os
import struct
import zlib
from pathlib import Path

from PIL import Image

SPRITE = """\
.config(4, 60, 40);
Wheel : '{}' P = [4,4];
@0 Wheel.P = [30,20]; Wheel.angle = 90*.t;
@1
"""
"""A script with one picture, 5 frames."""

CONTROLS = [
    "\x1b]0;title\x07",
    "\x1b[2J",
    "\x9b31m",
    "\x85",
    "\x7f",
    "\u202e",
    "\u2066",
    "\u061c",
    "\u2028",
    "\r",
    "\b",
]
"""What a terminal obeys, or shows backwards."""


def png(path: Path, size: tuple[int, int] = (8, 8), color: str = "red") -> Path:
    """A whole PNG of one colour."""
    Image.new("RGBA", size, color).save(path, "PNG")
    return path


def saved(kind: str, size: tuple[int, int] = (8, 8)) -> bytes:
    """The bytes of a picture in one of Pillow's formats."""
    buffer = io.BytesIO()
    Image.new("RGB", size, "red").save(buffer, kind)
    return buffer.getvalue()


def postscript(mark: Path) -> bytes:
    """An EPS that would leave a file at ``mark`` if anything interpreted it."""
    program = f"({mark}) (w) file closefile showpage"
    return f"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n%%EndComments\n{program}\n%%EOF\n".encode()


def bomb(width: int, height: int) -> bytes:
    """A PNG that is a few kilobytes and says that it has ``width`` x ``height`` clear pixels; its data are whole."""
    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    packer = zlib.compressobj(9)
    row = bytes(1 + (width + 7) // 8)
    data = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    chunks = [(b"IHDR", header), (b"IDAT", data), (b"IEND", b"")]
    packed = b"".join(struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks)
    return b"\x89PNG\r\n\x1a\n" + packed


def tampered(folder: Path) -> dict[str, object]:
    """Ways to spoil a recording in ``folder``, by name: each a function without arguments."""
    about, table = folder / "golden.json", folder / "poses.csv"
    picture = next(iter(sorted(folder.glob("frame-*.png"))))
    right = json.loads(about.read_text())

    def manifest(**changes: object) -> None:
        about.write_text(json.dumps({**right, **changes}))

    def instead(path: Path, other: str) -> None:
        path.unlink()
        os.symlink(other, path)

    def pipe(path: Path) -> None:
        path.unlink()
        os.mkfifo(path)

    header, *rows = table.read_text().splitlines()
    return {
        "deep JSON": lambda: about.write_text("[" * 100_000),
        "long JSON": lambda: about.write_text(" " * 2_000_000),
        "JSON of nothing": lambda: about.write_text("null"),
        "infinite frames": lambda: about.write_text('{"format": 1, "frames": 1e999, "pictures": [], "renderer": {}}'),
        "frames that are text": lambda: manifest(frames="5"),
        "frames that are many": lambda: manifest(frames=10**30),
        "true frames": lambda: manifest(frames=True),
        "pictures that are none": lambda: manifest(pictures="../../x"),
        "renderer that is none": lambda: manifest(renderer=[1]),
        "other format": lambda: manifest(format="\x1b[2J" * 1000),
        "endless table": lambda: instead(table, "/dev/zero"),
        "endless manifest": lambda: instead(about, "/dev/zero"),
        "pipe for a table": lambda: pipe(table),
        "pipe for a manifest": lambda: pipe(about),
        "pipe for a picture": lambda: pipe(picture),
        "large table": lambda: table.write_text("\n".join([header, *(rows * 20_000)])),
        "long line": lambda: table.write_text("x" * 20_000_000),
        "long field": lambda: table.write_text(header + "\n" + "1" * 200_000 + "\n"),
        "no number": lambda: table.write_text("\n".join([header, rows[0].replace("0", "zero", 1)])),
        "not a number": lambda: table.write_text("\n".join([header, *(r.rsplit(",", 1)[0] + ",nan" for r in rows)])),
        "short rows": lambda: table.write_text("\n".join([header, *(row.rsplit(",", 1)[0] for row in rows)])),
        "empty table": lambda: table.write_text(""),
        "binary table": lambda: table.write_bytes(bytes(range(256)) * 100),
        "bad names": lambda: table.write_text(header + ",\x1b]0;x\x07\n" + "".join(r + ",1\n" for r in rows)),
        "bomb for a picture": lambda: picture.write_bytes(bomb(7000, 7000)),
        "other picture": lambda: picture.write_bytes(postscript(folder / "mark")),
        "half a picture": lambda: picture.write_bytes(picture.read_bytes()[:60]),
        "folder for a picture": lambda: (picture.unlink(), picture.mkdir()),
    }
