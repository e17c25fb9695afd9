"""Random scenes for the property tests: some made from a known pose, some of anything that can be typed."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

from hypothesis import strategies as st

KINDS = ("pin", "pin", "pin", "level", "distance", "slot")


@dataclass(frozen=True)
class Built:
    """A scene grown from a known pose: its statements hold there, and it can move from there (first angle at t = 0)."""

    things: tuple[str, ...]
    statements: tuple[str, ...]

    def script(self, end: str = "0.05", fps: str = "60", statements: tuple[str, ...] | None = None) -> str:
        return f".config({fps});\n{chr(10).join(self.things)}\n@0 {' '.join(statements or self.statements)}\n@{end}"


def number(value: float) -> str:
    return repr(float(value))


@st.composite
def known_poses(draw):
    """A crank and up to four dyads hung onto what is there already, drawn as they stand; each dyad by pins, slots,
    distances or levels. Returns `Built`.
    """
    seed = draw(st.integers(0, 10**6))
    count = draw(st.integers(1, 4))
    return grown(seed, count)


def grown(
    seed: int, count: int, factor: float = 1.0, turn: float = 0.0, offset: tuple[float, float] = (0.0, 0.0)
) -> Built:
    r = random.Random(seed)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))

    def put(p):
        x, y = factor * (c * p[0] - s * p[1]) + offset[0], factor * (s * p[0] + c * p[1]) + offset[1]
        return f"[{number(x)},{number(y)}]"

    crank = (r.uniform(20, 40), r.uniform(-20, 20))
    things = [f"C : .bar O={put((0, 0))} P={put(crank)};"]
    statements = [f"C.O={put((0, 0))};", "C.angle=90*.t;"]
    joints = [("C.P", crank)]
    for i in range(count):
        name, place = joints[r.randrange(len(joints))]
        for _ in range(1000):  # a joint well off the line from the pin to the new pivot
            pivot = (r.uniform(-150, 150), r.uniform(-150, 150))
            joint = (r.uniform(-150, 150), r.uniform(-150, 150))
            u = (joint[0] - place[0], joint[1] - place[1])
            v = (joint[0] - pivot[0], joint[1] - pivot[1])
            lengths = math.hypot(*u), math.hypot(*v)
            if min(lengths) > 50 and abs(u[0] * v[1] - u[1] * v[0]) > 0.4 * lengths[0] * lengths[1]:
                break
        kind = r.choice(KINDS)
        corner = (r.uniform(-150, 150), r.uniform(-150, 150))
        things.append(f"L{i} : .bar a={put(place)} b={put(joint)} c={put(corner)};")
        statements.append(f"L{i}.a={name};")
        if kind == "pin":
            things.append(f"R{i} : .bar o={put(pivot)} p={put(joint)};")
            statements += [f"R{i}.o={put(pivot)};", f"R{i}.p=L{i}.b;"]
        elif kind == "distance":
            statements.append(f"(L{i}.b - {put(pivot)}).l = {number(factor * lengths[1])};")
        elif kind == "level":  # on a line through the joint, across the link
            across = math.degrees(math.atan2(u[1], u[0])) + 60 + turn
            statements.append(f"L{i}.b = {put(joint)} + [w{i},0].r({number(across)});")
        else:  # a slot through the pivot: the link's far end lies on a ray of its own body
            statements.append(f"({put(pivot)} - L{i}.b).l = {number(factor * lengths[1])};")
        statements.append(f"L{i}.b ~ {put(joint)};")
        joints += [(f"L{i}.b", joint), (f"L{i}.c", corner)]
    return Built(tuple(things), tuple(statements))


# --- anything that can be typed


class Anything:
    """A random script of up to four things, three steps and five statements each: rarely sensible, always typable."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.things: list[str] = []
        self.anchors: list[str] = []

    def number(self) -> str:
        return self.random.choice(["0", "1", "-30", "50", "100", "12.5", "1e-3", "250"])

    def scalar(self, depth: int = 0) -> str:
        r = self.random
        kind = r.random()
        if depth > 2 or kind < 0.25:
            return self.number()
        if kind < 0.4:
            return r.choice([".t", ".T", ".iv", "90*.t", ".t/.iv"])
        if kind < 0.55:
            return r.choice("xyz")
        if kind < 0.7:
            return r.choice(self.things) + ".angle"
        if kind < 0.8:
            return r.choice(self.anchors) + r.choice([".x", ".y"])
        if kind < 0.85:
            return f"({self.vector(depth + 1)}).l"
        if kind < 0.9:
            name = r.choice(["sin", "cos", "abs", "sqrt", "i", "d", "ease", "exp", "ln", "floor"])
            return f".{name}({self.scalar(depth + 1)})"
        if kind < 0.95:
            return f"({self.scalar(depth + 1)} {r.choice('+-*/')} {self.scalar(depth + 1)})"
        if kind < 0.97:
            return f".a({self.vector(depth + 1)},{self.vector(depth + 1)})"
        return f"{{{self.scalar(depth + 1)} : {self.scalar(depth + 1)} > {self.number()} : {self.scalar(depth + 1)}}}"

    def anchor(self) -> str:
        return self.random.choice(self.anchors)

    def vector(self, depth: int = 0) -> str:
        kind = self.random.random()
        if depth > 2 or kind < 0.4:
            return self.anchor()
        if kind < 0.6:
            return f"[{self.scalar(depth + 1)},{self.scalar(depth + 1)}]"
        if kind < 0.7:
            return f"({self.anchor()} - {self.anchor()})"
        if kind < 0.8:
            return f"({self.anchor()} + [{self.number()},0].r({self.scalar(depth + 1)}))"
        if kind < 0.9:
            return f"({self.anchor()} + [_,0])"
        return f"({self.vector(depth + 1)}*{self.scalar(depth + 1)})"

    def statement(self) -> str:
        r = self.random
        kind = r.random()
        if kind < 0.55:
            return f"{self.anchor()} = {self.vector()};"
        if kind < 0.7:
            return f"{r.choice(self.things)}.angle = {self.scalar()};"
        if kind < 0.8:
            return f"{r.choice('xyz')} = {self.scalar()};"
        if kind < 0.87:
            return f"{self.scalar(2)} {r.choice('<>')} {self.scalar(1)};"
        if kind < 0.93:
            return f"({self.anchor()}-{self.anchor()}).l = {self.scalar(2)};"
        return f"{self.anchor()} ~ {self.vector(2)};" if kind < 0.96 else f"{self.anchor()} = _;"

    def script(self) -> str:
        r = self.random
        lines = [".config(10);"]
        for i in range(r.randint(1, 4)):
            name = f"T{i}"
            self.things.append(name)
            if r.random() < 0.2:
                lines.append(f"{name} : .disc(5) c=[{self.number()},{self.number()}];")
                self.anchors.append(f"{name}.c")
            else:
                third = f" r=p+[{self.number()},{self.number()}]" if r.random() < 0.3 else ""
                reach = r.choice(["40", "70.5", "-100"])
                lines.append(f"{name} : .bar p=[{self.number()},{self.number()}] q=p+[{reach},{self.number()}]{third};")
                self.anchors += [f"{name}.p", f"{name}.q"]
        time = 0.0
        for _ in range(r.randint(1, 3)):
            lines.append(f"@{time} " + " ".join(self.statement() for _ in range(r.randint(1, 5))))
            time += r.choice([0, 1, 0.5, 2])
        return "\n".join([*lines, f"@{time}", ""])
