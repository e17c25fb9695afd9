"""Random scripts with claims of many kinds, true and false ones: nobody but `positions` says which."""
# ruff: noqa: E501

from __future__ import annotations

import re

from tests.proving.theorems import FALSE, TRUE

HEAD = ".config(8, 400, 320);\n"


def u(chance, low, high, digits=0):
    """A decimal number."""
    return f"{round(chance.uniform(low, high), digits):g}"


def four_bar(chance):
    a, b, c, d = chance.uniform(30, 60), chance.uniform(100, 150), chance.uniform(90, 140), chance.uniform(110, 150)
    a, b, c, d = (f"{v:.1f}" for v in (a, b, c, d))
    px, py = u(chance, -60, 120), u(chance, 20, 90)
    side = chance.choice((">", "<"))
    drive = chance.choice(
        ("90*.t", "180*.t", f"20 + {u(chance, 20, 60)}*.sin(90*.t)", f"{u(chance, -90, 90)} + 40*.ease(.t/2)")
    )
    claims = [
        f"(Coupler.P - Crank.B).l^2 = {px}^2 + {py}^2",
        f"(Coupler.C - Crank.A).l^2 = {a}^2 + {b}^2 + 2*{a}*{b}*.cos(Coupler.angle - Crank.angle)",
        f"{a}*.cos(Crank.angle) + {b}*.cos(Coupler.angle) = {d} + {c}*.cos(Rocker.angle)",
        f"{a}*.sin(Crank.angle) + {b}*.sin(Coupler.angle) = {c}*.sin(Rocker.angle)",
        f"{a}*.sin(Crank.angle) + {b}*.sin(Coupler.angle) = -{c}*.sin(Rocker.angle)",
        f"(Coupler.C - Crank.A).l <= {a} + {b}",
        "(Coupler.C - Rocker.D).l <= (Coupler.C - Crank.B).l + (Crank.B - Rocker.D).l",
        f".a(Rocker.C - Rocker.D, Rocker.D - Crank.A) = {u(chance, 10, 90)}",
        ".across(Coupler.C, Crank.A, Rocker.D) = Rocker.C.y - 100",
        ".along(Coupler.C, Crank.A, Rocker.D) = Rocker.C.x - 100",
        ".abs(Rocker.C.y - 100) = .across(Coupler.C, Crank.A, Rocker.D)",
        ".max(Crank.B.y, 100) = (Crank.B.y + 100 + .abs(Crank.B.y - 100))/2",
        f".across(Coupler.P, Crank.B, Coupler.C) = {py}",
        f".along(Coupler.P, Crank.B, Coupler.C) = {px}",
        f".a(Coupler.C - Coupler.B, Coupler.P - Coupler.B) = .atan2({py}, {px})",
        "Coupler.angle - Crank.angle = .a(Crank.B - Crank.A, Coupler.C - Coupler.B)",
        f"(Crank.B - Rocker.D).l^2 = {b}^2 + {c}^2 - 2*{b}*{c}*.cos(.a(Coupler.C - Crank.B, Rocker.C - Rocker.D))",
    ]
    return (
        HEAD
        + f"""
Crank : .bar A = [100,100] B = A + [{a},0];
Coupler : .plate B = [0,0] P = B + [{px},{py}] C = B + [{b},0];
Rocker : .bar D = [100+{d},100] C = D + [{c},0];
@0 Crank.A = [100,100]; Crank.angle = {drive}; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [100+{d},100]; Rocker.C.y {side} 100;
"""
        + claimed(chance, claims)
        + "@2\n"
    )


def claimed(chance, claims, count=4):
    return "".join(f"   .claim {each};\n" for each in chance.sample(claims, min(count, len(claims))))


def parallelogram(chance):
    a, d = u(chance, 40, 90), u(chance, 60, 160)
    crossed = chance.random() < 0.5
    low = u(chance, 20, 50)
    side = (
        ".across(Coupler.C, Crank.A, Rocker.D)*.across(Crank.B, Crank.A, Rocker.D) "
        + ("< 0" if crossed else "> 0")
        + ";"
    )
    return (
        HEAD
        + f"""
Crank : .bar A = [100,150] B = A + [{a},0];
Coupler : .bar B = [0,0] C = B + [{d},0];
Rocker : .bar D = [100+{d},150] C = D + [{a},0];
@0 Crank.A = [100,150]; Crank.angle = 90 + {low}*.sin(90*.t); Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [100+{d},150]; {side}
"""
        + claimed(
            chance,
            [
                "Coupler.angle = 0",
                "Rocker.angle = Crank.angle",
                "Rocker.C - Crank.B = Rocker.D - Crank.A",
                f"(Rocker.C - Crank.A).l*(Crank.B - Rocker.D).l = {d}^2 - {a}^2",
                f"(Rocker.C - Crank.A).l*(Crank.B - Rocker.D).l = {a}^2 - {d}^2",
                "(Crank.B.y - 150)*(Rocker.C.x - Crank.A.x) = (Rocker.C.y - 150)*(Crank.B.x - Rocker.D.x)",
                f"(Rocker.C - Crank.A).l^2 + (Crank.B - Rocker.D).l^2 = 2*({a}^2 + {d}^2)",
                ".across(Rocker.C, Crank.A, Rocker.D) = .across(Crank.B, Crank.A, Rocker.D)",
            ],
        )
        + "@2\n"
    )


