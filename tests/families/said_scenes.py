"""Random scenes for what is said: mechanisms grown from a known pose, drawn in it, moved as a whole, or drawn open."""

from __future__ import annotations

import cmath
import math
import random
from dataclasses import dataclass


@dataclass(frozen=True)
class Linkage:
    """``text`` has ``{more}`` for further statements of its first step; ``dyads`` hang on each other in a chain."""

    text: str
    dyads: int
    things: tuple[str, ...]


def number(value: float) -> str:
    return repr(round(value, 9) + 0.0)


def point(z: complex) -> str:
    return f"[{number(z.real)}, {number(z.imag)}]"


def linkage(seed: int, drawn: str) -> Linkage:
    """A crank and one or two dyads.

    ``drawn``: "closed" (as it begins), "moved" (the same, but the pins are stated elsewhere and turned), "open" (each
    coupler is drawn turned by 40 to 140 degrees about its first joint, and set aside).
    """
    r = random.Random(seed)
    dyads = r.choice((1, 1, 2))
    move, turn = complex(0), 0.0
    if drawn == "moved":
        move, turn = complex(r.uniform(-300, 300), r.uniform(-300, 300)), r.uniform(-170, 170)
    rotation = cmath.rect(1.0, math.radians(turn))

    def stated(z: complex) -> str:
        return point(rotation * z + move)

    crank = cmath.rect(r.uniform(25, 40), r.uniform(-3, 3))
    things = [f"Crank : .bar O=[0,0] P={point(crank)};"]
    angle = f"{number(turn)} + 2*.t" if turn else "2*.t"
    statements = [f"Crank.O = {stated(0)};", f"Crank.angle = {angle};"]
    joint, name = crank, "Crank.P"
    for k in range(dyads):
        while True:
            pivot = joint + cmath.rect(r.uniform(90, 160), r.uniform(-3, 3))
            knee = joint + cmath.rect(r.uniform(70, 130), r.uniform(-3, 3))
            u, v = knee - joint, knee - pivot
            if abs(v) > 50 and abs((u.conjugate() * v).imag) > 0.5 * abs(u) * abs(v):
                break
        corner = knee + cmath.rect(r.uniform(20, 60), r.uniform(-3, 3))
        if drawn == "open":
            away = cmath.rect(1.0, math.radians(r.choice((-1, 1)) * r.uniform(40, 140)))
            aside = complex(r.uniform(-90, 90), r.uniform(-90, 90))
            places = [aside + away * (z - joint) for z in (joint, knee, corner)]
        else:
            places = [joint, knee, corner]
        a, b, c = map(point, places)
        things += [f"L{k} : .bar A={a} B={b} C={c};", f"R{k} : .bar O={point(pivot)} P={point(knee)};"]
        statements += [f"L{k}.A = {name};", f"R{k}.O = {stated(pivot)};", f"R{k}.P = L{k}.B;"]
        joint, name = corner, f"L{k}.C"
    if r.random() < 0.5:  # what only hangs on has no say, wherever it is drawn
        things.append("Mark : .disc(4) O=[0,0];")
        statements.append(f"Mark.O = {name};")
    order = list(range(len(statements)))
    r.shuffle(order)
    text = ".config(10);\n" + "\n".join(things) + "\n@0 " + " ".join(statements[i] for i in order) + " {more}\n@1"
    return Linkage(text, dyads, tuple(t.split()[0] for t in things))


def cylinder(seed: int) -> str:
    """A boom held by a cylinder in polar form, drawn as people draw: every thing level at its own origin."""
    r = random.Random(seed)
    while True:
        base, pivot = complex(r.uniform(50, 120), r.uniform(50, 120)), complex(r.uniform(180, 260), r.uniform(50, 150))
        arm, length = r.uniform(60, 110), r.uniform(60, 160)
        if abs(arm - length) + 15 < abs(pivot - base) < arm + length - 15:
            break
    return f""".config(10);
    Cyl : .bar A=[0,0] C=[60,0]; Boom : .bar O=[0,0] E=[{arm:.3f},0] F=[120,10];
    @0 Cyl.A={point(base)}; Boom.O={point(pivot)}; Boom.E = Cyl.A + [c,0].r(Cyl.angle); c = {length:.3f};
    @1"""


def tied(seed: int) -> tuple[str, float]:
    """Two floating bars whose angles differ by a stated number, and that number."""
    r = random.Random(seed)
    apart = round(r.uniform(-150, 150), 2)
    ends = complex(r.uniform(60, 110), r.uniform(-60, 60))
    return (
        f""".config(10);
    A : .bar P=[0,0] Q=[70,0]; B : .bar P=[0,0] Q=[65,0]; S : .bar P=[0,0] Q=[200,0];
    @0 A.P = [0,0]; B.P = A.Q; B.angle - A.angle = {apart};
       S.P = {point(ends)}; S.Q = [x, 0]; B.Q.x = {ends.real / 2:.3f};
    @1""",
        apart,
    )


def turning(seed: int) -> tuple[str, float, float]:
    """A thing of one anchor whose angle is restated at t = 1: (script, jump in degrees, turn in a frame)."""
    r = random.Random(seed)
    speed, fps = r.uniform(-400, 400), r.choice((5, 12, 25))
    jump = r.choice((0.0, r.uniform(-179, 179), 0.5 * speed / fps, 360.0, 4.0 * speed / fps))
    shape = r.choice((".disc(9)", "'a.png'", ".label('a')"))
    place = "[50,50]" if r.random() < 0.5 else "[50 + 3*.T, 50]"
    text = f""".config({fps}); W : {shape} O=[10,10];
    @0 W.O = {place}; W.angle = {speed!r}*.t;
    @1 W.angle = {speed + jump!r} + {speed!r}*.t;
    @2"""
    return text, jump, speed / fps


def loose(seed: int) -> str:
    """A chain with some freedom, variables that nothing determines, and inequalities about them."""
    r = random.Random(seed)
    count = r.randint(1, 3)
    things = [f"B{k} : .bar P=[{60 * k},0] Q=[{60 * k + 50},{r.randint(-30, 30)}];" for k in range(count)]
    statements = ["B0.P = [10,20];"] + [f"B{k}.P = B{k - 1}.Q;" for k in range(1, count)]
    if r.random() < 0.5:
        statements.append(f"B0.angle = {r.randint(-30, 30)};")
    if r.random() < 0.6:
        things.append("Bob : .disc(4) O=[0,0];")
        statements.append(f"Bob.O = [{r.randint(-80, 80)}, s];")
        low = r.randint(-200, 60)
        if low < 0:
            statements.append(f"s > {low};")
    else:
        statements += [f"s > {r.randint(-60, -1)};", f"s < {r.randint(5, 60)};", "u = 2*s;"]
    if r.random() < 0.5:
        statements.append(f"B{count - 1}.Q.y < {r.randint(100, 300)};")
    return f".config(10);\n{' '.join(things)}\n@0 {' '.join(statements)} {{more}}\n@1"
