"""Things with several outlines: the nearest counts where something rolls or lies on them, and all of them cut."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum
from tests.broad import broad

HEAD = ".config({fps}, 400, 400);\n"


def loaded(text, fps=10):
    return movimentum.loads(HEAD.format(fps=fps) + text)


RINGS = {
    "ring": "Ring : .ring(110, {hole}) C = [200,200];",
    "body": "Disc : .disc(110) C = [200,200]; Hole : .disc({hole}) C = [200,200]; .body Ring = Disc - Hole;",
}


@pytest.mark.parametrize("ring", RINGS)
@broad(("hole", "radius"), [(80, 30), (90, 12.5), (60, 45)], first=1)
@pytest.mark.parametrize("fps", [7, 20])
def test_a_wheel_rolls_inside_of_a_ring(ring, hole, radius, fps):
    far = hole - radius
    script = loaded(f"""{RINGS[ring].format(hole=hole)}
W : .disc({radius}) C = [{200 + far},200] P = [{205 + far},200];
@0 Ring.C = [200,200]; Ring.angle = 20*.t; W.C = [200,200] + [{far},0].r(90*.t); .roll(W, Ring) = 0;
   .claim .roll(W, Ring) = 0; g = .gap(W, Ring);
@9""", fps)  # fmt: skip
    motion = script.solve()
    # seen from its arm the wheel turns as much faster than the ring as it is smaller
    truth = 90.0 * motion.times + (20.0 - 90.0) * motion.times * hole / radius
    assert motion["W.angle"] == pytest.approx(truth, abs=1e-7)
    assert motion["g"] == pytest.approx(0.0, abs=1e-9)


@broad("ring", RINGS, first=1)
def test_a_wheel_rolls_around_the_outside_of_a_ring(ring):
    motion = loaded(f"""{RINGS[ring].format(hole=80)}   W : .disc(20) C = [330,200] P = [340,200];
@0 Ring.C = [200,200]; Ring.angle = 0; W.C = [200,200] + [130,0].r(90*.t); .roll(W, Ring) = 0;
@9""").solve()
    assert motion["W.angle"] == pytest.approx(90.0 * motion.times * (1.0 + 110.0 / 20.0), abs=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_where_is_told_on_the_nearest_outline(seed):
    random = np.random.default_rng(seed)
    radii = np.round(random.uniform(15.0, 40.0, 3), 3)
    text = " ".join(f"K{k} : .disc({r}) C = [{100 * (k + 1)},100];" for k, r in enumerate(radii))
    motion = loaded(f"""{text} .body Three = K0 + K1 + K2;   P : .disc(3) P = [20,90];
@0 Three.C = [100,100]; Three.angle = 0; P.P = [20 + 90*.t, 90 + 30*.sin(100*.t)]; w = .where(P.P, Three);
@4""", 25).solve()  # fmt: skip
    centres = np.array([[100.0, 100.0], [200.0, 100.0], [300.0, 100.0]])
    way = motion["P.P"][:, None] - centres
    off = np.abs(np.hypot(*np.moveaxis(way, -1, 0)) - radii)
    nearest = np.argmin(off, axis=1)
    clear = np.sort(off, axis=1)[:, 1] - off.min(axis=1) > 1e-6
    chosen = way[np.arange(len(way)), nearest]
    angle = np.mod(np.arctan2(chosen[:, 1], chosen[:, 0]) / (2.0 * np.pi), 1.0)
    # outlines of bodies begin anywhere: how far it goes along one of them is that of its angle
    for k in range(3):
        here = clear & (nearest == k)
        turned = np.mod(motion["w"][here] - angle[here] + 0.5, 1.0)
        backwards = np.mod(motion["w"][here] + angle[here] + 0.5, 1.0)
        assert min(np.ptp(turned), np.ptp(backwards)) < 1e-9


def test_where_of_a_disc_is_its_angle():
    motion = loaded("""D : .disc(50) C = [100,100];   P : .disc(3) P = [160,100];
@0 D.C = [100,100]; D.angle = 30*.t; P.P = [100,100] + [60,0].r(70*.t); w = .where(P.P, D);
@4""").solve()
    assert motion["w"] == pytest.approx(np.mod(40.0 * motion.times / 360.0, 1.0), abs=1e-9)


@pytest.mark.slow
def test_all_outlines_of_a_body_cut():
    """Two rollers that are one tool leave what both of them leave: the nearer edge in each direction."""
    law = "10*.sin(360*.t) + 4*.cos(720*.t)"
    cams = "A : .cut R1 .in S .hidden;  B : .cut R2 .in S .hidden;  Both : .cut Tool .in S;"
    text = f"""U1 : .disc(12) C = [200,260];   U2 : .disc(8) C = [200,40];   .body Tool = U1 + U2;
R1 : .disc(12) C = [200,260];   R2 : .disc(8) C = [200,40];   S : .disc(3) C = [200,150] P = [210,150];   {cams}
@0 S.C = [200,150]; S.angle = 360*.t; Tool.C = [200, 260 + {law}]; Tool.angle = 0; R1.C = Tool.C; R1.angle = 0;
   R2.C = Tool.C - [0,220]; R2.angle = 0;
@1"""
    from movimentum.scene.outlines import outline_of
    from tests.understand import timeline_of

    scene = timeline_of(HEAD.format(fps=10) + text).scene
    radius = {}
    angles = np.linspace(-3.1, 3.1, 400)
    for thing in scene.things:
        if thing.kind.word == "cut":
            outline = outline_of(thing)
            x, y = outline.points(np.linspace(outline.first, outline.last, 40_001)).T
            turn, far = np.arctan2(y, x), np.hypot(x, y)
            order = np.argsort(turn)
            radius[thing.name] = np.interp(angles, turn[order], far[order])
    truth = np.minimum(radius["A"], radius["B"])
    assert (radius["A"] < radius["B"]).any()
    assert (radius["B"] < radius["A"]).any()
    assert radius["Both"] == pytest.approx(truth, abs=1e-3)
