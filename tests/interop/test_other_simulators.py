"""PMKS' text files and files of the program Linkage: what they mean, by closed forms, and what is wrong with them."""

from __future__ import annotations

import math
import random
from contextlib import suppress

import numpy as np
import pytest

from movimentum.errors import ScriptError
from movimentum.interop.linkage2 import linkage2_script, read_linkage2
from movimentum.interop.pmks import pmks_script, read_pmks
from movimentum.interop.recognised import FileKind, kind_of
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, understand
from tests.command import movimentum


def motion_of(text: str) -> PathMotion:
    source = SourceText("file", text)
    if kind_of(source) is FileKind.PMKS:
        script, found = pmks_script(read_pmks(source), "file")
    else:
        mechanism, found = read_linkage2(source)
        script = linkage2_script(mechanism, "file")
    assert found == ()
    return moved(arranged(understand(SourceText("imported.mov", script)), Choices()))


def frames(motion: PathMotion) -> int:
    return motion.timeline.frame_count


def values(motion: PathMotion, *names: str) -> list[np.ndarray]:
    """Anchors (F, 2) and angles (F,) in all frames."""
    poses = motion.poses(0, frames(motion))
    found = []
    for name in names:
        thing, _, rest = name.partition(".")
        body = next(each for each in motion.timeline.scene.things if each.name == thing)
        if rest == "angle":
            found.append(poses.angle[body.number])
        else:
            anchor = next(each for each in body.anchors if each.name == rest)
            found.append(poses.world(body.number, anchor.local))
    return found


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("style", ["mech=\n{},{},R,{},{},0.000,tfff", "{} {} r {} {}", "{}, {},R,{},{},+---"])
def test_four_bars_of_pmks(seed: int, style: str) -> None:
    made = random.Random(seed)
    crank, far = made.uniform(20, 40), made.uniform(100, 140)
    coupler, rocker = made.uniform(90, 120), made.uniform(80, 120)
    along = (crank**2 - crank**2 + 0.0, far - crank)
    d = along[1]
    x = (d * d + coupler**2 - rocker**2) / (2 * d)
    y = math.sqrt(coupler**2 - x * x)
    joints = [("ground", "in", 0, 0), ("in", "mid", crank, 0), ("mid", "out", crank + x, y), ("out", "Ground0", far, 0)]
    head, _, line = style.rpartition("\n")
    lines = [line.format(*joint) for joint in joints]
    motion = motion_of("\n".join([*([head] if head else []), *lines]) + "\n")
    p, q = values(motion, "in.P1", "mid.P2")
    (turn,) = values(motion, "in.angle")
    assert p == pytest.approx(crank * np.stack([np.cos(np.radians(turn)), np.sin(np.radians(turn))], axis=1), abs=1e-9)
    assert np.hypot(*(q - p).T) == pytest.approx(coupler, rel=1e-12)
    assert np.hypot(*(q - [far, 0]).T) == pytest.approx(rocker, rel=1e-12)
    assert q[0] == pytest.approx([crank + x, y], rel=1e-12)
    assert turn[-1] == pytest.approx(360.0)


def test_slots_of_pmks_belong_to_the_first_link() -> None:
    quick = "ground,input,R,0,0.00\ncoupler input,RP,2,0.00,0.00\ncoupler,ground,R,5,0.00\ncoupler,r,-4,0.00\n"
    pin, tip = values(motion_of(quick), "input.P1", "coupler.P3")
    away = pin - [5.0, 0.0]
    assert tip == pytest.approx([5.0, 0.0] + 9.0 * away / np.hypot(*away.T)[:, None], abs=1e-9)
    crank = "ground,input,R,0,0.00\ninput,coupler,R,0,10\ncoupler,output,R,12,2.00\nground,output,P,12,0.00,0.00\n"
    slide, turn = values(motion_of(crank), "output.P2", "output.angle")
    assert slide[:, 1] == pytest.approx(2.0, abs=1e-12)
    assert turn == pytest.approx(0.0, abs=1e-9)


def test_a_driven_slider_of_pmks() -> None:
    motion = motion_of("ground,block,P,0,0,30,tfft\nblock,rod,R,0,0\nrod,arm,R,80,10\narm,ground,R,90,60\n")
    (place,) = values(motion, "block.P0")
    along = place @ [math.cos(math.radians(30)), math.sin(math.radians(30))]
    assert np.ptp(along) > 5.0
    assert np.abs(place @ [-math.sin(math.radians(30)), math.cos(math.radians(30))]).max() < 1e-9


