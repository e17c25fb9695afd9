"""Theorems about linkages and in plane geometry, as scripts, true and broken: the truth is that of the textbooks."""
# ruff: noqa: E501

POINTS = """
{names}
@0  A.O = [60, 50];  B.O = [260, 80];  C.O = [130 + 40*.cos(90*.t), 210 + 30*.sin(150*.t)];
{body}
@2
"""


def plane(body: str, *more: str) -> str:
    """A triangle whose third corner moves, with ``more`` points, and what is said about them."""
    names = "\n".join(
        f"{name} : .disc(3) O = [{100 + 37 * k}, {90 + 23 * k}];" for k, name in enumerate(("A", "B", "C", *more))
    )
    return POINTS.format(names=names, body=body)


CIRCUMCENTRE = "(U.O - A.O).l = (U.O - B.O).l;  (U.O - A.O).l = (U.O - C.O).l;"


def foot(name: str, p: str, a: str, b: str) -> str:
    """The foot of the perpendicular from p on the line a b."""
    return (
        f".across({name}.O, {a}.O, {b}.O) = 0;"
        f"({name}.O.x - {p}.O.x)*({b}.O.x - {a}.O.x) + ({name}.O.y - {p}.O.y)*({b}.O.y - {a}.O.y) = 0;"
    )


def orthogonal(p: str, q: str, a: str, b: str) -> str:
    """The product of two differences, which is zero where they are at right angles."""
    return f"({p}.O.x - {q}.O.x)*({a}.O.x - {b}.O.x) + ({p}.O.y - {q}.O.y)*({a}.O.y - {b}.O.y)"


ALTITUDES = f"{orthogonal('H', 'A', 'B', 'C')} = 0; {orthogonal('H', 'B', 'C', 'A')} = 0;"
MIDDLES = "D.O = (B.O + C.O)/2; E.O = (C.O + A.O)/2; F.O = (A.O + B.O)/2;"

TRUE = {
    "varignon": plane(
        "Q.O = [320 + 9*.t, 190 - 20*.t]; D.O = (A.O+B.O)/2; E.O = (B.O+C.O)/2; F.O = (C.O+Q.O)/2; G.O = (Q.O+A.O)/2;"
        ".claim D.O - E.O = G.O - F.O;", "Q", "D", "E", "F", "G"),
    "altitudes meet": plane(f"{ALTITUDES} .claim {orthogonal('H', 'C', 'A', 'B')} = 0;", "H"),
    "bisectors meet": plane(f"{CIRCUMCENTRE} .claim (U.O - B.O).l = (U.O - C.O).l;", "U"),
    "medians": plane(
        f"{MIDDLES} .across(S.O, A.O, D.O) = 0; .across(S.O, B.O, E.O) = 0; .claim .across(S.O, C.O, F.O) = 0;"
        ".claim S.O = (A.O + B.O + C.O)/3;", "D", "E", "F", "S"),
    "euler's line": plane(f"{CIRCUMCENTRE} {ALTITUDES} S.O = (A.O + B.O + C.O)/3;"
        ".claim .across(S.O, U.O, H.O) = 0; .claim H.O - S.O = (S.O - U.O)*2;", "U", "H", "S"),
    "nine points": plane(
        f"{CIRCUMCENTRE} {ALTITUDES} N.O = (U.O + H.O)/2; D.O = (B.O + C.O)/2; K.O = (A.O + H.O)/2; {foot('L', 'A', 'B', 'C')}"
        ".claim (N.O - D.O).l = (N.O - K.O).l; .claim (N.O - D.O).l = (N.O - L.O).l;", "U", "H", "N", "D", "K", "L"),
    "simson": plane(
        f"{CIRCUMCENTRE} P.O = U.O + (A.O - U.O).rotate(50 + 20*.t); {foot('D', 'P', 'B', 'C')} {foot('E', 'P', 'C', 'A')}"
        f"{foot('F', 'P', 'A', 'B')} .claim .across(F.O, D.O, E.O) = 0;", "U", "P", "D", "E", "F"),
    "napoleon": plane(
        "D.O = (B.O+C.O)/2 + (C.O-B.O).rotate(-90)*.sqrt(3)/6; E.O = (C.O+A.O)/2 + (A.O-C.O).rotate(-90)*.sqrt(3)/6;"
        "F.O = (A.O+B.O)/2 + (B.O-A.O).rotate(-90)*.sqrt(3)/6; .claim (D.O-E.O).l = (E.O-F.O).l;"
        ".claim (D.O-E.O) = (F.O-E.O).rotate(60);", "D", "E", "F"),
    "pythagoras": plane("P.O = A.O + [90 + 9*.t, 0]; Q.O = A.O + [0, 70];"
        ".claim (P.O-Q.O).l^2 = (P.O-A.O).l^2 + (Q.O-A.O).l^2;", "P", "Q"),
    "thales": plane("P.O = (A.O+B.O)/2 + ((B.O-A.O)/2).rotate(30 + 40*.t);"
        f".claim {orthogonal('P', 'A', 'P', 'B')} = 0;", "P"),
    "heron": plane(
        "a = (B.O-C.O).l; b = (C.O-A.O).l; c = (A.O-B.O).l; h = .across(C.O, A.O, B.O);"
        ".claim 4*h^2*c^2 = (a+b+c)*(b+c-a)*(c+a-b)*(a+b-c);"),
}  # fmt: skip

