"""Sprites cut from SVG drawings, and drawings that are no drawings."""

from __future__ import annotations

import io
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from movimentum.errors import MovimentumError, ScriptError
from movimentum.rendering import rasters
from tests.work import calls

ENGINE = """<?xml version="1.0"?>
<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">
<svg xmlns="http://www.w3.org/2000/svg" width="200" height="100">
  <defs>
    <linearGradient id="shade"><stop offset="0" stop-color="#f00"/><stop offset="1" stop-color="#800"/></linearGradient>
  </defs>
  <rect id="frame" x="0" y="80" width="200" height="20" fill="#0a0"/>
  <g id="wheel" transform="translate(60 50)">
    <circle r="30" fill="url(#shade)"/>
    <circle id="axle" r="4" fill="#fff"/>
    <path id="crank" d="M18,-2h4v4h-4z" fill="#00f"/>
  </g>
</svg>"""
SCRIPT = """.config(10, 200, 100);
Wheel : 'engine.svg#wheel' C = #axle P = #crank E = P + [0,5];
Frame : 'engine.svg#frame' F = [0,0];
@0 Wheel.C = [60,50]; Wheel.angle = %s;
@1
"""


def script(folder, drawing=ENGINE, text=SCRIPT % "90*.t"):
    (folder / "engine.svg").write_text(drawing)
    (folder / "engine.mov").write_text(text)
    return folder / "engine.mov"


def picture(motion, folder, **options):
    motion.render(folder / "a.png", **options)
    return np.asarray(Image.open(folder / "a.png").convert("RGB")).astype(int)


def test_elements_are_cut_out_and_anchors_are_named_after_them(tmp_path):
    motion = mv.load(script(tmp_path)).solve()
    assert motion["Wheel.C"][0] == pytest.approx([60, 50])
    assert motion["Wheel.P"][0] == pytest.approx([80, 50], abs=0.02)
    assert motion["Wheel.P"][-1] == pytest.approx([60, 70], abs=0.02)
    first = picture(motion, tmp_path, frames=0)
    assert first[50, 60].tolist() == [255, 255, 255]
    assert first[90, 100].tolist() == [0, 170, 0]
    assert first[50, 40, 0] > 150
    assert first[5, 5].tolist() == [255, 255, 255]


def test_a_drawing_is_as_sharp_as_it_is_shown(tmp_path):
    motion = mv.load(script(tmp_path, text=SCRIPT % "0")).solve()
    large = picture(motion, tmp_path, frames=0, scale=4)
    edge = large[360, :, 1]
    column = large[:, 400, 1]
    assert ((column > 175) & (column < 250)).sum() <= 2  # the upper edge of the frame: no blur
    assert (edge == 170).all()


def test_every_format_shows_it(tmp_path):
    motion = mv.load(script(tmp_path)).solve()
    for suffix in ("svg", "html", "gif"):
        motion.render(tmp_path / f"film.{suffix}")
        assert (tmp_path / f"film.{suffix}").stat().st_size > 500