@pytest.mark.parametrize("seed", range(8))
def test_planetary_gears_of_pmks(seed: int) -> None:
    made = random.Random(seed)
    sun, planet = made.uniform(2, 9), made.uniform(1, 5)
    arm, ring = sun + planet, sun + 2 * planet
    text = (
        f"ground,sun,arm,R,0,0.00\narm,planet,R,{arm!r},0.00\nsun,planet,G,{sun!r},0.00\n"
        f"planet,gnd,G,{ring!r},0.00\nplanet,R,{arm!r},1\n"
    )
    motion = motion_of(text)
    turned, carried, rolled = values(motion, "sun.angle", "arm.angle", "planet.angle")
    assert carried == pytest.approx(turned / (1.0 + ring / sun), abs=1e-9)
    assert rolled - carried == pytest.approx(-(turned - carried) * sun / planet, abs=1e-9)


XML = '<linkage2>\n<program zoom="1" units="Millimeters"/>\n{}</linkage2>\n'


def connector(number: int, x: float, y: float, more: str = "", inside: str = "") -> str:
    return f'<connector id="{number}" x="{x!r}" y="{y!r}" {more}>{inside}</connector>\n'


def link(number: int, members: list[int], more: str = "") -> str:
    return f'<Link id="{number}" {more}>' + "".join(f'<connector id="{m}"/>' for m in members) + "</Link>\n"


def test_inputs_of_linkage_turn_clockwise() -> None:
    text = XML.format(
        connector(0, 0, 0, 'anchor="true" input="true" rpm="30"')
        + connector(7, 40, 0, 'draw="true"')
        + connector(8, 130, 20)
        + connector(9, 120, -70, 'anchor="true"')
        + link(0, [0, 7], 'name="my crank"')
        + link(1, [7, 8])
        + link(2, [8, 9])
    )
    motion = motion_of(text)
    turn, p, q = values(motion, "my_crank.angle", "my_crank.P1", "Link1.P2")
    times = np.arange(frames(motion)) / 24.0
    assert turn == pytest.approx(-180.0 * times, abs=1e-9)
    assert frames(motion) == 2 * 24 + 1
    assert np.hypot(*(q - p).T) == pytest.approx(math.hypot(90, 20), rel=1e-12)
    assert np.hypot(*(q - [120, -70]).T) == pytest.approx(math.hypot(10, 90), rel=1e-12)
    assert any(thing.name == "Path1" for thing in motion.timeline.scene.things)


@pytest.mark.parametrize(("kind", "sign"), [("gears", -1.0), ("chain", 1.0)])
def test_ratios_of_linkage(kind: str, sign: float) -> None:
    text = XML.format(
        connector(0, 0, 0, 'anchor="true" input="true" rpm="10"')
        + connector(1, 100, 0, 'anchor="true"')
        + connector(2, 120, 30)
        + link(4, [0], 'gear="true"')
        + link(5, [1, 2], 'gear="true"')
        + f'<ratios><ratio type="{kind}" sizeassize="false"><link id="4" size="20"/>'
        + '<link id="5" size="50"/></ratio></ratios>'
    )
    first, second = values(motion_of(text), "Link4.angle", "Link5.angle")
    assert second == pytest.approx(sign * 0.4 * first, abs=1e-9)
    assert np.ptp(first) == pytest.approx(360.0)


@pytest.mark.parametrize("cpm", [15.0, -6.0])
def test_actuators_of_linkage_go_there_and_back(cpm: float) -> None:
    text = XML.format(
        connector(0, 0, 0, 'anchor="true"')
        + connector(1, 100, 0, 'anchor="true"')
        + connector(2, 60, 80)
        + link(0, [0, 2], f'actuator="true" throw="20" cpm="{cpm}"')
        + link(1, [1, 2], 'name="arm"')
    )
    motion = motion_of(text)
    (tip,) = values(motion, "arm.P2")
    phase = (np.arange(frames(motion)) / 24.0) * abs(cpm) / 60.0 % 1.0
    truth = 100.0 + math.copysign(20.0, cpm) * (1.0 - np.abs(1.0 - 2.0 * phase))
    assert np.hypot(*tip.T) == pytest.approx(truth, abs=1e-9)


