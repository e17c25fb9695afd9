"""Films in a browser, and the same frames by Pillow."""

from __future__ import annotations

import io
from fractions import Fraction
from pathlib import Path
from typing import Any

from PIL import Image

from tests.command import ROOT

EVERYTHING = """\
.config(10, 360, 260) .background('#eeeeff');
Wheel : 'wheel-centre.png' C = [90,90] P = C + [40,0] .scale(0.7);
Arm   : .arrow A = [0,0] B = A + [60,0] C = B + [40,30] .width(5) .color('firebrick');
Dot   : .disc(20) O = [250,180] .width(4) .color('seagreen');
Ball  : .disc(9) O = [320,200] .color('black');
Bar   : .bar A = [200,60] B = A + [60,0] .color('steelblue') .width(14);
Cord  : .line Wheel.P Bar.B .width(3) .color('purple');
Late  : .bar A = [300,30] B = A + [0,40] .color('orange');
Text  : .label('Größe </script>&"') A = [150,230] .color('navy');
@0  Wheel.C = [90,110]; Wheel.angle = 90*.t; Wheel.green = 255 - 100*.t; Wheel.opacity = 1 - 0.4*.t;
    Arm.A = [150,60];   Arm.angle = 45*.t;   Arm.opacity = 0.5;
    Dot.O = [250 + 20*.t, 180];              Dot.red = 100*.t;
    Ball.O = [320,200]; Bar.A = [200,60];
    Text.A = [150,230]; Text.angle = -10*.t;
@1  Late.A = [300,30];  Late.angle = -30*.t;
@2
"""
"""All kinds of things; what is faded, tinted, coloured by constraints, appears later or is free."""


FIGURES = """\
.config(10, 480, 360) .background('#fdfdf4');
P  : .plate A = [60,60] B = A + [100,0] C = A + [40,70] .pins;
Q  : .polygon A = [220,60] B = A + [80,0] C = A + [80,60] D = (A + C)/2 + [0,10] .fill('gold') .edge('navy');
G  : .ground O = [350,80];
U  : .ground L.A;
L  : .bar A = [60,200] B = A + [100,40] C = 2*B - A .edge('black') .fill('lightblue') .width(16) .pins(4) .through(A,C);
D  : .bar A = [60,300] B = [260,330] .dash(12,6) .cap('butt');
E  : .disc(20) C = [330,200] .fill('white') .edge('red') .width(3);
S  : .slide Q.A L.C;
W  : .spring P.C E.C .coils(6);
Z  : .damper D.B E.C;
Y  : .cylinder G.O E.C .fill('white');
M  : .dimension L.A L.B .places(1);
N  : .arc P.B P.A P.C .text('x') .italic;
K  : .line P.A Q.B .dash(5,5) .color('purple');
GE : .gear(11, 7) A = [420,270] B = A + [10,0] .opacity(0.5);
GR : .gear(40, 2.5) .inner A = [420,110];
CU : .curve A = [430,40] .polar(th, 20 + .mod(th, 120)/12) .fill('beige');
CO : .curve A = [20,120] .through([0,0], [30,20], [60,0], [80,30]) .open .dash(7,4) .color('teal');
R  : .rack(6, 5) A = [330,320] B = A + [10,0];
V  : .vector L.C .velocity(0.8) .text('v');
X  : .vector E.C .acceleration(0.1) .color('teal') .width(4);
L1 : .label('θ = {L.angle:.1f}° {E.C.y:+.0f}') at = [280,140] .size(18) .align('center') .color('navy');
L2 : .label('slanted') at = [470,10] .italic .align('right');
RO : .cord P.A E -GE Q.B;
AR : .area P.A Q.B [300,20] .bulge(0.15, 0) .opacity(0.4);
AS : .area D.A D.B E.C L.C .smooth .color('khaki') .edge('olive') .clip CL;
CL : .disc(60) C = [200,300] .hidden;
RI : .right P.B P.A P.C;
TI : .ticks P.A P.B .count(2);
PA : .parallel L.A L.C .count(3) .color('teal');
N1 : .label('P_{1}') P.C;
N2 : .label('E = {E.C.x:.0f}') E.C .offset(16,-14) .italic;
N3 : .label('led') Q.C .offset(-30,40) .leader;
N4 : .label('there') [20,340];
GG : .graph(E.C.x, L.C.y) .over(L.angle) O = [130,150] .size(90,50) .title('g_{1}') .xlabel('x') .ylabel('y');
GP : .graph(.d(E.C.y)) .over(90*.t) .polar O = [20,250] .size(60,60);
PC : .centre L .text('P') .color('purple');
PR : .centre L Q;
PF : .polode E;   PM : .polode L Q .moving .dash(4,3);
PI : .inflection L .color('green');
PV : .velocities(L.C, E.C) at = [420,340] .scale(0.4);
K2 : .line P.A [10,10] Q.A .color('brown');
T  : .trace L.B .whole;
T2 : .trace L.C .color('green') .dash(8,4);
T3 : .trace E.C .tail(0.6) .width(5) .color('red');
@0  L.A = [60,200];   L.angle = 30*.t;   GE.A = [420,270];   GE.angle = 20*.t;   D.opacity = 1 - 0.3*.t;
    E.C = [330 + 30*.sin(180*.t), 200 + 10*.t];   P.A = [60,60];   P.angle = -5*.t;   P.red = 150 + 50*.t;
    L1.at = [280,140];   L1.angle = 3*.t;
@2
"""
"""The kinds of figures that are more than a line, moving, faded and dashed."""