FALSE = {
    "varignon, one middle elsewhere": TRUE["varignon"].replace("F.O = (C.O+Q.O)/2", "F.O = (C.O+Q.O)/3"),
    "altitudes, one a median": plane(f"{ALTITUDES} {MIDDLES} .claim .across(H.O, C.O, F.O) = 0;", "H", "D", "E", "F"),
    "euler's line with the wrong share": TRUE["euler's line"].replace("(S.O - U.O)*2", "(S.O - U.O)*3"),
    "simson off the circle": TRUE["simson"].replace("(A.O - U.O).rotate", "((A.O - U.O)*1.1).rotate"),
    "napoleon with squares": TRUE["napoleon"].replace(".sqrt(3)/6", "1/2"),
    "thales off the circle": TRUE["thales"].replace("((B.O-A.O)/2).rotate", "((B.O-A.O)/2.001).rotate"),
    "nine points, one elsewhere": TRUE["nine points"].replace("K.O = (A.O + H.O)/2", "K.O = (A.O + H.O*2)/3"),
}

FOUR_BAR = """
Crank   : .bar   A = [{ax},100]  B = A + [{r},0];
Coupler : .plate B = [0,0]  P = B + [{px},{py}]  C = B + [{l},0];
Rocker  : .bar   C = [0,0]  D = C - [0,{s}];
@0  Crank.A = [{ax},100];  Crank.angle = {drive};  Coupler.B = Crank.B;  Rocker.C = Coupler.C;
    Rocker.D = [{dx},{dy}];  {side}
    {claim}
@2
"""
WATT = """
Left  : .bar A = [100,200] B = A + [100,0];
Link  : .bar B = [0,0] P = B + [0,-30] C = B + [0,-60];
Right : .bar C = [0,0] D = C + [100,0];
@0 Left.A = [100,200]; Left.angle = 10*.sin(180*.t); Link.B = Left.B; Link.C = Right.C; Right.D = [300,140]; Right.C.y < Left.B.y;
   .claim Link.P.x = 200 .within({within});
@2
"""

ALL_LENGTHS = {
    "peaucellier": """
.let L = 200; .let S = 80; .let r = 70;
Upper : .bar  O = [60,210]   A = O + [L*.cos(15), L*.sin(15)];
Lower : .bar  O = [60,210]   B = O + [L*.cos(15), -L*.sin(15)];
MA    : .bar  M = [0,0]      A = M + [S*.cos(45), S*.sin(45)];
MB    : .bar  M = [0,0]      B = M + [S*.cos(45), -S*.sin(45)];
AP    : .bar  A = [0,0]      P = A + [S*.cos(45), -S*.sin(45)];
BP    : .bar  B = [0,0]      P = B + [S*.cos(45), S*.sin(45)];
Crank : .bar  Q = [60+r,210]  M = Q + [r,0];
@0   Crank.Q = [60+r,210];    Crank.angle = 50*.sin(180*.t);
     Upper.O = [60,210];     Lower.O = [60,210];
     MA.M = Crank.M;         MA.A = Upper.A;        Upper.A.y > Crank.M.y;
     MB.M = Crank.M;         MB.B = Lower.B;        Lower.B.y < Crank.M.y;
     AP.A = Upper.A;         BP.B = Lower.B;
     AP.P = BP.P;            AP.P.x > Upper.A.x;
     .claim AP.P.x = 60 + (L^2 - S^2)/(2*r);
@2   .loop;
""",
    "pantograph": """
.let a = 140; .let b = 150; .let k = 2;
OA    : .bar  O = [60,70]  B = O + [a,0]  A = O + [k*a,0];
AQ    : .bar  A = [0,0]    C = A + [b,0] Q = A + [k*b,0];
BP    : .bar  B = [0,0]    P = B + [b,0];
CP    : .bar  C = [0,0]    P = C + [(k-1)*a,0];
@0   OA.O = [60,70];
     BP.P = [220,130] + [32 + 11*.cos(900*.t), 0].rotate(180*.t);
     BP.B = OA.B;      OA.B.y > BP.P.y;
     AQ.A = OA.A;
     CP.P = BP.P;      CP.C = AQ.C;      AQ.C.x > OA.B.x + 50;
     .claim AQ.Q - OA.O = (BP.P - OA.O)*k;
@2   .loop;
""",
    # the crank passes its outer dead centre where the product of Grashof's differences is positive
    "grashof": """
.let a = 40; .let b = 120; .let c = 90; .let d = 110;
Crank   : .bar A = [0,0] B = A + [a,0];
Coupler : .bar B = [0,0] C = B + [b,0];
Rocker  : .bar C = [0,0] D = C + [0,-c];
@0 Crank.A = [0,0]; Crank.angle = 180; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [d,0]; Rocker.C.y > 0;
   .claim 4*Rocker.C.y^2*(a + d)^2 = (a + d + b + c)*(b + c - a - d)*(a + d + b - c)*(a + d - b + c);
@2
""",
    "heron, of a four-bar": """
.let a = 40; .let b = 120; .let c = 90; .let d = 110;
Crank   : .bar A = [0,0] B = A + [a,0];
Coupler : .bar B = [0,0] C = B + [b,0];
Rocker  : .bar C = [0,0] D = C + [0,-c];
@0 Crank.A = [0,0]; Crank.angle = 180*.t; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [d,0]; .across(Rocker.C, Crank.B, Rocker.D) > 0;
   u = (Crank.B - Rocker.D).l;
   .claim (b + c - u)*(b+c+u)*(u-b+c)*(u+b-c) = 4*.across(Rocker.C, Crank.B, Rocker.D)^2*u^2;
@2
""",
}
"""Scripts whose constants are letters."""