def test_sliders_of_linkage() -> None:
    ends = '<slidelimit id="4"/><slidelimit id="5"/>'
    text = XML.format(
        connector(0, 71, -72, 'anchor="true" input="true" rpm="15"')
        + connector(1, 72, -48.5, 'slider="true"', ends)
        + connector(4, -59, -71, 'anchor="true"')
        + connector(5, 203, -26)
        + link(0, [0, 1])
        + link(2, [4, 5])
    )
    pin, end = values(motion_of(text), "Link0.P1", "Link2.P3")
    a, b = pin - [-59, -71], end - [-59, -71]
    assert a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] == pytest.approx(0.0, abs=1e-8)
    assert np.hypot(*(pin - [71, -72]).T) == pytest.approx(math.hypot(1, 23.5), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("a.txt", "ground,input,R,0,0\nwhat is this\n", "pmks/joint"),
        ("a.txt", "ground,input,R,0,1e200\n", "pmks/joint"),
        ("a.txt", "ground,a,R,0,0\na,b,c,P,3,4\n", "pmks/joint"),
        ("a.txt", "ground,a,R,0,0\na,b,G,3,4\n", "pmks/gear"),
        ("a.linkage2", "<linkage2><connector", "linkage2/syntax"),
        ("a.linkage2", "<linkage2></linkage2>", "linkage2/empty"),
        ("a.linkage2", '<linkage2><connector id="0" x="none" y="0"/></linkage2>', "linkage2/syntax"),
        ("a.linkage2", '<linkage2><!ENTITY a "b"></linkage2>', "linkage2/syntax"),
    ],
)
def test_what_is_wrong_is_told(name: str, text: str, code: str) -> None:
    source = SourceText(name, text)
    with pytest.raises(ScriptError) as caught:
        if kind_of(source) is FileKind.PMKS:
            pmks_script(read_pmks(source), name)
        else:
            read_linkage2(source)
    assert caught.value.diagnostics[0].code == code


def odd_pmks(made: random.Random) -> str:
    links = ["ground", "gnd", "a", "b", "1", "ä", "Ground0", "t"]
    lines = []
    for _ in range(made.randint(1, 6)):
        words = [*made.sample(links, made.randint(1, 3)), made.choice(["R", "R", "P", "RP", "G", "r"])]
        words += [str(made.choice([0, 1, -3.5, 1e9, 7])) for _ in range(made.randint(2, 3))]
        words += made.choices(["tfft", "+--+", "true", "x"], k=made.randint(0, 2))
        lines.append(made.choice([",", " ", ", "]).join(words))
    return "\n".join(lines)


def odd_linkage2(made: random.Random) -> str:
    flags = ['anchor="true"', 'input="true" rpm="15"', 'slider="true"', 'draw="true"', 'name="ä b"', 'slideradius="3"']
    parts = []
    for n in range(made.randint(1, 5)):
        limits = "".join(f'<slidelimit id="{made.randint(0, 5)}"/>' for _ in range(made.choice([0, 0, 2])))
        parts.append(connector(n, made.uniform(-9, 9), made.randint(0, 3), " ".join(made.sample(flags, 2)), limits))
    words = ['actuator="true" throw="2" cpm="3"', 'gear="true"', 'name="a"', "", 'fastenlink="0"']
    count = made.randint(0, 4)
    parts += [link(n, made.choices(range(6), k=made.randint(0, 4)), made.choice(words)) for n in range(count)]
    ratio = f'<link id="{made.randint(0, 4)}" size="{made.randint(0, 3)}"/>' * made.randint(0, 3)
    return XML.format("".join(parts) + f"<ratios><ratio>{ratio}</ratio></ratios>" * made.randint(0, 1))


@pytest.mark.parametrize("make", [odd_pmks, odd_linkage2])
def test_an_odd_file_is_told_or_a_script(make) -> None:
    made = random.Random(5)
    good = 0
    for _ in range(150):
        text = make(made)
        source = SourceText("odd", text)
        with suppress(ScriptError):
            if make is odd_pmks:
                script, _ = pmks_script(read_pmks(source), "odd")
            else:
                script = linkage2_script(read_linkage2(source)[0], "odd")
            assert kind_of(source) in (FileKind.PMKS, FileKind.LINKAGE2)
            errors = []
            try:
                understand(SourceText("odd.mov", script))
            except ScriptError as error:
                errors = [item.message for item in error.diagnostics]
            assert errors == [], f"{text}\n{script}"
            good += 1
    assert good > 40


def test_sketches_of_solvespace_are_named(tmp_path) -> None:
    path = tmp_path / "crank.slvs"
    path.write_bytes(b"\xb1\xb2\xb3SolveSpaceREVa\n\n\nGroup.h.v=00000001\n")
    for command in (["import", path, "-o", "-"], ["check", path]):
        done = movimentum(*command)
        assert done.returncode == 1
        assert "sketch of SolveSpace" in done.stderr + done.stdout
