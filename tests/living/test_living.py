"""Living figures: what the page computes is what `solve` finds, whatever the sliders say."""

# ruff: noqa: E501
import json
import math
import random
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import movimentum as mv
from movimentum.living.scene import is_live
from tests.broad import broad
from tests.command import ROOT, movimentum

SCRIPTS = ROOT / "scripts"
FOUR_BAR = """
.config(25, 400, 320);
.let R = 50 .range(20, 90);   .let L = 150;   .let phase = 0 .range(-90, 90) .unit('°');
Path    : .trace Coupler.P .whole;
Crank   : .bar   A = [130,110]  B = A + [R,0];
Coupler : .plate B = [0,0]  P = B + [70,90]  C = B + [L,0];
Rocker  : .bar   C = [0,0]  D = C - [0,130];
Spring  : .spring Crank.B Rocker.D;
Turn    : .label('θ = {.mod(Crank.angle, 360):.0f}°, R = {R:.1f}')  at = [20,20];
Fast    : .vector Coupler.P .velocity(0.2);
@0  Crank.A   = [130,110];   Crank.angle = 180*.t + phase;
    Coupler.B = Crank.B;     Rocker.C = Coupler.C;
    Rocker.D  = [310,110];   Rocker.C.y > Rocker.D.y;
@2  .loop;
"""
BAD = {
    "no constant": ("Arm : .bar O=[0,0] P=[9,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1", "usage/constant", None),
    "unknown": (".let Rod = 9; Arm : .bar O=[0,0] P=[Rod,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1", "usage/constant", None),
    "a vector": (".let R = [9,0]; Arm : .bar O=[0,0] P=R; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1", "usage/live", None),
    "a sprite": (
        ".let R = 2; Arm : 'arm.png' O=[0,0] P=[9,0] .scale(R); @0 Arm.O=[0,0]; Arm.angle=90*.t; @1", "live/cannot", "R",
    ),
    "a time": (".let R = 2; Arm : .bar O=[0,0] P=[9,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @R", "live/cannot", "R"),
    "a count": (
        ".let R = 2; Arm[1..R] : .bar O=[0,0] P=[9,0]; @0 .for k=1..R { Arm[k].O=[0,0]; Arm[k].angle=9*.t; } @1",
        "live/cannot", "R",
    ),
    "nothing": (".let R = 2; Arm : .bar O=[0,0] P=[9,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; .claim R > 1; @1",
                "live/cannot", "R"),
    "a wish": (
        ".let R = 50; Arm : .bar O=[0,0] P=[R,0]; @0 Arm.O=[0,0]; Arm.P ~ [0, 50]; @1", "live/cannot", "Arm.P ~ [0, 50]",
    ),
    "an integral": (
        ".let R = 50; Arm : .bar O=[0,0] P=[R,0]; @0 Arm.O=[0,0]; a = .i(60 - a); Arm.angle = a; @1", "live/cannot", "a",
    ),
    "a graph": (
        ".let R = 50; Arm : .bar O=[0,0] P=[R,0]; G : .graph(.t, Arm.P.y) at=[99,99]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1",
        "live/cannot", "G",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_live_is_told_with_its_place(case, tmp_path):
    from PIL import Image

    text, code, place = BAD[case]
    Image.new("RGB", (9, 9)).save(tmp_path / "arm.png")
    with pytest.raises(mv.MovimentumError) as caught:
        mv.loads(text, name=str(tmp_path / "bad.mov")).live("R")
    told = caught.value.diagnostics[0]
    assert told.code == code
    assert told.helps
    if place is not None:
        assert told.span is not None
        assert text[told.span.start : told.span.end].startswith(place)


def follower(script, *names):
    """The page's way, here: from settings to (F,) poses of a thing's origin and direction, or None."""
    from movimentum.living.follow import Follower
    from movimentum.living.program import python

    figure = script.live(*names).figure
    codes = [slider.code for slider in figure.sliders]
    functions = [python(stage, codes) for stage in figure.stages]
    made = Follower(figure.stages, functions, {s.code: s.value for s in figure.sliders}, figure.size)
    return figure, lambda given: made.film(given, figure.times)


def solved(script, given):
    """The motion with these constants, and the first frame without a pose."""
    try:
        motion = script.with_constants(given).solve(on_failure="hold")
    except mv.MovimentumError:  # no inequality holds at the beginning, say
        return None, 0
    return motion, next((k for k, good in enumerate(motion.solved) if not good), len(motion.solved))


@pytest.mark.slow
def test_poses_are_those_of_solve_also_where_it_binds():
    script = mv.loads(FOUR_BAR)
    figure, film = follower(script, "R", "L", "phase")
    chance, numbers = random.Random(1), {thing.name: thing.number for thing in figure.live.scene.things}
    bound = 0
    for _ in range(12):
        given = {"R": chance.uniform(20, 90), "L": chance.uniform(75, 225), "phase": chance.uniform(-90, 90)}
        found = film(given)
        motion, end = solved(script, given)
        assert next((k for k, row in enumerate(found) if row is None), 50) == end
        bound += end < 50
        for name, local in (("Crank.A", (130, 110)), ("Coupler.B", (0, 0)), ("Rocker.C", (0, 0))) if end else ():
            x, y, c, s = figure.places[numbers[name.split(".")[0]]]
            for row, anchor in zip(found[:end], motion[name], strict=False):
                here = row[x] + row[c] * local[0] - row[s] * local[1], row[y] + row[s] * local[0] + row[c] * local[1]
                assert math.dist(here, anchor) < 1e-9
    assert 0 < bound < 12


GEARS = """
.config(10, 400, 320);
.let m = 4;   .let d = 60;   .let h = 40;   .let x = 0.5;   .let f = .acos(x);
Low  : .gear(10, m)  C = [100,100]  T = C + [20,0];
High : .gear(20, m)  C = [100 + d,100]  T = C + [20,0];
Rack : .rack(12, m)  A = [60,180]  B = [200,180];
Wheel : .gear(20, m) C = [140,180 + h]  T = C + [20,0];
Arm : .bar O = [300,100] P = O + [40,0].r(f);
@0 Low.C = [100,100]; High.C = [100 + d,100]; Low.angle = 90*.t; .mesh(Low, High) = 0;
   Rack.A = [60 + 10*.t,180]; Rack.angle = 0; Wheel.C = [140,180 + h]; .mesh(Rack, Wheel) = 0; Arm.O = [300,100]; Arm.angle = 0;
@2
"""


@broad(
    ("given", "fits"),
    [
        ({}, True),
        ({"d": 60.19}, True), ({"d": 60.21}, False), ({"d": 59.81}, True), ({"d": 59.79}, False),
        ({"m": 4.5}, False), ({"m": 4.5, "d": 67.5, "h": 45.0}, True), ({"m": 4.5, "d": 67.5, "h": 45.3}, False),
        ({"h": 40.19}, True), ({"h": 40.21}, False), ({"h": -40.0}, False),
        ({"x": 1.0}, True), ({"x": 1.001}, False),
    ],
    every=4,
)  # fmt: skip
def test_what_solve_refuses_before_it_begins_binds(given, fits):
    """Gears that are too far apart for their teeth, and constants that have no value."""
    script = mv.loads(GEARS)
    figure, film = follower(script, "m", "d", "h", "x")
    own = {slider.name: slider.value for slider in figure.sliders}
    found = film(own | given)
    assert all(row is not None for row in found) is fits
    _motion, end = solved(script, given)
    assert end == (len(found) if fits else 0)


LIVING = {
    "crane": ("r",), "hart": ("L", "S", "q"), "jansen": ("bd", "gi"), "klann": ("u",),
    "planetary": ("m", "arm"), "umbrella": ("rib", "half"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", LIVING)
def test_the_gallery_lives_as_solve_has_it(name):
    """Also just inside and just outside of where it binds."""
    script = mv.load(str(SCRIPTS / f"{name}.mov"))
    names = LIVING[name]
    figure, film = follower(script, *names)
    own = {each: slider.value for each, slider in zip(names, figure.sliders, strict=True)}
    places = {
        f"{thing.name}.{anchor.name}": (thing.number, anchor.local)
        for thing in figure.live.opened().things if thing.is_body
        for anchor in thing.anchors if not is_live(*anchor.local)
    }  # fmt: skip

    def compare(given):
        found = film(given)
        motion, end = solved(script, given)
        assert next((k for k, row in enumerate(found) if row is None), len(found)) == end
        for anchor, (thing, (u, v)) in places.items() if end else ():
            x, y, c, s = figure.places[thing]
            for row, there in zip(found[:end], motion[anchor], strict=False):
                here = row[x] + row[c] * u - row[s] * v, row[y] + row[s] * u + row[c] * v
                assert math.dist(here, there) < 1e-9 * max(1.0, math.dist((0, 0), here) / 100)
        return end == len(found)

    chance, bounds = random.Random(name), script.live(*names).constants
    for _ in range(6):
        far = {each: chance.uniform(*bounds[each]) for each in names}
        if not compare(far):
            low, high = 0.0, 1.0
            for _ in range(26):
                share = 0.5 * (low + high)
                whole = all(film({each: own[each] + share * (far[each] - own[each]) for each in names}))
                low, high = (share, high) if whole else (low, share)
            for share in (low - 1e-6, high + 1e-6):
                compare({each: own[each] + share * (far[each] - own[each]) for each in names})


def test_the_page_needs_nothing_else(tmp_path):
    (tmp_path / "four-bar.mov").write_text(FOUR_BAR, encoding="utf-8")
    done = movimentum("run", "four-bar.mov", "--live", "[R, L]", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "four-bar.html").read_text(encoding="utf-8")
    assert len(page.encode()) <= 150_000
    assert "default-src 'none'" in page
    assert not re.search(r"https?://|\bimport\b|\bfetch\b|XMLHttp", page.replace("@import", ""))
    for arguments, said in (
        (("--live", "Q"), "--live"), (("--live", "R", "-o", "x.gif"), "x.html"),
    ):  # fmt: skip
        done = movimentum("run", "four-bar.mov", *arguments, cwd=tmp_path)
        assert done.returncode == 2
        assert said in done.stderr
        assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".gif"] == []


def test_in_a_notebook():
    figure = mv.loads(FOUR_BAR).live("R", "L")
    assert repr(figure) == "LivingFigure(<string>: R, L)"
    assert figure.constants == {"R": (20.0, 90.0), "L": (75.0, 225.0)}
    assert "data-movimentum-figure" in figure._repr_html_()


SPECS = (
    ".0f",
    ".1f",
    ".3f",
    "+.2f",
    "07.2f",
    ">9.1f",
    "<9.1f",
    "^9.1f",
    ",.1f",
    ".0%",
    ".1%",
    ".2e",
    "g",
    ".3g",
    "",
    "d",
    "x",
)


@pytest.mark.skipif(shutil.which("node") is None, reason="needs Node")
def test_numbers_are_written_as_python_writes_them():
    from movimentum.drawing.texts import number_text

    chance = random.Random(2)
    values = [
        0.0,
        -0.0,
        0.5,
        1.5,
        2.5,
        -0.5,
        0.125,
        0.375,
        1e-7,
        -1e-7,
        123456.789,
        1e21,
        99.95,
        0.05,
        -3.0,
        1e16,
        1e-5,
    ]
    values += [chance.uniform(-1, 1) * 10 ** chance.uniform(-8, 9) for _ in range(300)]
    code = (Path(mv.__file__).parent / "living" / "live.js").read_text(encoding="utf-8")
    functions = code[code.index("/* A number as Python's format writes it") :]
    ask = f"console.log(JSON.stringify({json.dumps(values)}.map((v) => {json.dumps(SPECS)}.map((s) => pythonFormat(v, s)))));"
    done = subprocess.run(["node", "-e", functions + ask], capture_output=True, text=True, check=True)
    for value, texts in zip(values, json.loads(done.stdout), strict=True):
        for spec, text in zip(SPECS, texts, strict=True):
            assert text == number_text(value, spec), (value, spec)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "names"),
    [("", ("R", "L")), ("jansen", ("bd", "gi")), ("umbrella", ("rib", "half")), ("planetary", ("m",))],
)
def test_in_a_browser(name, names, tmp_path, browser):
    script = mv.load(str(SCRIPTS / f"{name}.mov")) if name else mv.loads(FOUR_BAR)
    figure = script.live(*names)
    page_file = figure.save(tmp_path / "live.html")
    chance = random.Random(3)
    page = browser.new_page()
    errors, asked = [], []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(f"file://{page_file}")
    page.evaluate("movimentum.pause()")
    for number in range(100 if not name else 20):
        given = {each: chance.uniform(*figure.constants[each]) for each in names}
        edge = names[number % len(names)]
        if number % 4 == 3:
            bounds = page.evaluate(
                "([v, k]) => { movimentum.set(v); const all = movimentum.intervals(movimentum.live.sliders[k]);"
                " let one; do one = all.next(); while (!one.done); return one.value; }",
                [given, number % len(names)],
            )
            inside = [low + 1e-6 for low, _ in bounds if low > figure.constants[edge][0]]
            given[edge] = next(iter(inside), given[edge])
        got = page.evaluate(
            "(v) => { movimentum.set(v); return movimentum.film.times.map((t) => movimentum.anchorsAt(t)); }", given
        )
        motion, end = solved(script, given)
        assert all(row is not None for row in got[:end])
        for anchor in got[0] or {}:
            if end and "." in anchor and not anchor.startswith("Turn"):
                here = np.array([row[anchor] for row in got[:end]])
                assert np.abs(here - motion[anchor][:end]).max() < 1e-9 * max(1.0, math.dist((0, 0), here[0]) / 100)
    page.locator(f'[data-testid="slider-{names[0]}"]').focus()
    before = page.evaluate("movimentum.state().constants")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("movimentum.state().constants") != before
    assert not errors
    assert all(url.startswith(("file:", "data:")) for url in asked)
    page.close()
