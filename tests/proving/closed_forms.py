"""Random scripts with random claims, and where everything is by closed formulas in mpmath, on every branch.

Nothing here reads the program's own equations: a family knows its points as formulas of its drive and of its choices of
sides, and a claim is a tree that writes itself as text, and evaluates itself with 60 digits.
"""
# ruff: noqa: E501

from __future__ import annotations

import itertools
import random
from fractions import Fraction

from mpmath import mp, mpc, mpf

DIGITS = 100


class Node:
    """An expression: its text, and its value for an environment (names to complex numbers, or numbers)."""

    def __init__(self, text, value):
        self.text, self.value = text, value

    def __str__(self):
        return self.text


def _wrapped(node):
    return node.text if node.text.replace(".", "").replace("_", "").isalnum() else f"({node.text})"


def binary(op, a, b):
    calls = {"+": lambda x, y: x + y, "-": lambda x, y: x - y, "*": lambda x, y: x * y, "/": lambda x, y: x / y}
    return Node(f"{_wrapped(a)} {op} {_wrapped(b)}", lambda env: calls[op](a.value(env), b.value(env)))


def number(text):
    value = Fraction(text)
    return Node(text, lambda env: mpf(value.numerator) / value.denominator)


def square(a):
    return Node(f"{_wrapped(a)}^2", lambda env: a.value(env) ** 2)


def call(name, function, *args):
    return Node(f".{name}({', '.join(map(str, args))})", lambda env: function(*(arg.value(env) for arg in args)))


def root(a):
    return call("sqrt", lambda x: mp.sqrt(x) if x >= 0 else mp.nan, a)


def cosine(a):
    return call("cos", lambda x: mp.cos(x * mp.pi / 180), a)


def sine(a):
    return call("sin", lambda x: mp.sin(x * mp.pi / 180), a)


def absolute(a):
    return call("abs", abs, a)


def x_of(name):
    return Node(f"{name}.x", lambda env: mp.re(env[name]))


def y_of(name):
    return Node(f"{name}.y", lambda env: mp.im(env[name]))


def angle(name):
    return Node(f"{name}.angle", lambda env: env[f"{name}.angle"])


def length(a, b):
    return Node(f"({a} - {b}).l", lambda env: abs(env[a] - env[b]))


def across(p, a, b):
    def value(env):
        u, v = env[b] - env[a], env[p] - env[a]
        return mp.im(mp.conj(u) * v) / abs(u)

    return Node(f".across({p}, {a}, {b})", value)


def along(p, a, b):
    def value(env):
        u, v = env[b] - env[a], env[p] - env[a]
        return mp.re(mp.conj(u) * v) / abs(u)

    return Node(f".along({p}, {a}, {b})", value)


def dot(p, q, r, s):
    """(q - p) . (s - r)."""
    return Node(
        f"({q}.x - {p}.x)*({s}.x - {r}.x) + ({q}.y - {p}.y)*({s}.y - {r}.y)",
        lambda env: mp.re(mp.conj(env[q] - env[p]) * (env[s] - env[r])),
    )


def cross(p, q, r, s):
    return Node(
        f"({q}.x - {p}.x)*({s}.y - {r}.y) - ({q}.y - {p}.y)*({s}.x - {r}.x)",
        lambda env: mp.im(mp.conj(env[q] - env[p]) * (env[s] - env[r])),
    )


# --- families: script, drive's range in the film, where all is for (drive, choices), number of choices


class Family:
    """``head``: definitions and statements, with a hole for claims; ``poses(drive, signs)``: the environment, or None;
    ``drive(t)``: in degrees or so, exactly; ``end``: of the film; ``choices``: how many signs; ``claims``: true ones to
    begin with, as (left, right).
    """

    def __init__(self, head, poses, drive, end, choices, claims, points, angles=()):
        self.head, self.poses, self.drive, self.end = head, poses, drive, end
        self.choices, self.claims, self.points, self.angles = choices, claims, points, angles

    def script(self, claims):
        lines = "".join(f"   .claim {left} = {right};\n" for left, right in claims)
        return f".config(8, 420, 320);\n{self.head.replace('CLAIMS', lines)}@{self.end}\n"


def turned(degrees):
    return mp.expjpi(degrees / 180)