def hart(chance):
    big, small, q = chance.randint(180, 260), chance.randint(90, 150), chance.randint(35, 55)
    m = chance.choice(("1/2", "1/2", "1/3", "2/5"))
    crossed = chance.choice((">", ">", "<"))
    wrong = chance.choice(("", "", "", f" + {u(chance, -3, 3, 1)}"))
    long2 = big + chance.choice((0, 0, 0, 2, -3))
    short2 = small + chance.choice((0, 0, 0, 2, -3))
    return (
        HEAD
        + f"""
.let L = {big}; .let S = {small}; .let q = {q}; .let m = {m}; .let pivot = [90,200]; .let k2 = m*(1-m)*(L^2 - S^2){wrong};
Left   : .bar  O = pivot  A = O + [0, S*m]  D = O - [0, S*(1-m)];
Down   : .bar  A = [0, 0]          P = A + [L*m, 0]  B = A + [L, 0];
Up     : .bar  D = [0, 0]          Q = D + [{long2}*(1-m), 0]  C = D + [{long2}, 0];
Right  : .bar  C = [0, 0]          B = C - [0, {short2}];
Crank  : .bar  E = pivot + [q, 0]  P = E + [q, 0];
@0   Left.O = pivot;       Crank.E = pivot + [q, 0];       Crank.angle = {u(chance, 20, 64)}*.sin(180*.t);
     Down.A = Left.A;      Down.P = Crank.P;           Up.D = Left.D;
     Right.B = Down.B;     Right.C = Up.C;
     .across(Left.A, pivot, Down.P) > 0;
     .across(Up.C, pivot, Down.P) {crossed} 0;
"""
        + claimed(
            chance,
            [
                "Up.Q.x = pivot.x + k2/(2*q)",
                "(Down.P - pivot).l * (Up.Q - pivot).l = k2",
                ".across(Up.Q, pivot, Down.P) = 0",
                "(Left.A - Up.C).l*(Left.D - Down.B).l = L^2 - S^2",
                "(Down.P - pivot).l^2 * (Up.Q - pivot).l^2 = k2^2",
                "Right.angle = Left.angle",
                "Down.angle - Up.angle = 0",
                "(Left.A.x - Up.C.x)*(Left.D.y - Down.B.y) = (Left.A.y - Up.C.y)*(Left.D.x - Down.B.x)",
            ],
            3,
        )
        + "@2\n"
    )


def peaucellier(chance):
    big, small, r = chance.randint(180, 230), chance.randint(60, 90), chance.randint(55, 75)
    other = small + chance.choice((0, 0, 1, -2))
    return (
        HEAD
        + f"""
.let L = {big}; .let S = {small}; .let r = {r};
Upper : .bar  O = [60,210]   A = O + [L*.cos(15), L*.sin(15)];
Lower : .bar  O = [60,210]   B = O + [L*.cos(15), -L*.sin(15)];
MA : .bar M = [0,0] A = M + [S,0]; MB : .bar M = [0,0] B = M + [S,0]; AP : .bar A = [0,0] P = A + [{other},0]; BP : .bar B = [0,0] P = B + [{other},0];
Crank : .bar  Q = [60+r,210]  M = Q + [r,0];
@0   Crank.Q = [60+r,210];    Crank.angle = {u(chance, 20, 45)}*.sin(180*.t);
     Upper.O = [60,210];     Lower.O = [60,210];
     MA.M = Crank.M;         MA.A = Upper.A;        .across(Upper.A, [60,210], Crank.M) > 0;
     MB.M = Crank.M;         MB.B = Lower.B;        .across(Lower.B, [60,210], Crank.M) < 0;
     AP.A = Upper.A;         BP.B = Lower.B;        AP.P = BP.P;            AP.P.x > Crank.M.x + 10;
"""
        + claimed(
            chance,
            [
                "AP.P.x = 60 + (L^2 - S^2)/(2*r)",
                "(AP.P - Upper.O).l*(Crank.M - Upper.O).l = L^2 - S^2",
                ".across(AP.P, Upper.O, Crank.M) = 0",
                ".a(AP.P - Crank.M, Upper.A - Lower.B) = 90",
                ".a(AP.P - Crank.M, Upper.A - Lower.B) = -90",
                "(Upper.A - Crank.M).l = (Lower.B - AP.P).l",
                "AP.P.x >= 60 + (L^2 - S^2)/(2*r) - 1",
                "Crank.M.y - 210 = r*.sin(Crank.angle)",
            ],
            3,
        )
        + "@2\n"
    )