CHANGING = """\
.config(10, 360, 240) .background('#fdfdf4');
Wheel : 'wheel-centre.png' C = [60,60] P = C + [40,0] .scale(0.5);
Disc  : .disc(40) C = [150,100] .color('navy');
Crank : .bar A = [130,100] B = A + [80,0] .width(20) .color('red') .edge('black') .pins;
Spot  : .disc(12) C = [170,120] .color('khaki');
Poly  : .polygon A = [40,150] B = A + [40,0] C = A + [20,30] .color('gold') .edge('olive');
Cam   : .polygon A = [290,170] B = A + [40,0] C = A + [20,40] .color('teal') .clip Iris;
Iris  : .disc(20) C = [300,185] .hidden;
Title : .label('Größe') at = [20,20];
Live  : .label('{Crank.angle:.0f}°') at = [230,210];
Gone  : .disc(10) C = [20,220];
Near  : .line Gone.C [60,200];
F1    : .disc(30) C = [270,60] .color('green');
F2    : .disc(30) C = [285,80] .color('red') .edge('black') .fill('white');
L1    : .line F1.C F2.C [330,40] .width(6);
LF    : .label('both') F1.C .offset(0,-40);
G     : .group F1 F2 L1 LF;
Ring  : .ring(24, 12) C = [100,200] .clip Pie;
Pie   : .sector(30, 20, 250) C = [110,200] .opacity(0.5);
Bow   : .polygon A = [230,120] B = A + [40,0] C = A + [40,30] .arcto(C, 16) .arcto(A, -40);
Curl  : .bezier Crank.B [200,230] Bow.C .width(3) .dash(7,4);
Own   : .bezier A = [300,20] B = [320,60] C = [340,-20] D = [350,40] .color('purple');
Round : .label('round it') .follows(Disc) .size(13) .offset(0,2);
Bent  : .label('bent %') .follows(Curl) .align('center') .size(12) .italic .offset(0,4);
Inked : .label('path') .follows(Ink) .size(12) .offset(4,-12) .color('purple');
Ink   : .trace Crank.B .while(Crank.angle < 100, Crank.B.x > 100);
Whole : .trace Spot.C .while(Crank.angle > 45) .whole;
@0  Crank.A = [130,100];   Crank.angle = 90*.t;   Spot.C = [170 - 20*.t, 120];
    Crank.layer = { Crank.angle < 45 : 9; Crank.angle < 90 : 1.5; -1 };
    Disc.layer  = { .t < 1.55 : 1; 20 };
    Gone.visible = { .t < 0.95 : 1; .t < 1.4 : 0; 1 };
    G.opacity = 1 -> 0.2;   F2.opacity = 0.5 + .t/4;   G.layer = { .t < 0.4 : 0.5; 14 };
    Wheel.C = [60,60];      Wheel.scale = 1 + .t;   Wheel.angle = 20*.t;
    Title.scale = 1 -> 2;   Live.scale = 1 -> 1.5;  Live.angle = 10*.t;
    Poly.scale = 0.5 + .t;  Poly.angle = 15*.t;     Cam.scale = 2 -> 0;  Iris.scale = 1 + .t/2;
@2
"""
"""Layers, visibility, scales, pens and groups that change in time."""


