"""Where an outline is nearest to a moving point, against points sampled and refined with SciPy."""

import random
from fractions import Fraction

import numpy as np
from scipy.optimize import minimize_scalar

from movimentum.certifying.certificate import certificate
from movimentum.certifying.forms import TimeForm
from movimentum.certifying.nearest import nearest_place
from movimentum.expressions import walk
from movimentum.outlines.nearest import Nearest
from movimentum.proving.film import lowered
from movimentum.query import reader
from tests.broad import broad
from tests.certifying.test_certificates import film

SHAPES = (
    "Shape : .polygon A = [100,100] B = [250,110] C = [260,220] D = [120,200];",
    "Shape : .polygon A = [100,100] B = [250,110] C = [180,150] D = [260,220] E = [120,200];",
    "Shape : .curve A = [180,160] .polar(th, 60 + {a}*.cos(3*th) + {b}*.sin(2*th));",
    "Shape : .curve A = [180,160] .param(u, [80*.cos(u), {c}*.sin(u)]);",
)
CONVEX = (0, 3)
FILM = """.config(8, 400, 320);
{shape}
Dot : .disc(3) O = [40,50];
@0 Shape.A = [180,160]; Shape.angle = 20*.t; Dot.O = [{x},{y}] + [{r},0].r({w}*.t);
   .claim .on(Dot.O, Shape) {claim};
@2
"""


def certified(text):
    motion = film(text)
    return motion, certificate(motion)


def touch_of(motion):
    claim = motion.timeline.claims[0].claim
    sides = lowered(motion.segments[0], [*claim.left, *claim.right])
    return next(node.payload for node in walk(*sides) if isinstance(node.payload, Nearest))


def nearest(contour, x, y):
    """The least distance, by SciPy."""
    places = np.linspace(contour.first, contour.last, 4000)
    off = np.hypot(*(contour.points(places) - [x, y]).T)
    found = []
    for k in np.argsort(off)[:8]:
        step = (contour.last - contour.first) / 4000
        one = minimize_scalar(
            lambda u: float(np.hypot(*(contour.points(np.array(u)) - [x, y]))),
            bounds=(places[k] - step, places[k] + step), method="bounded", options={"xatol": 1e-12})  # fmt: skip
        found.append((one.fun, one.x))
    return min(found)


@broad("seed", range(24), first=1)
def test_the_place_is_enclosed(seed):
    chance = random.Random(seed)
    shape = SHAPES[seed % len(SHAPES)].format(a=chance.randint(2, 12), b=chance.randint(2, 9), c=chance.randint(30, 70))
    text = FILM.format(shape=shape, x=200, y=160, r=120, w=90, claim=">= -1000")
    motion = film(text)
    touch, count = touch_of(motion), 40
    contour = touch.first
    width = 10.0 ** chance.uniform(-6, 0.3)
    x, y = (np.array([chance.uniform(-150, 150) for _ in range(count)]) for _ in range(2))
    sx, sy = (width * np.array([chance.uniform(-1, 1) for _ in range(count)]) for _ in range(2))
    r = np.full(count, width**2)
    place, _ = nearest_place(touch, TimeForm(x, sx, r), TimeForm(y, sy, r), {})
    known = np.isfinite(place.r)
    assert known.mean() > (0.6 if width < 0.1 else 0.2)
    for k in np.flatnonzero(known):
        for u in (-1.0, 0.3, 1.0):
            px, py = x[k] + u * sx[k] + r[k] * chance.uniform(-1, 1), y[k] + u * sy[k] + r[k] * chance.uniform(-1, 1)
            least, _ = nearest(contour, px, py)
            low, high = place.c[k] + u * place.s[k] - place.r[k], place.c[k] + u * place.s[k] + place.r[k]
            inside = np.hypot(*(contour.points(np.linspace(low, high, 2001)) - [px, py]).T)
            fine = (high - low) / 2000 * 3.0
            assert inside.min() <= least + 1e-6 + fine, (k, u)


@broad("seed", range(8), first=1)
def test_bounds_on_distances_are_proved_where_they_hold_and_only_there(seed):
    chance = random.Random(100 + seed)
    shape = SHAPES[seed % len(SHAPES)].format(a=chance.randint(2, 12), b=chance.randint(2, 9), c=chance.randint(30, 70))
    where = {"x": chance.randint(160, 220), "y": chance.randint(140, 190), "r": chance.randint(20, 150),
             "w": chance.randint(40, 170)}  # fmt: skip
    motion = film(FILM.format(shape=shape, claim=">= -1000", **where))
    held = motion.timeline.claims[0]
    times = np.linspace(0.0, 2.0, 4001)
    values = reader(motion.timeline.scene, held.claim.left)(
        motion.poses_at([Fraction(time) for time in times.tolist()])
    )[0]
    least = float(values.min())
    alone = least > 0.0 and seed % len(SHAPES) in CONVEX  # no two places are as near
    for slack, verdict in ((0.05, "proved"), (-0.05, "false")):
        _, found = certified(FILM.format(shape=shape, claim=f">= {least - slack:.6f}", **where))
        (bound,) = found.bounds
        assert bound.verdict.value in ((verdict,) if alone else (verdict, "undecided"))


@broad("tolerance", [0.001, 1e-6], first=1)
def test_wankels_corners_stay_on_the_housing(tolerance):
    text = """.config(25, 360, 320);
.let e = 16; .let R = 112; .let O = [180,160];
Housing : .curve    O = O   .param(u, [e*.cos(3*u) + R*.cos(u), e*.sin(3*u) + R*.sin(u)]);
Rotor   : .polygon  C = O + [e,0]   P[k = 0..2] = C + [R,0].r(120*k)   .through(P);
Axle    : .disc(10) C = O   P = O + [e,0];
@0  Housing.O = O;   Housing.angle = 0;
    Axle.C = O;   Axle.angle = 540*.t; Rotor.C = Axle.P;   Rotor.angle = Axle.angle/3;
    .claim .abs(.on(Rotor.P[1], Housing)) < TOL;
@0.1
""".replace("TOL", f"{tolerance:.6f}")
    _, found = certified(text)
    assert [bound.verdict.value for bound in found.bounds] == ["proved"]