def ellipse(chance):
    a, b = chance.randint(60, 140), chance.randint(30, 90)
    c = chance.randint(20, 70)
    return (
        HEAD
        + f"""
Rod : .bar A = [0,0] B = A + [{a},0] P = A + [{a + b},0] M = (A + B)/2;
Dot : .disc(3) O = [50,50];
@0 Rod.A = [200, _]; Rod.B = [_, 160]; Rod.angle = {u(chance, -40, 40)} + {u(chance, 10, 90)}*.t;
   Dot.O = [200 + {u(chance, 10, 30)}*.t, 160];
"""
        + claimed(
            chance,
            [
                f"((Rod.P.x - 200)/{a + b})^2 + ((Rod.P.y - 160)/{b})^2 = 1",
                f"(Rod.M - [200,160]).l = {a}/2",
                f"(Rod.M - [200,160]).l <= {a}/2",
                f"(Rod.M - [200,160]).l < {a}/2 + 0.001",
                f"(Dot.O - [200,160]).l + (Dot.O - [260 + {c},160]).l = 60 + {c}",
                "(Dot.O - [200,160]).l = Dot.O.x - 200",
                f"(Rod.P - [200 - .sqrt({(a + b) ** 2 - b * b}),160]).l + (Rod.P - [200 + .sqrt({(a + b) ** 2 - b * b}),160]).l = 2*{a + b}",
                f"(Rod.P - Rod.M).l = {b} + {a}/2",
                ".abs(Rod.A.y - 160) = Rod.A.y - 160",
                "(Rod.A - [200,160]).l = .abs(Rod.A.y - 160)",
                f"(Rod.A - [200,160]).l^2 + (Rod.B - [200,160]).l^2 = {a}^2",
                "Rod.P.x >= 0 - 500",
                f"Rod.P.y <= 160 + {b} + .max(0, 0*.t)",
                "(Rod.A - [200,160]).l*(Dot.O - [200,160]).l = .abs((Rod.A.y - 160)*(Dot.O.x - 200))",
            ],
        )
        + "@2\n"
    )


def slider(chance):
    r, rod, e = chance.randint(30, 60), chance.randint(120, 180), chance.choice((0, 0, chance.randint(-20, 20)))
    return (
        HEAD
        + f"""
Crank : .bar O = [100,100] P = O + [{r},0];
Rod : .bar A = [0,0] B = A + [{rod},0];
@0 Crank.O = [100,100]; Crank.angle = {u(chance, 30, 180)}*.t + {u(chance, -50, 50)}; Rod.A = Crank.P; Rod.B = [x, 100 + {e}]; x > 100;
"""
        + claimed(
            chance,
            [
                f"x = 100 + {r}*.cos(Crank.angle) + .sqrt({rod}^2 - ({r}*.sin(Crank.angle) - {e})^2)",
                f"x = 100 + {r}*.cos(Crank.angle) - .sqrt({rod}^2 - ({r}*.sin(Crank.angle) - {e})^2)",
                f"Rod.angle = .asin(({e} - {r}*.sin(Crank.angle))/{rod})",
                f"{rod}*.sin(Rod.angle) + {r}*.sin(Crank.angle) = {e}",
                f"x <= 100 + {r} + {rod}",
                f"Rod.B.x >= 100 + {rod} - {r}",
                "Rod.angle = -Crank.angle/2",
                f"(x - Crank.P.x)^2 = {rod}^2 - (Crank.P.y - Rod.B.y)^2",
                f"(Rod.B - Crank.O).l^2 = (x - 100)^2 + {e}^2",
                f".tan(Rod.angle) = ({e} - {r}*.sin(Crank.angle))/(x - Crank.P.x)",
                "{ Crank.P.y > 100 : 1; 0 } <= 1",
            ],
        )
        + "@2\n"
    )