def changing(folder: Path) -> Path:
    """The script `CHANGING` with its picture."""
    (folder / "wheel-centre.png").write_bytes((ROOT / "scripts" / "sprites" / "wheel-centre.png").read_bytes())
    script = folder / "changing.mov"
    script.write_text(CHANGING, encoding="utf-8")
    return script


def figures(folder: Path) -> Path:
    """The script `FIGURES`."""
    script = folder / "figures.mov"
    script.write_text(FIGURES, encoding="utf-8")
    return script


def everything(folder: Path) -> Path:
    """The script `EVERYTHING` with its picture."""
    (folder / "wheel-centre.png").write_bytes((ROOT / "scripts" / "sprites" / "wheel-centre.png").read_bytes())
    script = folder / "everything.mov"
    script.write_text(EVERYTHING, encoding="utf-8")
    return script


def shot_of_svg(page: Any, seconds: Fraction, size: tuple[int, int]) -> Image.Image:
    """The SVG that the page shows, stopped at a time, to somebody who likes motion."""
    page.emulate_media(reduced_motion="no-preference")
    page.evaluate(
        "t => {document.documentElement.pauseAnimations(); document.documentElement.setCurrentTime(t)}", float(seconds)
    )
    return _shot(page, 0.0, 0.0, size)


def shot_of_page(page: Any, frame: int, size: tuple[int, int]) -> Image.Image:
    """The player's picture of a frame."""
    page.evaluate(
        "k => window.movimentum.ready.then(() => {window.movimentum.pause(); window.movimentum.seek(k)})", frame
    )
    box = page.get_by_test_id("stage").bounding_box()
    assert (round(box["width"]), round(box["height"])) == size
    return _shot(page, box["x"], box["y"], size)


def _shot(page: Any, x: float, y: float, size: tuple[int, int]) -> Image.Image:
    # two frames of the browser, so that what was changed is painted
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    data = page.screenshot(clip={"x": x, "y": y, "width": size[0], "height": size[1]})
    return Image.open(io.BytesIO(data)).convert("RGB")


def seen(text: str) -> str:
    """A script of two time units with a camera that moves, and two insets."""
    text = text.replace(
        "@0 ",
        "IN : .inset([240 + 20*.t, 120], 3) C = [20,20] .size(110,80) .leader .color('teal');\n"
        "ID : .inset([100,100], 1.5) C = [250,140] .size(90,90) .opacity(0.6) .fill('mistyrose');\n"
        "@0  .view([180,130], 1.2);   ",
        1,
    )
    first, _, last = text.rpartition("@2")
    first = first.replace("@1 ", "@0.3 ") if "@1 " in first else first
    return f"{first}@+0.3 .view([220 + 20*.s, 150], 2.5 + 0.2*.t);\n@1.6 .view(_, 1) .cut;\n@2{last}"
