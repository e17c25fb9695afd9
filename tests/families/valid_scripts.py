"""Scripts that mean something: a typed generator over the whole language, extreme numbers included.

`script` builds a scene out of modules that people write (a crank, a dyad, a slider, gears, an integral, a wish, …), and
adds statements of the right kinds about their anchors and variables. Most of its scripts pass syntax and names; whether
they have a solution is left to chance. `lines` says which commands are run on one.
"""

from __future__ import annotations

import random
from collections.abc import Callable

EXTREME = (
    *("9e299", "-9e299", "1e200", "1e154", "-1e153", "1e152", "1e100", "-1e100", "1e-100", "1e-300", "1e399", "0"),
    *("1e16", "-1e16", "1e17", "1e-16", "1e11", "-3e11", "3e10", "1e-12", "1e9", "-1e9", "1e7", "1e-7", "1e5", "1e-5"),
    *("99999999999999999999", "0.30000000000000004", "1e-9", "123456789.123456789", "4000", "1e3", "1e-3", "1e8"),
)
COLORS = ("'orange'", "'#3366cc'", "'seagreen'", "'white'")
BODIES = (".bar", ".bar", ".bar", ".arrow", ".plate", ".polygon", ".disc({n})")


class Writer:
    """Writes one script. ``extreme``: how many of its numbers are at the ends of what floats hold."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.extreme = chance.choice((0.0, 0.0, 0.02, 0.02, 0.1, 0.3))
        self.points: list[str] = []
        self.things: list[str] = []
        self.scalars: list[str] = []
        self.vectors: list[str] = []
        self.discs: list[str] = []
        self.lets: list[str] = []
        self.vector_lets: list[str] = []
        self.head: list[str] = []
        self.first: list[str] = []
        self.keys: list[tuple[str, str]] = []
        """What later steps may state anew: left-hand sides and their kinds."""
        self.count = 0

    # --- numbers and expressions ---

    def number(self, low: float = -120.0, high: float = 120.0) -> str:
        if self.chance.random() < self.extreme:
            text = self.chance.choice(EXTREME)
            return text if low < 0.0 else text.lstrip("-")
        if self.chance.random() < 0.7:
            return str(self.chance.randint(round(low), round(high)))
        return repr(round(self.chance.uniform(low, high), self.chance.choice((1, 3, 9))))

    def positive(self, high: float = 100.0) -> str:
        return self.number(1.0, high)

    def name(self, kind: str) -> str:
        self.count += 1
        return f"{kind}{self.count}"

    def reading(self) -> str:
        """An expression that a text or a claim may show: nothing in it has to be solved for."""
        while True:
            text = self.scalar(1)
            if not any(word in text for word in (".i(", ".d(", "_", ".iv", ".s")):
                return text

    def scalar(self, depth: int = 2) -> str:
        """An expression that is a number."""
        chance, inside = self.chance, self.scalar
        if depth <= 0 or chance.random() < 0.2:
            leaves = [self.number(), self.number(), f"{self.number()}*.t", ".t", ".s", ".T", ".t/.iv", ".pi"]
            leaves += self.scalars + self.lets
            leaves += [f"{p}.{chance.choice('xy')}" for p in self.points[-4:]] + [
                f"{t}.angle" for t in self.things[-3:]
            ]
            return chance.choice(leaves)
        d = depth - 1
        options: list[Callable[[], str]] = [
            lambda: f"{inside(d)} {chance.choice('+-*')} {inside(d)}",
            lambda: f"({inside(d)} {chance.choice('+-')} {inside(d)})*{self.number()}",
            lambda: f"({inside(d)})/({inside(d)})",
            lambda: f"-({inside(d)})",
            lambda: f"({inside(d)})^{chance.choice(('2', '3', '2', '0.5', '(1/3)', '-1', '(-2)', self.positive()))}",
            lambda: (
                f"{chance.choice(('.sin', '.cos', '.tan', '.abs', '.atan', '.sqrt', '.exp', '.ease'))}({inside(d)})"
            ),
            lambda: f"{chance.choice(('.asin', '.acos', '.ln', '.floor', '.q'))}({inside(d)})",
            lambda: f"{chance.choice(('.min', '.max', '.atan2', '.mod'))}({inside(d)}, {inside(d)})",
            lambda: f"({self.vector(d)} - {self.vector(0)}).{chance.choice(('l', 'x', 'y', 'length'))}",
            lambda: f".a({self.vector(0)} - {self.vector(0)}, {self.vector(d)})",
            lambda: f"{chance.choice(('.across', '.along'))}({self.vector(0)}, {self.vector(0)}, {self.vector(0)})",
            lambda: f"{{ {inside(0)} < {inside(0)} : {inside(d)}; {inside(d)} }}",
            lambda: f"{{ {inside(0)} : {inside(0)} > {inside(0)} : {inside(d)} }}",
            lambda: f".i({inside(d)})",
            lambda: f".d({inside(d)})",
        ]
        return chance.choices(options, [6, 4, 2, 2, 3, 5, 2, 2, 4, 1, 2, 1, 1, 1.5, 1])[0]()

    def vector(self, depth: int = 1) -> str:
        """An expression that is a place or an arrow."""
        chance = self.chance
        leaves = [f"[{self.number()}, {self.number()}]", *self.points[-5:], *self.vectors, *self.vector_lets]
        if depth <= 0 or chance.random() < 0.3:
            return chance.choice(leaves)
        d = depth - 1
        options: list[Callable[[], str]] = [
            lambda: f"{self.vector(d)} {chance.choice('+-')} {self.vector(d)}",
            lambda: f"({self.vector(d)})*{self.scalar(d)}",
            lambda: f"({self.vector(d)}/{self.positive()})",
            lambda: f"[{self.scalar(d)}, {self.scalar(d)}]",
            lambda: f"[{self.number()}, 0].r({self.scalar(d)})",
            lambda: f"({self.vector(d)} + ({self.vector(d)} - {self.vector(0)})*.s)",
            lambda: f".i([{self.scalar(d)}, {self.scalar(d)}])",
            lambda: f".d({self.vector(d)})",
            lambda: f"[_, {self.scalar(d)}]",
        ]
        return chance.choices(options, [4, 2, 1, 4, 4, 1, 0.7, 0.7, 1])[0]()

    # --- definitions ---

    def look(self) -> str:
        options = (
            "",
            "",
            "",
            f".color({self.chance.choice(COLORS)})",
            f".width({self.positive(9)})",
            ".pins",
            ".hidden",
        )
        return self.chance.choice(
            (*options, f".opacity({self.chance.choice(('0.5', '1', '0'))})", f".layer({self.number()})")
        )

    def body(self, kind: str, anchors: int = 2) -> tuple[str, list[str]]:
        """Define a thing; its name and its anchors."""
        name = self.name("B")
        anchors = max(anchors, 3 if kind == ".polygon" else 1)
        places = [f"P = [{self.number()}, {self.number()}]"]
        for letter in "QRS"[: anchors - 1]:
            way = self.chance.choice(("P + [{x}, {y}]", "[{x}, {y}]", "P + [{x}, 0].r({y})", "P - [{x}, {y}]"))
            places.append(f"{letter} = " + way.format(x=self.positive(), y=self.number()))
        points = [f"{name}.{letter}" for letter in "PQRS"[:anchors]]
        self.head.append(f"{name} : {kind.format(n=self.positive(30))} {'  '.join(places)} {self.look()};")
        self.things.append(name)
        self.points += points
        if kind.startswith(".disc"):
            self.discs.append(name)
        return name, points

    def place(self) -> str:
        """Where something is pinned: a fixed place, or an anchor that is there."""
        if self.points and self.chance.random() < 0.5:
            return self.chance.choice(self.points)
        return f"[{self.number()}, {self.number()}]"

    def state(self, left: str, right: str, kind: str, sign: str = "=") -> None:
        self.first.append(f"{left} {sign} {right};")
        if sign == "=":
            self.keys.append((left, kind))

    # --- modules: each adds things, and statements of the first step ---

    def crank(self) -> None:
        place = self.place()
        name, points = self.body(self.chance.choice(BODIES), self.chance.choice((2, 2, 3)))
        self.state(points[0], place, "vector")
        self.state(
            f"{name}.angle",
            self.chance.choice(("{n}*.t", "{n}*.sin({m}*.t)", "{n} -> {m}", "{n}")).format(
                n=self.number(-360, 360), m=self.number(-360, 360)
            ),
            "scalar",
        )

    def dyad(self) -> None:
        start, pivot = self.place(), self.place()
        _, one = self.body(self.chance.choice(BODIES), self.chance.choice((2, 3)))
        _, two = self.body(self.chance.choice(BODIES), 2)
        self.state(one[0], start, "vector")
        self.state(two[0], pivot, "vector")
        self.state(one[1], two[1], "vector")

    def slider(self) -> None:
        start = self.place()
        _, one = self.body(".bar", 2)
        self.state(one[0], start, "vector")
        variable = self.name("x")
        self.state(
            one[1], self.chance.choice((f"[{variable}, {self.number()}]", f"[{self.number()}, {variable}]")), "vector"
        )
        self.scalars.append(variable)
        if self.chance.random() < 0.5:
            self.first.append(f"{variable} {self.chance.choice('<>')} {self.scalar(1)};")

    def slot(self) -> None:
        name, one = self.body(".bar", 2)
        self.state(one[0], self.place(), "vector")
        if self.chance.random() < 0.6 and len(self.points) > 3:
            self.first.append(
                f".across({self.chance.choice(self.points[:-2])}, {one[0]}, {one[1]}) ="
                f" {self.chance.choice(('0', '0', self.number()))};"
            )
        else:
            self.state(f"{name}.angle", self.scalar(2), "scalar")

    def distances(self) -> None:
        _, one = self.body(".disc({n})", 1)
        for _ in range(self.chance.choice((1, 2, 2))):
            self.state(f"({one[0]} - {self.place()}).l", self.positive(200), "scalar")
        if self.chance.random() < 0.4:
            self.first.append(f"{one[0]}.y {self.chance.choice('<>')} {self.number()};")

    def variable(self) -> None:
        name = self.name("v")
        self.state(name, self.scalar(3), "scalar")
        self.scalars.append(name)

    def vector_variable(self) -> None:
        name = self.name("w")
        self.state(name, self.vector(2), "vector")
        self.vectors.append(name)

    def implicit(self) -> None:
        name = self.name("u")
        self.scalars.append(name)
        self.state(f"({self.scalar(2)})", name, "scalar")

    def equation(self) -> None:
        """Two rates of each other: a spring, a growth, an oscillator."""
        y, v = self.name("y"), self.name("v")
        self.first += [f"{y} = {self.number()} + .i({v});"]
        self.first += [
            f"{v} = {self.number()} - .i({self.number(0, 9)}*{self.chance.choice((y, v, f'.sin({y})', f'{y}*{v}'))});"
        ]
        self.scalars += [y, v]

    def gears(self) -> None:
        module, first, second = self.positive(6), self.chance.randint(10, 40), self.chance.randint(6, 40)
        a, b = self.name("G"), self.name("G")
        inner = self.chance.random() < 0.2
        second = min(second, first - 2) if inner else second
        self.head.append(f"{a} : .gear({first}, {module}) {'.inner' if inner else ''} C = [0,0] T = C + [5,0];")
        self.head.append(f"{b} : .gear({second}, {module}) C = [0,0] T = C + [0,5];")
        apart = f"{module}*({first} {'-' if inner else '+'} {second})/2"
        self.first += [f"{a}.C = [{self.number()}, {self.number()}];", f"{b}.C = {a}.C + [{apart}, 0];"]
        self.first += [f".mesh({a}, {b}) = 0;", f"{a}.angle = {self.number()}*.t;"]
        self.things += [a, b]
        self.points += [f"{a}.T", f"{b}.T"]

    def belt(self) -> None:
        a, one = self.body(".disc({n})", 2)
        b, two = self.body(".disc({n})", 2)
        self.first += [f"{one[0]} = {self.place()};", f"{two[0]} = [{self.number()}, {self.number()}];"]
        self.first += [
            f".belt({a}, {b}){self.chance.choice(('', ' .crossed'))} = 0;",
            f"{a}.angle = {self.number()}*.t;",
        ]

    def part(self) -> None:
        name, copies = self.name("Leg"), self.name("C")
        self.head.append(
            f".part {name}(len = {self.positive()}, phase = {self.number()}) {{\n"
            f"  A : .bar P = [0,0] Q = P + [len, {self.number()}];\n"
            f"  @0 A.angle = phase{self.chance.choice((' + 30*.t', '', '*.s'))};"
            f" {self.chance.choice(('', 'y = A.Q.x;', '.claim A.Q.y <= 1e3;'))}\n}}"
        )
        placed = self.chance.choice(
            ("", f".at([{self.number()}, {self.number()}])", f".turned({self.number()})", ".mirrored")
        )
        if self.chance.random() < 0.5:
            self.head.append(f"{copies} : {name}({self.positive()}) {placed};")
            points = [f"{copies}.A.P", f"{copies}.A.Q"]
        else:
            self.head.append(f"{copies}[k = 0..2] : {name}({self.positive()}*(k + 1), {self.number()}*k) {placed};")
            points = [f"{copies}[{k}].A.{p}" for k in range(3) for p in "PQ"]
            if self.chance.random() < 0.5:
                self.first.append(f".for k = 1..2 {{ {copies}[k].A.P = {copies}[k-1].A.Q; }}")
        if self.chance.random() < 0.7:
            self.first.append(f"{points[0]} = {self.place()};")
        self.points += points

    def wish(self) -> None:
        if not self.points:
            return self.crank()
        speed = self.chance.choice(("", f" .speed({self.positive(200)})"))
        if self.chance.random() < 0.7:
            self.first.append(f"{self.chance.choice(self.points)} ~ {self.vector(1)}{speed};")
        else:
            self.first.append(
                f"{self.chance.choice([f'{t}.angle' for t in self.things] or ['u'])} ~ {self.scalar(1)}{speed};"
            )
        return None

    def free(self) -> None:
        _, points = self.body(self.chance.choice(BODIES), self.chance.choice((2, 3)))
        if self.chance.random() < 0.8:
            self.state(self.chance.choice(points), self.place(), "vector")

    def visibility(self) -> None:
        if self.things:
            self.first.append(
                f"{self.chance.choice(self.things)}.{self.chance.choice(('opacity', 'angle'))} = {self.scalar(1)};"
            )

    def anything(self) -> None:
        """A statement about what is there, of the right kinds."""
        if self.chance.random() < 0.5 and self.points:
            self.first.append(f"{self.chance.choice(self.points)} {self.chance.choice('==~')} {self.vector(2)};")
        else:
            self.first.append(f"({self.scalar(1)}) {self.sign()} {self.scalar(2)};")

    def sign(self) -> str:
        return self.chance.choices(("=", "~", "<", ">", "<=", ">="), (6, 2, 1, 1, 1, 1))[0]

    # --- what is drawn, claimed, and the rest ---

    def figure(self) -> None:
        if not self.points:
            return
        a, b, c = (self.chance.choice(self.points) for _ in range(3))
        name = self.name("F")
        kinds = [f".line {a} {b}", f".spring {a} {b}", f".damper {a} {b}", f".cylinder {a} {b}", f".slide {a} {b}"]
        kinds += [f".trace {a} {self.chance.choice(('.whole', '.tail(' + self.positive(3) + ')', ''))}", f".ground {a}"]
        kinds += [f".dimension {a} {b} .places(1)", f".arc {a} {b} {c}", f".vector {a} .velocity({self.number()})"]
        kinds += [
            f".label('{{{self.reading()}:.1f}}') at = [{self.number()}, {self.number()}]",
            f".vector {a} .acceleration(0.1)",
        ]
        self.head.append(f"{name} : {self.chance.choice(kinds)};")

    def later(self, left: str, kind: str) -> str:
        way = self.chance.randrange(8)
        if way == 0:
            return f"{left} = _;"
        if kind == "vector":
            target = self.vector(1)
            return f"{left} = {target} -> {self.vector(0)};" if way < 3 else f"{left} = {target};"
        return f"{left} = {self.number()} -> {self.scalar(0)};" if way < 3 else f"{left} = {self.scalar(2)};"

    MODULES = (
        (crank, 8), (dyad, 7), (slider, 5), (slot, 3), (distances, 3), (variable, 3), (vector_variable, 1),
        (implicit, 1.5), (equation, 1), (gears, 1.5), (belt, 0.7), (part, 2), (wish, 2.5), (free, 2),
        (visibility, 0.7), (anything, 2),
    )  # fmt: skip

    def text(self) -> str:
        chance = self.chance
        size = chance.choice(("", "", ", 400, 300"))
        theme = chance.choice(("", "", "", ".theme('textbook')", ".background('white')"))
        config = f".config({chance.choice(('4', '10', '3', '24000/1001'))}{size}) {theme};"
        for _ in range(chance.choice((0, 1, 2))):
            name = self.name("c")
            bounds = chance.choice(("", f" .range({chance.randint(0, 5)}, {chance.randint(6, 200)})"))
            self.head.append(f".let {name} = {self.positive()}{bounds};")
            self.lets.append(name)
        if chance.random() < 0.2:
            name = self.name("o")
            self.head.append(f".let {name} = [{self.number()}, {self.number()}];")
            self.vector_lets.append(name)
        for _ in range(chance.randint(1, 4)):
            modules, weights = zip(*self.MODULES, strict=True)
            chance.choices(modules, weights)[0](self)
        for _ in range(chance.choice((0, 0, 1, 2))):
            self.figure()
        if chance.random() < 0.2:
            self.first.append(f".claim {self.reading()} {chance.choice(('<=', '>', '='))} {self.reading()};")
        steps = [f"@{chance.choice(('0', '0', '0', '1', self.number(0, 9)))} " + "\n   ".join(self.first)]
        for _ in range(chance.choice((0, 0, 1, 2))):
            length = chance.choice(("0.5", "1", "2", "1/3", self.number(0, 3)))
            some = [self.later(*chance.choice(self.keys)) for _ in range(chance.randint(0, 2)) if self.keys]
            steps.append(f"@+{length} {' '.join(some)}")
        ending = chance.choice(("@+1", "@+1", "@+2", "@+1 .loop;", "", f"@+{self.positive(4)}"))
        return "\n".join([config, *self.head, *steps, ending]) + "\n"


def script(chance: random.Random) -> str:
    """A script that passes syntax and names, nearly always."""
    return Writer(chance).text()


def lines(chance: random.Random, text: str) -> list[list[str]]:
    """The commands to be run on ``any.mov``: always `check`; a picture, poses, many digits or a sweep."""
    small = ["--max-frames", "300"]
    found = [["check", "any.mov", "--format", "json", *chance.choice(([], ["--freedom"])), *small]]
    constant = next((line.split()[1] for line in text.splitlines() if line.startswith(".let c")), None)
    more = [
        ["run", "any.mov", "-o", "out.gif", *small, "--max-pixels", "1000000"],
        [
            "run",
            "any.mov",
            "--at",
            chance.choice(("0", "0.25", "1")),
            "-o",
            "out.png",
            *small,
            "--max-pixels",
            "1000000",
        ],
        ["run", "any.mov", "-o", "out.svg", *small, "--on-failure", "skip"],
        ["solve", "any.mov", "-o", "out.csv", *small, "--on-failure", "hold"],
        ["solve", "any.mov", "-o", "out.csv", "--accuracy", "high", "--frames", "0:3", *small],
        ["solve", "any.mov", "-o", "out.csv", "--accuracy", "exact", "--digits", "25", "--frames", "0:2", *small],
    ]
    if constant is not None:
        values = chance.choice(("1:100:5", "0,1,1e9", "1e-300,1e100"))
        sweep = ["sweep", "any.mov", "--vary", f"{constant}={values}", "--measure", "m = .max(.T)"]
        more += [[*sweep, "-o", "out.csv", *small]] * 4
    return [*found, chance.choice(more)]