def two_drives(chance):
    a, b = chance.randint(40, 80), chance.randint(40, 80)
    n, m = chance.choice(((30, 60), (30, 30.001), (45, -90), (20, 50)))
    return (
        HEAD
        + f"""
One : .bar O = [100,100] P = O + [{a},0];
Two : .bar O = [260,100] P = O + [{b},0];
Left : .bar A = [0,0] B = A + [150,0]; Right : .bar A = [0,0] B = A + [150,0];
Mid : .disc(4) O = [180,150];
@0 One.O = [100,100]; Two.O = [260,100]; One.angle = 100 + {n}*.t; Two.angle = 80 + {m}*.t;
   Left.A = One.P; Right.A = Two.P; Left.B = Right.B; Left.B.y > 150; Mid.O = (One.P + Two.P)/2;
"""
        + claimed(
            chance,
            [
                "(Left.B.x - Mid.O.x)*(One.P.x - Two.P.x) + (Left.B.y - Mid.O.y)*(One.P.y - Two.P.y) = 0",
                "(Left.B - Mid.O).l^2 + ((One.P - Two.P).l/2)^2 = 150^2",
                "(Left.B - Mid.O).l = .sqrt(150^2 - (One.P - Two.P).l^2/4)",
                "Two.angle - 80 = 2*(One.angle - 100)",
                f"Two.angle - 80 = {m}/{n}*(One.angle - 100)",
                ".a(Left.A - Left.B, Right.A - Right.B) = .a(Mid.O - Left.B, Right.A - Left.B)*2",
                "Left.angle + Right.angle = 180",
                ".cos(Two.angle - 80) = 2*.cos(One.angle - 100)^2 - 1",
                "Left.B.y >= Mid.O.y",
                ".across(Left.B, One.P, Two.P)^2 = 150^2 - (One.P - Two.P).l^2/4",
                "Left.B.y - Mid.O.y = (Left.B - Mid.O).l",
            ],
        )
        + "@1.5\n"
    )


def circle_angles(chance):
    """Inscribed angles; no instant that is looked at has `P` on `A` or `B`, where there is no angle."""
    r = chance.randint(60, 110)
    p, q = chance.randint(-170, -10), chance.randint(10, 170)
    return (
        HEAD
        + f"""
A : .disc(3) O = [10,10]; B : .disc(3) O = [20,10]; P : .disc(3) O = [30,10]; T : .disc(3) O = [40,10];
@0 A.O = [200,160] + [{r},0].r({p}); B.O = [200,160] + [{r},0].r({q}); P.O = [200,160] + [{r},0].r({u(chance, -170, 170)} + 0.0137 + {u(chance, 5, 40)}*.t);
   T.O = [200,160] + ([200,160] - P.O)*{u(chance, 1, 2, 1)};
"""
        + claimed(
            chance,
            [
                f".a(A.O - P.O, B.O - P.O) = ({q} - ({p}))/2",
                f".a(A.O - P.O, B.O - P.O) = ({q} - ({p}))/2 - 180",
                f".sin(.a(A.O - P.O, B.O - P.O))*2*{r} = (A.O - B.O).l",
                f".abs(.sin(.a(A.O - P.O, B.O - P.O)))*2*{r} = (A.O - B.O).l",
                f"(A.O - B.O).l = 2*{r}*.sin(({q} - ({p}))/2)",
                f".tan(.a(A.O - P.O, B.O - P.O)) = .tan(({q} - ({p}))/2)",
                "(P.O - A.O).l^2 + (P.O - B.O).l^2 = (A.O - B.O).l^2",
                f"(T.O - [200,160]).l <= 2*{r}",
                ".across(T.O, P.O, [200,160]) = 0",
                ".a(A.O - P.O, T.O - P.O) + .a(T.O - P.O, B.O - P.O) = .a(A.O - P.O, B.O - P.O)",
                ".a(P.O - [200,160], T.O - [200,160]) = 180",
                "2*.a(A.O - P.O, B.O - P.O) = .a(A.O - [200,160], B.O - [200,160])",
                ".along(P.O, A.O, B.O)*(A.O - B.O).l = (P.O.x - A.O.x)*(B.O.x - A.O.x) + (P.O.y - A.O.y)*(B.O.y - A.O.y)",
                ".across(P.O, A.O, B.O)^2 + .along(P.O, A.O, B.O)^2 = (P.O - A.O).l^2",
            ],
        )
        + "@2\n"
    )