HOSTILE = {
    "script": ("<svg width='9' height='9'><script>alert(1)</script></svg>", "asset/unsafe"),
    "handler": ("<svg width='9' height='9' onload='x()'/>", "asset/unsafe"),
    "network": ("<svg width='9' height='9'><image href='http://example.com/a.png'/></svg>", "asset/unsafe"),
    "file": ("<svg width='9' height='9'><image href='/etc/passwd'/></svg>", "asset/unsafe"),
    "style": ("<svg width='9' height='9'><style>@import 'a.css';</style></svg>", "asset/unsafe"),
    "url": ("<svg width='9' height='9'><rect fill='url(http://a/b#c)'/></svg>", "asset/unsafe"),
    "entities": ("<!DOCTYPE svg [<!ENTITY a 'aaaa'>]><svg width='9' height='9'>&a;</svg>", "asset/unsafe"),
    "external": ("<!DOCTYPE svg [<!ENTITY a SYSTEM 'file:///etc/passwd'>]><svg width='9' height='9'/>", "asset/unsafe"),
    "paths": ("<svg width='9' height='9'>" + "<path d='M0 0h9'/>" * 100_000 + "</svg>", "limit/drawing"),
    "deep": ("<svg width='9' height='9'>" + "<g>" * 5000 + "</g>" * 5000 + "</svg>", "limit/drawing"),
    "uses": (
        "<svg width='9' height='9'><g id='e0'><path d='M0 0h9'/></g>"
        + "".join(f"<g id='e{k}'>" + f"<use href='#e{k - 1}'/>" * 10 + "</g>" for k in range(1, 9))
        + "</svg>",
        "limit/drawing",
    ),
    "itself": ("<svg width='9' height='9'><g id='a'><use href='#a'/></g></svg>", "asset/unsafe"),
    "huge": ("<svg width='1e9' height='9'><rect id='wheel' width='9' height='9'/></svg>", "limit/pixels"),
    "sizeless": ("<svg><rect/></svg>", "asset/unreadable"),
    "other": ("<html/>", "asset/unreadable"),
    "broken": ("<svg width='9'", "asset/unreadable"),
    "binary": ("\x00\x01", "asset/unreadable"),
    "no such": ("<svg width='9' height='9'><g id='weel'/></svg>", "asset/element"),
    "nothing": ("<svg width='9' height='9'><g id='wheel'/></svg>", "asset/element"),
    "octaves": (
        "<svg width='9' height='9'><filter><feTurbulence numOctaves='1000000'/></filter></svg>",
        "limit/drawing",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_drawing_is_told_and_does_nothing(name, tmp_path):
    text, code = HOSTILE[name]
    made = script(
        tmp_path, text.replace("<svg", "<svg xmlns='http://www.w3.org/2000/svg'", 1), "W : 'engine.svg#wheel'; @0"
    )
    told: list[str] = []

    def drawn():
        with pytest.raises(MovimentumError) as caught:
            mv.load(made).solve().render(tmp_path / "a.png")
        told.append(caught.value.diagnostics[0].code)

    assert calls(drawn) < 1_000_000  # entities in entities would take more without end
    assert told == [code]


def test_a_drawing_without_its_library_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(rasters, "find_spec", lambda name: None)
    with pytest.raises(ScriptError) as caught:
        mv.load(script(tmp_path)).solve()
    assert caught.value.diagnostics[0].code == "asset/needs-svg"
    assert "movimentum[svg]" in caught.value.diagnostics[0].helps[0]


def test_elements_belong_to_drawings(tmp_path):
    Image.new("RGB", (9, 9)).save(tmp_path / "a.png")
    (tmp_path / "a.mov").write_text("W : 'a.png' C = #axle; @0")
    with pytest.raises(ScriptError) as caught:
        mv.load(tmp_path / "a.mov").solve()
    assert caught.value.diagnostics[0].code == "kind/mismatch"
    made = script(tmp_path, text="W : 'engine.svg#wheel' C = #axel; @0")
    with pytest.raises(ScriptError) as caught:
        mv.load(made).solve()
    assert caught.value.diagnostics[0].code == "asset/element"
    assert "#axle" in caught.value.diagnostics[0].helps[0]


def test_a_drawing_that_takes_too_long_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(rasters, "_WORKER", "import time; time.sleep(60)")
    monkeypatch.setattr(rasters, "SECONDS", 0.3)
    with pytest.raises(ScriptError) as caught:
        mv.load(script(tmp_path, text="W : 'engine.svg#frame'; @0")).solve().render(tmp_path / "a.png")
    assert caught.value.diagnostics[0].code == "limit/drawing"


def test_nothing_of_it_is_loaded_for_other_scripts():
    code = (
        "import sys, movimentum as mv; from pathlib import Path; import tempfile\n"
        "mv.loads('A : .bar P=[0,0] Q=[9,9] .width(2); @0').solve().render(Path(tempfile.mkdtemp()) / 'a.png')\n"
        "late = ('rendering.rasters', 'rendering.drawings', 'drawing.gears', 'rendering.areas')\n"
        "print([name for name in late if f'movimentum.{name}' in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("turn", [0, 23, 61])
def test_a_drawing_that_turns_is_as_sharp_as_drawn_there(tmp_path, turn):
    resvg = pytest.importorskip("resvg_py")
    body = (
        '<rect x="20" y="30" width="70" height="14" fill="#c33"/><path d="M20 90L100 20M30 100h60" stroke="#000"/>'
        '<circle cx="60" cy="70" r="22" fill="none" stroke="#246" stroke-width="3"/>'
    )
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="120" height="120">'
    (tmp_path / "a.svg").write_text(f"{head}{body}</svg>")
    text = f".config(10, 120, 120); W : 'a.svg' O=[60,60]; @0 W.O = [60.3, 59.4]; W.angle = {turn}; @1"
    (tmp_path / "a.mov").write_text(text)
    mv.load(tmp_path / "a.mov").solve().render(tmp_path / "a.png", at=0)
    moved = f'<g transform="translate(60.3 60.6) rotate({-turn}) translate(-60 -60)">{body}</g>'
    white = '<rect width="120" height="120" fill="#fff"/>'
    data = bytes(resvg.svg_to_bytes(svg_string=f"{head}{white}{moved}</svg>"))
    truth = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(float)
    found = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(float)
    assert np.sqrt(((found - truth) ** 2).mean()) < 6.0  # it was 10
    steps = [sum((np.diff(picture, axis=axis) ** 2).mean() for axis in (0, 1)) for picture in (found, truth)]
    assert 0.88 < steps[0] / steps[1] < 1.1  # it was 0.6
