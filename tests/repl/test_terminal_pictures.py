"""Pictures in terminals: what is sent is read again by decoders written from the protocols."""

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

from movimentum.rendering.terminal_pictures import PictureProtocol, encoded
from movimentum.repl.session import opened
from movimentum.repl.shell import COMMANDS
from movimentum.repl.terminal_pictures import has_sixel, named
from movimentum.workflow.choices import Choices
from tests.command import CRANK


def _picture() -> Image.Image:
    pixels = np.zeros((20, 33, 3), np.uint8)
    pixels[3:9, 4:20] = (255, 0, 0)
    pixels[10:, 15:] = (0, 255, 51)
    pixels[19, 32] = (255, 255, 255)
    return Image.fromarray(pixels)


def _png(picture: Image.Image) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    return stream.getvalue()


def _sixels(data: str, width: int, height: int) -> np.ndarray:
    pixels = np.zeros((height, width, 3), int)
    colours, now, x, top = {}, 0, 0, 0
    body = data[data.index("q") + 1 : data.rindex("\x1b")]
    for token in re.findall(r'"[\d;]+|#[\d;]+|!\d+.|[$-]|[?-~]', body):
        if token[0] == "#":
            parts = list(map(int, token[1:].split(";")))
            now = parts[0]
            if len(parts) == 5:
                colours[now] = [round(part * 255 / 100) for part in parts[2:]]
        elif token == "$":
            x = 0
        elif token == "-":
            x, top = 0, top + 6
        elif token[0] != '"':
            many = int(token[1:-1]) if token[0] == "!" else 1
            bits = ord(token[-1]) - 63
            for row in range(6):
                if bits >> row & 1:
                    pixels[top + row, x : x + many] = colours[now]
            x += many
    return pixels


def test_sixels():
    picture = _picture()
    found = _sixels(encoded(_png(picture), PictureProtocol.SIXEL).decode(), *picture.size)
    assert np.abs(found - np.asarray(picture).astype(int)).max() <= 2


def test_kitty_and_iterm2_get_the_picture():
    rng = np.random.default_rng(1)
    picture = Image.fromarray(rng.integers(0, 255, (60, 90, 3), np.uint8))
    sent = encoded(_png(picture), PictureProtocol.KITTY)
    chunks = re.findall(rb"\x1b_G([^;]*);([^\x1b]*)\x1b\\", sent)
    assert len(chunks) > 1
    assert chunks[0][0].startswith(b"a=T,f=100")
    assert [head.endswith(b"m=1") for head, _ in chunks] == [True] * (len(chunks) - 1) + [False]
    assert all(len(data) <= 4096 for _, data in chunks)
    sent = encoded(_png(picture), PictureProtocol.ITERM2)
    found = re.fullmatch(rb"\x1b\]1337;File=inline=1;size=(\d+):([^\x07]*)\x07\n", sent)
    for data in (b"".join(data for _, data in chunks), found[2]):
        with Image.open(io.BytesIO(base64.b64decode(data))) as again:
            assert again.tobytes() == picture.tobytes()
    assert int(found[1]) == len(base64.b64decode(found[2]))


@pytest.mark.parametrize(
    ("environment", "told"),
    [
        ({"KITTY_WINDOW_ID": "1", "TERM": "xterm-kitty"}, PictureProtocol.KITTY),
        ({"TERM_PROGRAM": "iTerm.app", "TERM": "xterm-256color"}, PictureProtocol.ITERM2),
        ({"TERM": "xterm-256color"}, "ask"),
        ({"TERM": "tmux-256color", "KITTY_WINDOW_ID": "1"}, None),
        ({"TERM": "xterm-kitty", "MOVIMENTUM_PICTURES": "none"}, None),
        ({"TERM": "screen", "MOVIMENTUM_PICTURES": "Sixel"}, PictureProtocol.SIXEL),
        ({"TERM": "xterm-kitty", "MOVIMENTUM_PICTURES": "auto"}, PictureProtocol.KITTY),
    ],
)
def test_the_environment(environment, told):
    assert named(environment) == told


def test_attributes():
    assert has_sixel(b"\x1b[?62;4;6c")
    assert not has_sixel(b"\x1b[?62;14;6c")
    assert not has_sixel(b"\x1b[?4c")
    assert not has_sixel(b"")


def test_commands_draw(tmp_path):
    from dataclasses import replace

    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    shown = []
    session = replace(opened(str(path), Choices()), draw=shown.append)
    assert COMMANDS["plot"].run(session, "x")[1] == ""
    assert "picture FILE" in COMMANDS["picture"].run(session, "")[1]
    assert COMMANDS["diff"].run(session, "motion")[1] == "nothing is changed"
    changed = session.edited(session.text.replace("90*.t", "45*.t"))
    assert "Crank.P" in COMMANDS["diff"].run(changed, "motion")[1]
    assert len(shown) == 3
    drawn = [Image.open(io.BytesIO(png)) for png in shown]
    assert drawn[2].size == drawn[1].size == (120, 80)
    before = np.asarray(drawn[2].convert("RGB")).astype(int)
    COMMANDS["diff"].run(replace(changed, draw=None), f"motion -o {tmp_path / 'd.png'}")
    with Image.open(tmp_path / "d.png") as written:
        assert (np.asarray(written.convert("RGB")).astype(int) == before).all()