def pantograph(chance):
    a, b, k = chance.randint(100, 140), chance.randint(120, 150), chance.choice(("2", "2", "1.5", "3"))
    other = chance.choice(("(k-1)*a", "(k-1)*a", "a", "a*1.01"))
    return (
        HEAD
        + f"""
.let a = {a}; .let b = {b}; .let k = {k};
OA : .bar O = [60,70] B = O + [a,0] A = O + [k*a,0]; AQ : .bar A = [0,0] C = A + [(k-1)*b,0] Q = A + [k*b,0];
BP : .bar B = [0,0] P = B + [b,0]; CP : .bar C = [0,0] P = C + [{other},0];
@0 OA.O = [60,70]; BP.P = [200,130] + [{u(chance, 10, 35)}, 0].r({u(chance, 30, 180)}*.t); BP.B = OA.B; .across(OA.B, [60,70], BP.P) > 0;
   AQ.A = OA.A; CP.P = BP.P; CP.C = AQ.C; .across(AQ.C, BP.P, OA.A) {chance.choice(("<", "<", ">"))} 0;
"""
        + claimed(
            chance,
            [
                "AQ.Q - OA.O = (BP.P - OA.O)*k",
                ".across(AQ.Q, OA.O, BP.P) = 0",
                "AQ.angle = BP.angle",
                "CP.angle = OA.angle",
                "(AQ.Q - OA.O).l = k*(BP.P - OA.O).l",
                "(AQ.Q - OA.O).l >= (BP.P - OA.O).l",
                "AQ.C - OA.B = BP.P - OA.B + (OA.A - OA.B)",
            ],
            3,
        )
        + "@2\n"
    )


def roberts(chance):
    """A coupler point and that of a cognate."""
    a, b, c, d = chance.uniform(35, 50), chance.uniform(100, 130), chance.uniform(90, 120), chance.uniform(110, 130)
    p, q = chance.uniform(20, 80), chance.uniform(20, 80)
    a, b, c, d, p, q = (round(v) for v in (a, b, c, d, p, q))
    wrong = chance.choice(("", "", "*1.01"))
    return (
        HEAD
        + f"""
Crank : .bar A = [100,100] B = A + [{a},0]; Coupler : .plate B = [0,0] P = B + [{p},{q}] C = B + [{b},0]; Rocker : .bar D = [100+{d},100] C = D + [{c},0];
Far : .plate A = [0,0] X = A + [{p},{q}]; Turned : .plate X = [0,0] P = X + [{a}*{p}/{b}{wrong},{a}*{q}/{b}] ;
@0 Crank.A = [100,100]; Crank.angle = {u(chance, 40, 120)}*.t; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [100+{d},100]; .across(Rocker.C, Crank.B, Rocker.D) > 0;
   Far.A = Crank.A; Far.angle = Coupler.angle; Turned.X = Far.X; Turned.angle = Crank.angle - .atan2({q},{p});
"""
        + claimed(
            chance,
            [
                "Turned.X - Crank.A = Coupler.P - Crank.B",
                "(Turned.X - Coupler.P).l = (Crank.B - Crank.A).l",
                f"(Turned.P - Turned.X).l*{b} = {a}*(Coupler.P - Coupler.B).l",
                "Turned.X + Crank.B = Coupler.P + Crank.A",
                ".a(Turned.P - Turned.X, Crank.B - Crank.A) = 0",
                "(Turned.P - Crank.A).l >= 0",
            ],
            3,
        )
        + "@2\n"
    )


FAMILIES = (
    four_bar,
    parallelogram,
    hart,
    hart,
    peaucellier,
    ellipse,
    slider,
    two_drives,
    circle_angles,
    pantograph,
    roberts,
)


def mutated(text, chance):
    """``text`` with one number, sign or relation changed."""
    text = re.sub(r"//.*", "", text)
    places = [
        m
        for m in re.finditer(r"(?<![\w.#@])\d+(\.\d+)?(?![\w.])", text)
        if "config" not in text[: m.start()].rpartition(";")[2]
    ]
    place = chance.choice(places)
    return f"{text[: place.start()]}{float(place[0]) * 1.01 + chance.choice((0, 0.01, -1)):.6g}{text[place.end() :]}"


def script(chance, others=()):
    """A random script."""
    k = chance.random()
    if k < 0.7:
        text = chance.choice(FAMILIES)(chance)
    else:
        text = chance.choice([*TRUE.values(), *FALSE.values(), *others])
    return mutated(text, chance) if k > 0.7 or chance.random() < 0.3 else text
