"""Scripts with the velocities of what is free, trails or follows wishes."""

from __future__ import annotations

import random
from collections.abc import Iterator


def scripts(seed: int) -> Iterator[tuple[str, list[str], list[str]]]:
    """(script, anchors that free motion moves, anchors with an acceleration); variables ``v0`` … are the velocities of
    the former, ``a0`` … the accelerations of the latter.
    """
    rng = random.Random(seed)

    def number(low: float, high: float) -> str:
        return f"{rng.uniform(low, high):.2f}"

    def point(reach: float = 150) -> str:
        return f"[{number(-reach, reach)}, {number(-reach, reach)}]"

    def drive() -> str:
        a, w, b = number(20, 60), number(60, 200), number(10, 40)
        return rng.choice([f"{a}*.t", f"{a}*.sin({w}*.t) + {b}", f"{b}*.t*.t - {a}", f"{b}*.abs(.t - 1.03)"])

    def wish() -> str:
        speed = rng.choice(["", f" .speed({number(5, 60)})"])
        goal = rng.choice([point(), f"[{number(50, 120)}*.cos({number(30, 90)}*.t), {number(50, 120)} + 20*.t]"])
        return f"{goal}{speed}"

    def wished_rod() -> tuple[list[str], list[str], list[str], list[str]]:
        return (
            [f"Rod : .bar P=[0,0] Q=[{number(60, 120)},0]; Arm : .bar P=[0,0] Q=[0,{number(40, 90)}];"],
            [f"Rod.P=[{number(-20, 20)}, {drive()}]; Arm.P = Rod.Q; Arm.Q ~ {wish()};"],
            ["Rod.Q", "Arm.Q"],
            [],
        )

    def trailer() -> tuple[list[str], list[str], list[str], list[str]]:
        return (
            [f"Crank : .bar P=[0,0] Q=[{number(30, 90)},0];"]
            + [f"Tail{k} : .bar P=[0,0] Q=[{number(40, 120)},{number(-40, 40)}];" for k in (1, 2)],
            [f"Crank.P=[0,0]; Crank.angle={drive()}; Tail1.P=Crank.Q; Tail2.P=Tail1.Q;"],
            ["Tail1.Q", "Tail2.Q"],
            ["Tail2.Q"],
        )

    def free_loop() -> tuple[list[str], list[str], list[str], list[str]]:
        return (
            [
                f"Crank : .bar A=[0,0] B=[{number(30, 50)},{number(5, 30)}];",
                f"Coupler : .bar B=[30,0] C=[{number(140, 170)},{number(60, 90)}];",
                f"Rocker : .bar C=[0,{number(90, 120)}] D=[0,0];",
            ],
            [
                f"Crank.A=[0,0]; Coupler.B=Crank.B; Rocker.C=Coupler.C; Rocker.D=[130 + {number(1, 9)}*.t, 0];",
                f"Crank.B ~ {wish()};",
            ],
            ["Crank.B", "Coupler.C"],
            [],
        )

    def dyad_on_a_free_point() -> tuple[list[str], list[str], list[str], list[str]]:
        return (
            ["Rod : .bar P=[0,0] Q=[60,0]; One : .bar A=[0,0] B=[90,40]; Two : .bar B=[0,80] C=[0,0];"],
            [f"Rod.P=[0,0]; One.A=Rod.Q; Two.B=One.B; Two.C=[110,0]; Rod.Q ~ [{number(10, 50)},{number(20, 50)}];"],
            ["One.B", "Rod.Q"],
            [],
        )

    def followers() -> tuple[list[str], list[str], list[str], list[str]]:
        return (
            ["Rod : .bar P=[0,0] Q=[80,0]; Hodograph : .disc(3) O=[0,0]; Tail : .bar P=[0,0] Q=[90,0];"],
            [f"Rod.P=[0,0]; Rod.Q ~ {wish()}; Hodograph.O = [200,0] + 0.1*.d(Rod.Q) + [0, 30*.t];", "Tail.P = Rod.Q;"],
            ["Rod.Q", "Tail.Q"],
            [],
        )

    for make in (wished_rod, trailer, free_loop, dyad_on_a_free_point, followers):
        things, statements, moved, accelerated = make()
        asked = [f"v{k} = .d({anchor});" for k, anchor in enumerate(moved)]
        asked += [f"a{k} = .d(.d({anchor}));" for k, anchor in enumerate(accelerated)]
        claims = [f".claim v{k}.l < 100000;" for k in range(len(moved))]
        body = [*statements, *asked, *claims]
        rng.shuffle(body)
        yield "\n".join([".config(20);", *things, "@0", *body, "@2"]), moved, accelerated