def meeting(p, r, q, s, side):
    """Where circles meet: on the left of p -> q for side 1."""
    d = q - p
    square_of = abs(d) ** 2
    if square_of == 0:
        return None
    share = (square_of + r * r - s * s) / (2 * square_of)
    rest = r * r / square_of - share * share
    if rest < 0:
        return None
    return p + d * (share + side * mpc(0, 1) * mp.sqrt(rest))


def drive_of(chance):
    base, rate = chance.randint(-180, 180), chance.choice((20, 30, 45, 60, 90, -40, 36))
    return base, rate, f"{base} + {rate}*.t", lambda t: mpf(base) + rate * t


def four_bar(chance):
    kind = chance.random()
    if kind < 0.6:
        a, b, c, d = chance.randint(25, 45), chance.randint(90, 130), chance.randint(80, 120), chance.randint(100, 140)
    else:  # a parallelogram, a kite, or flat in one pose
        a, d = chance.randint(40, 70), chance.randint(90, 140)
        b, c = chance.choice(((d, a), (a, d), (d + 10, a + 10), (d - a // 2, a // 2)))
    px, py = chance.randint(-40, 100), chance.randint(10, 70)
    _base, _rate, text, drive = drive_of(chance)
    side = chance.choice((">", "<"))
    end = chance.choice((1, 2))
    head = f"""Crank : .bar A = [120,140] B = A + [{a},0];
Coupler : .plate B = [0,0] P = B + [{px},{py}] C = B + [{b},0];
Rocker : .bar D = [120 + {d},140] C = D + [{c},0];
@0 Crank.A = [120,140]; Crank.angle = {text}; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [120 + {d},140];
   .across(Rocker.C, Crank.B, Rocker.D) {side} 0;
CLAIMS"""

    def poses(at, signs):
        one, four = mpc(120, 140), mpc(120 + d, 140)
        two = one + a * turned(at)
        three = meeting(two, b, four, c, signs[0])
        if three is None:
            return None
        u = (three - two) / b
        env = {"Crank.A": one, "Crank.B": two, "Coupler.B": two, "Coupler.C": three, "Coupler.P": two + u * mpc(px, py)}
        env |= {"Rocker.D": four, "Rocker.C": three}
        return env | {"Crank.angle": at}

    n = lambda v: number(str(v))  # noqa: E731
    B, C, D, A, P = "Crank.B", "Coupler.C", "Rocker.D", "Crank.A", "Coupler.P"
    claims = [
        (square(length(P, B)), n(px * px + py * py)),
        (length(C, B), n(b)),
        (across(P, B, C), n(py)),
        (along(P, B, C), n(px)),
        (dot(A, B, A, D), binary("*", n(a * d), cosine(angle("Crank")))),
        (square(length(B, D)), binary("-", n(a * a + d * d), binary("*", n(2 * a * d), cosine(angle("Crank"))))),
        (binary("+", square(across(C, A, D)), square(along(C, A, D))), square(length(C, A))),
        (cross(B, C, B, P), binary("*", n(b), n(py))),
        (binary("*", across(C, B, D), length(B, D)), cross(B, D, B, C)),
        (binary("*", absolute(across(C, B, D)), length(B, D)), absolute(cross(B, D, B, C))),
        (binary("*", across(C, B, D), n(2)), root(binary("*", n(4), square(across(C, B, D))))),
        (
            along(C, B, D),
            binary("/", binary("+", square(length(B, D)), n(b * b - c * c)), binary("*", n(2), length(B, D))),
        ),
        (length(C, A), length(B, D)),
        (x_of(C), binary("+", x_of(B), n(d))),
        (cross(A, D, B, C), n(0)),
        (binary("*", length(C, A), length(B, D)), n(abs(d * d - a * a))),
        (dot(A, C, B, D), n(0)),
        (y_of(C), n(140)),
    ]
    return Family(
        head, poses, drive, end, 1, claims, ["Crank.A", "Crank.B", "Coupler.P", "Coupler.C", "Rocker.D"], ["Crank"]
    )


def slider(chance):
    r, rod, e = chance.randint(25, 50), chance.randint(90, 150), chance.choice((0, 0, 12, -15))
    _base, _rate, text, drive = drive_of(chance)
    side = chance.choice((">", "<"))
    head = f"""Crank : .bar O = [200,150] P = O + [{r},0];
Rod : .bar A = [0,0] M = A + [{rod}/2,0] B = A + [{rod},0];
@0 Crank.O = [200,150]; Crank.angle = {text}; Rod.A = Crank.P; Rod.B.y = 150 + {e}; Rod.B.x {side} Crank.P.x;
CLAIMS"""

    def poses(at, signs):
        origin = mpc(200, 150)
        p = origin + r * turned(at)
        y = mpf(150 + e)
        rest = rod * rod - (y - mp.im(p)) ** 2
        if rest < 0:
            return None
        b = mpc(mp.re(p) + signs[0] * mp.sqrt(rest), y)
        return {"Crank.O": origin, "Crank.P": p, "Rod.A": p, "Rod.B": b, "Rod.M": (p + b) / 2, "Crank.angle": at}

    n = lambda v: number(str(v))  # noqa: E731
    O, P, B, M = "Crank.O", "Crank.P", "Rod.B", "Rod.M"  # noqa: E741
    reach = root(binary("-", n(rod * rod), square(binary("-", binary("*", n(r), sine(angle("Crank"))), n(e)))))
    claims = [
        (x_of(B), binary("+", binary("+", n(200), binary("*", n(r), cosine(angle("Crank")))), reach)),
        (x_of(B), binary("-", binary("+", n(200), binary("*", n(r), cosine(angle("Crank")))), reach)),
        (absolute(binary("-", x_of(B), x_of(P))), reach),
        (square(binary("-", x_of(B), x_of(P))), square(reach)),
        (y_of(B), n(150 + e)),
        (length(M, P), length(M, B)),
        (
            binary("*", n(4), square(length(M, O))),
            binary("-", binary("+", n(2 * r * r), binary("*", n(2), square(length(B, O)))), n(rod * rod)),
        ),
        (dot(P, B, P, B), n(rod * rod)),
        (binary("+", x_of(P), x_of(B)), binary("*", n(2), x_of(M))),
        (square(binary("/", binary("-", x_of(M), n(200)), n(rod))), n(1)),
        (length(B, O), absolute(binary("-", x_of(B), n(200)))),
    ]
    return Family(head, poses, drive, chance.choice((1, 2)), 1, claims, [O, P, B, M], ["Crank"])


def gears(chance):
    one, two, m = chance.randint(8, 20), chance.randint(12, 30), chance.choice(("3", "2.5", "4"))
    base, rate, _text, drive = drive_of(chance)
    swing = chance.choice(("0", f"{chance.randint(5, 40)}*.t", "30*.sin(45*.t)"))
    far = Fraction(m) * (one + two) / 2
    head = f"""Sun : .gear({one}, {m}) C = [160,160] P = C + [10,0];
Arm : .bar O = [160,160] E = O + [{float(far):g},0];
Planet : .gear({two}, {m}) C = [160 + {float(far):g},160] Q = C + [0,15];
@0 Sun.C = [160,160]; Sun.angle = {rate}*.t; Arm.O = [160,160]; Arm.angle = {swing}; Planet.C = Arm.E; .mesh(Sun, Planet) = 0;
CLAIMS"""

    def poses(at, signs):
        t = (at - base) / rate if rate else mpf(0)
        sun = rate * t
        carried = {"0": mpf(0), "30*.sin(45*.t)": 30 * mp.sin(45 * t * mp.pi / 180)}.get(swing)
        if carried is None:
            carried = mpf(swing.split("*")[0]) * t
        o = mpc(160, 160)
        distance = mpf(far.numerator) / far.denominator
        c = o + distance * turned(carried)
        env = {"Sun.C": o, "Arm.O": o, "Arm.E": c, "Planet.C": c, "Sun.P": o + 10 * turned(sun)}
        turn = carried - (sun - carried) * one / two + poses.fitted
        return env | {
            "Sun.angle": sun,
            "Arm.angle": carried,
            "Planet.angle": turn,
            "Planet.Q": c + 15 * mpc(0, 1) * turned(turn),
        }

    poses.fitted = None  # how far it is turned so that teeth fit: read from the film
    n = lambda v: number(str(v))  # noqa: E731
    claims = [
        (
            binary("*", n(two), binary("-", angle("Planet"), angle("Arm"))),
            binary(
                "-",
                binary("*", n(two), Node("FITTED", None)),
                binary("*", n(one), binary("-", angle("Sun"), angle("Arm"))),
            ),
        ),
        (length("Planet.C", "Sun.C"), n(f"{float(far):g}")),
        (length("Planet.Q", "Planet.C"), n(15)),
        (binary("*", n(one), angle("Sun")), binary("*", n(two), angle("Planet"))),
        (x_of("Planet.C"), binary("+", n(160), binary("*", n(f"{float(far):g}"), cosine(angle("Arm"))))),
        (dot("Sun.C", "Planet.C", "Sun.C", "Planet.C"), n(f"{float(far * far):.10g}")),
        (square(length("Sun.P", "Sun.C")), n(100)),
    ]
    family = Family(
        head, poses, drive, chance.choice((1, 2)), 0, claims, ["Sun.C", "Planet.C", "Planet.Q", "Sun.P"], ["Sun", "Arm"]
    )
    family.gears = True
    return family


def cord(chance):
    total = chance.randint(220, 280)
    x, y = chance.randint(140, 220), chance.randint(40, 60)
    amplitude, rate = chance.randint(10, 40), chance.choice((60, 90, 45))
    head = f"""Hand : .disc(4) O = [60,100];
Ring : .disc(4) O = [{x},{y}];
Load : .disc(8) O = [{x},200];
@0 Hand.O = [60 + {amplitude}*.sin({rate}*.t), 120]; Ring.O = [{x},{y}]; Load.O.x = {x}; Load.O.y > {y};
   .cord(Hand.O, Ring.O, Load.O) = {total};
CLAIMS"""

    def poses(at, signs):
        hand = mpc(60 + amplitude * mp.sin(at * mp.pi / 180), 120)
        ring = mpc(x, y)
        left = total - abs(hand - ring)
        if left < 0:
            return None
        return {"Hand.O": hand, "Ring.O": ring, "Load.O": ring + mpc(0, signs[0] * left)}

    n = lambda v: number(str(v))  # noqa: E731
    H, R, L = "Hand.O", "Ring.O", "Load.O"
    claims = [
        (binary("+", length(H, R), length(R, L)), n(total)),
        (y_of(L), binary("-", n(y + total), length(H, R))),
        (binary("-", y_of(L), n(y)), length(R, L)),
        (square(binary("-", n(y + total), y_of(L))), square(length(H, R))),
        (x_of(L), x_of(R)),
        (binary("+", y_of(L), length(H, R)), n(total)),
        (length(L, H), n(total)),
    ]
    return Family(head, poses, lambda t: mpf(rate) * t, chance.choice((1, 2)), 1, claims, [H, R, L])


def triangle(chance):
    v = [chance.randint(40, 320) for _ in range(4)]
    w, s = chance.randint(20, 60), chance.randint(10, 40)
    _base, _rate, text, drive = drive_of(chance)
    head = f"""A : .disc(3) O = [{v[0]},{v[1]}]; B : .disc(3) O = [{v[2]},{v[3]}]; C : .disc(3) O = [200,100];
G : .disc(3) O = [10,10]; M : .disc(3) O = [20,10]; H : .disc(3) O = [30,20]; U : .disc(3) O = [40,20];
@0 A.O = [{v[0]},{v[1]}]; B.O = [{v[2]},{v[3]}]; C.O = [200,150] + [{w} + {s},0].r({text});
   G.O = (A.O + B.O + C.O)/3; M.O = (A.O + B.O)/2;
   (H.O.x - A.O.x)*(B.O.x - C.O.x) + (H.O.y - A.O.y)*(B.O.y - C.O.y) = 0; (H.O.x - B.O.x)*(C.O.x - A.O.x) + (H.O.y - B.O.y)*(C.O.y - A.O.y) = 0;
   (U.O - A.O).l^2 = (U.O - B.O).l^2; (U.O - A.O).l^2 = (U.O - C.O).l^2;
CLAIMS"""

    def poses(at, signs):
        a, b = mpc(v[0], v[1]), mpc(v[2], v[3])
        c = mpc(200, 150) + (w + s) * turned(at)
        area = mp.im(mp.conj(b - a) * (c - a))
        if abs(area) < mpf(10) ** -10:
            return None
        q = lambda z: abs(z) ** 2  # noqa: E731
        d = 2 * area
        ux = (q(b - a) * mp.im(c - a) - q(c - a) * mp.im(b - a)) / d
        uy = (q(c - a) * mp.re(b - a) - q(b - a) * mp.re(c - a)) / d
        u = a + mpc(ux, uy)
        h = a + b + c - 2 * u
        return {"A.O": a, "B.O": b, "C.O": c, "G.O": (a + b + c) / 3, "M.O": (a + b) / 2, "H.O": h, "U.O": u}

    n = lambda k: number(str(k))  # noqa: E731
    A, B, C, G, M, H, U = (f"{k}.O" for k in "ABCGMHU")
    area = cross(A, B, A, C)
    claims = [
        (cross(G, H, G, U), n(0)),
        (length(H, G), binary("*", n(2), length(G, U))),
        (dot(C, H, A, B), n(0)),
        (length(U, A), length(U, C)),
        (
            binary("*", n(2), absolute(cross(A, B, A, C))),
            binary("*", length(A, B), binary("*", n(2), absolute(across(C, A, B)))),
        ),
        (
            binary("*", n(2), length(U, A)),
            binary("/", binary("*", binary("*", length(A, B), length(B, C)), length(C, A)), absolute(area)),
        ),
        (binary("*", length(C, H), n(1)), binary("*", n(2), length(U, M))),
        (
            binary("+", square(length(A, C)), square(length(B, C))),
            binary("+", binary("*", n(2), square(length(C, M))), binary("/", square(length(A, B)), n(2))),
        ),
        (dot(U, M, A, B), n(0)),
        (
            binary("*", n(9), square(length(G, U))),
            binary(
                "-",
                binary("*", n(9), square(length(U, A))),
                binary("+", binary("+", square(length(A, B)), square(length(B, C))), square(length(C, A))),
            ),
        ),
        (binary("*", across(C, A, B), length(A, B)), area),
        (cross(C, G, C, M), n(0)),
        (length(G, M), binary("/", length(C, M), n(3))),
        (square(length(H, C)), binary("-", binary("*", n(4), square(length(U, A))), square(length(A, B)))),
        (length(H, A), length(H, B)),
    ]
    return Family(head, poses, drive, chance.choice((1, 2)), 0, claims, [A, B, C, G, M, H, U])


FAMILIES = (four_bar, four_bar, slider, gears, cord, triangle, triangle)


# --- mutations


def tiny(chance):
    """A number that no float tells from 0 or 1."""
    return f"0.{'0' * chance.randint(17, 24)}{chance.randint(1, 99)}"


def mutated(chance, family, claim):
    """A claim beside a true one; nobody knows whether it holds."""
    left, right = claim
    for _ in range(chance.choice((0, 1, 1, 1, 2))):
        match chance.randrange(11):
            case 0:
                right = binary("+", right, number(tiny(chance)))
            case 1:
                right = binary("*", right, number(f"1.{tiny(chance)[2:]}"))
            case 2:
                right = Node(f"-({right})", lambda env, r=right: -r.value(env))
            case 3:
                right = absolute(right)
            case 4:
                left, right = square(left), square(right)
            case 5:
                left, right = (
                    binary("*", left, length(*chance.sample(family.points, 2))),
                    binary("*", right, length(*chance.sample(family.points, 2))),
                )
            case 6:
                extra = length(*chance.sample(family.points, 2))
                left, right = binary("*", left, extra), binary("*", right, extra)
            case 7:
                k = f"{chance.randint(1, 9)}.{chance.randint(10**19, 10**20)}"
                left, right = binary("*", left, number(k)), binary("*", number(k), right)
            case 8:
                c = chance.choice(("2", "3", "5"))
                one, other = root(number(c)), root(number(str(int(c) * 4)))
                left, right = (
                    binary("*", left, binary("*", number("2"), one)),
                    binary(
                        "*", right, chance.choice((other, other, binary("*", one, number("2.0000000000000000001"))))
                    ),
                )
            case 9:
                right = binary("+", right, number(str(chance.choice((1, -2, "0.5")))))
            case _:
                extra = x_of(chance.choice(family.points))
                left, right = (
                    binary("+", left, extra),
                    binary("+", right, chance.choice((extra, extra, x_of(chance.choice(family.points))))),
                )
    return left, right


def all_signs(family):
    return list(itertools.product((1, -1), repeat=family.choices))


def off(claim, env):
    """How far apart the sides are; None where one has no value."""
    with mp.workdps(DIGITS):
        try:
            a, b = claim[0].value(env), claim[1].value(env)
        except (ZeroDivisionError, ValueError):
            return None
        apart = abs(a - b)
        return apart if mp.isfinite(apart) else None


def random_family(seed):
    chance = random.Random(seed)
    return chance, chance.choice(FAMILIES)(chance)
