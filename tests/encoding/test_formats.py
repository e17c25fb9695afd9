"""Every suffix: those of `FORMATS` make files of that format, any other is refused with the list of them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PIL import Image

import movimentum as mv
from movimentum.encoding import write
from movimentum.encoding.pieces import Coder, FramePiece, saved
from movimentum.encoding.write import FORMATS, OutputFormat
from movimentum.rendering.stamps import Box, Frame
from tests.command import ROOT, STILL, movimentum

OTHERS = [
    ".bmp", ".tif", ".tiff", ".jpe", ".jp2", ".ico", ".tga", ".xbm", ".ppm", ".psd", ".heic", ".avif", ".eps",
    ".ps", ".svgz", ".avi", ".mov", ".mkv", ".ogv", ".mp3", ".htm", ".giff", ".GIFF", ".gi", ".pngx", ".mp", ".web",
    ".sv", ".txt", ".csv", ".npz", ".json", ".zip", ".parquet", ".py", ".c", ".é", ".", "..",
]  # fmt: skip
"""Suffixes that people type: other pictures and films, misspelt ones, tables, texts."""


@pytest.mark.parametrize("suffix", ["", *OTHERS])
def test_an_unknown_suffix_is_refused_with_the_list(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(mv.UsageError) as caught:
        write.check_output(tmp_path / f"x{suffix}")
    (item,) = caught.value.diagnostics
    assert item.code == "output/format"
    assert re.findall(r"\.[a-z0-9]+", item.message.partition("known are")[2]) == list(FORMATS)
    (help_,) = item.helps
    assert write.check_output(Path(help_.removeprefix("-o ").strip("'"))), help_


@pytest.mark.parametrize(
    ("suffix", "near"),
    [(".bmp", ".png"), (".tiff", ".png"), (".eps", ".pdf"), (".avi", ".mp4"), (".htm", ".html"), (".giff", ".gif")],
)
def test_the_nearest_format_is_proposed(suffix: str, near: str) -> None:
    with pytest.raises(mv.UsageError) as caught:
        write.check_output(Path(f"x{suffix}"))
    assert caught.value.diagnostics[0].helps == (f"-o x{near}",)


COMMANDS = [
    ("run", "-o"), ("solve", "-o"), ("trade", "-o"), ("sweep", "--vary", "R=1:2:2", "-o"),
    ("sweep", "--vary", "R=1:2:2", "--sheet"), ("fit", "--sheet"),
]  # fmt: skip


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
@pytest.mark.parametrize("suffix", [".bmp", ".xyz", ""])
def test_every_command_refuses_an_unknown_suffix(words: tuple[str, ...], suffix: str, tmp_path: Path) -> None:
    text = STILL.replace("Rod :", ".let R = 30 .range(1, 50); Rod :") + ".goal Rod.B.x = 20;"
    (tmp_path / "a.mov").write_text(text.replace("[30,0]", "[R,0]"))
    done = movimentum(words[0], "a.mov", *words[1:], f"x{suffix}", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert re.search(r"\.(gif|csv|png)\b", done.stderr)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mov"]


class BmpCoder(Coder):
    """The coder of the recipe in docs/how-to-add.md."""

    def code(self, frame: Frame) -> FramePiece | None:
        image = frame.image
        return FramePiece(Box(0, 0, *image.size), saved(image.convert("RGB"), "BMP")) if frame.changed else None


def test_a_new_format_is_one_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = re.search(r"`(OutputFormat\(.*\))`", (ROOT / "docs/how-to-add.md").read_text(encoding="utf-8"))
    assert told is not None
    made = eval(told[1], {"OutputFormat": OutputFormat, "_write_still": write._write_still, "BmpCoder": BmpCoder})
    monkeypatch.setitem(FORMATS, ".bmp", made)
    motion = mv.loads(STILL).solve()
    motion.render(tmp_path / "x.bmp")
    motion.render(tmp_path / "x%d.bmp", workers=1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.bmp", "x0.bmp"]
    for path in tmp_path.iterdir():
        with Image.open(path) as picture:
            assert (picture.format, picture.size) == ("BMP", (60, 40))
    with pytest.raises(mv.UsageError, match="a BMP has no transparency"):
        motion.render(tmp_path / "y.bmp", transparent=True)


def test_every_list_of_formats_is_whole() -> None:
    page = (ROOT / "docs/reference/files.md").read_text(encoding="utf-8")
    table = page.partition("| suffix | |")[2].partition("\n\n")[0]
    assert sorted(re.findall(r"`(\.\w+)`", table)) == sorted(FORMATS)
    told = movimentum("run", "--help").stdout
    assert set(FORMATS) - {".jpeg"} <= set(re.findall(r"\.\w+", told))
    assert set(FORMATS) - {".jpeg"} <= set(re.findall(r"\.\w+", mv.Motion.render.__doc__ or ""))


def test_every_format_with_pixels_is_what_its_suffix_says(tmp_path: Path) -> None:
    motion = mv.loads(STILL).solve()
    for suffix, each in FORMATS.items():
        path = tmp_path / f"x{suffix}"
        if suffix not in (".mp4", ".webm"):  # tests/encoding/test_files.py has these, which need PyAV
            motion.render(path, workers=1)
        if each.write is not None and path.exists():
            with Image.open(path) as picture:
                assert picture.format == {"APNG": "PNG", "WebP": "WEBP"}.get(each.name, each.name)
