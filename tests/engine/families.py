"""Scripts of many equal mechanisms, as large as they are wanted."""

from __future__ import annotations


def bars(count: int) -> str:
    """Driven bars side by side."""
    things = [f"B{n} : .bar A=[{40 * n},0] B=[{40 * n + 20},0];" for n in range(count)]
    stated = [f"B{n}.A = [{40 * n},0];  B{n}.angle = {60 + n}*.t;" for n in range(count)]
    return _script(things, stated)


def chain(count: int) -> str:
    """Bars that hang on each other, all driven."""
    things = [f"B{n} : .bar A=[{10 * n},0] B=[{10 * n + 10},0];" for n in range(count)]
    stated = [f"B{n}.A = {f'B{n - 1}.B' if n else '[0,0]'};  B{n}.angle = {60 + n}*.t;" for n in range(count)]
    return _script(things, stated)


def dyads(count: int) -> str:
    """Slider-cranks side by side, which have nothing to do with each other."""
    things = [
        f"C{n} : .bar A=[{80 * n},0] B=[{80 * n + 10},0];  R{n} : .bar B=[{80 * n + 10},0] D=[{80 * n + 50},0];"
        for n in range(count)
    ]
    stated = [
        f"C{n}.A = [{80 * n},0];  C{n}.angle = {60 + n}*.t;  R{n}.B = C{n}.B;  R{n}.D = [_, 0];  R{n}.D.x > {80 * n};"
        for n in range(count)
    ]
    return _script(things, stated)


def four_bars(count: int, reach: float = 60.0) -> str:
    """Four-bars side by side; the coupler of the last one is ``reach`` long: with 200 it cannot close."""
    things: list[str] = []
    stated: list[str] = []
    for n in range(count):
        x, far = 100 * n, reach if n == count - 1 else 60.0
        things.append(
            f"C{n} : .bar A=[{x},0] B=[{x + 12},0];  K{n} : .bar B=[{x + 12},0] C=[{x + 12 + far},0];"
            f"  R{n} : .bar C=[{x + 60},50] D=[{x + 60},0];"
        )
        stated.append(
            f"C{n}.A = [{x},0];  C{n}.angle = {60 + n}*.t;  K{n}.B = C{n}.B;  R{n}.C = K{n}.C;  R{n}.D = [{x + 60},0];"
            f"  R{n}.C.y > 0;"
        )
    return _script(things, stated)


def copies(count: int) -> str:
    """Copies of a `.part`."""
    return f"""\
.config(10);
.let n = {count};
.part Leg(phase = 0) {{
  Crank : .bar O=[0,0] P=[20,0];  Foot : .bar A=[0,0] B=[0,-70];
  @0 Crank.O = [0,0];  Crank.angle = phase - 90*.t;  Foot.A = Crank.P;  Foot.B = [0, _];  Foot.B.y < Foot.A.y;
}}
L[k = 1..n] : Leg(50*k) .at([80*k, 100]);
@0 asked = L[1].Foot.B.y;
@1
"""


def _script(things: list[str], stated: list[str]) -> str:
    return "\n".join([".config(10);", *things, "@0", *stated, "@1", ""])
