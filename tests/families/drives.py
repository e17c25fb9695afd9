"""Drives split into steps that hold, run, ease, reverse and end, and the same drives as one expression.

A mechanism is grown as in `scattered`, drawn as it stands, and one statement drives it. What the drive does over time
is a function with corners. Written as one expression it needs no steps; written in steps, each holds, runs or eases.
Both must come to the same poses.
"""

from __future__ import annotations

import cmath
import math
import random
from dataclasses import dataclass

from tests.families.scattered import Growing, number, script, vector


@dataclass(frozen=True)
class Drive:
    """``statement`` with ``{}`` for the driven value, which begins as ``value`` and may change by about ``range``;
    ``others`` are statements that go with it.
    """

    statement: str
    value: float
    range: float
    others: tuple[str, ...] = ()


def _drives(grown: Growing, crank: str, how: str) -> Drive:
    """A way to drive the thing ``crank``, whose anchor A is pinned."""
    a, b = grown.scene.place(crank, "A"), grown.scene.place(crank, "B")
    length, turn = abs(b - a), math.degrees(cmath.phase(b - a))
    match how:
        case "angle":  # drawn as it stands: not turned
            return Drive(f"{crank}.angle = {{}};", 0.0, 12.0)
        case "polar":
            return Drive(f"{crank}.B = {crank}.A + [{number(length)}, 0].r({{}});", turn, 12.0)
        case "polar by a variable":
            return Drive("th = {};", turn, 12.0, (f"{crank}.B = {crank}.A + [{number(length)}, 0].r(th);",))
        case "direction":
            return Drive(f".a([1,0], {crank}.B - {crank}.A) = {{}};", turn, 12.0)
        case "coordinate":
            if abs((b - a).imag) < 0.5 * length:
                return Drive(f"{crank}.B.y = {{}};", b.imag, 0.2 * length)
            return Drive(f"{crank}.B.x = {{}};", b.real, 0.2 * length)
        case "length" | "length by a variable":
            far = a + 1.3j * (b - a) + 0.4 * (b - a)
            reach = abs(b - far)
            if how == "length":
                return Drive(f"({crank}.B - {vector(far)}).l = {{}};", reach, 0.1 * length)
            return Drive("c = {};", reach, 0.1 * length, (f"({crank}.B - {vector(far)}).l = c;",))
        case "cylinder":  # a rod that turns about its foot, its length along itself a variable
            far = a + 1.3j * (b - a) + 0.4 * (b - a)
            rod = grown.thing(far, far + 0.7 * (b - far))
            reach, lie = abs(b - far), math.degrees(cmath.phase(b - far))
            tied = f"{crank}.B = {rod}.A + [c, 0].r({rod}.angle + {number(lie)});"
            return Drive("c = {};", reach, 0.1 * length, (f"{rod}.A = {vector(far)};", tied))
        case "between floating links":
            end = grown.near(b, 0.5, 0.9)
            link = grown.thing(b, end)
            pivot = grown.near(end, 0.8, 1.4)
            rocker = grown.thing(end, pivot)
            others = (f"{link}.A = {crank}.B;", f"{rocker}.A = {link}.B;", f"{rocker}.B = {vector(pivot)};")
            return Drive(f"{link}.angle - {crank}.angle = {{}};", 0.0, 6.0, others)
        case _:
            raise ValueError(how)


WAYS = (
    "angle", "polar", "polar by a variable", "direction", "coordinate", "length", "length by a variable", "cylinder",
    "between floating links",
)  # fmt: skip


def split_and_whole(seed: int, way: str | None = None) -> tuple[str, str, str]:
    """The script in steps, the same with one expression, and how it is driven."""
    chooser = random.Random(seed)
    how = way or WAYS[seed % len(WAYS)]
    grown = Growing(seed)
    a = complex(200.0, 150.0)
    crank = grown.thing(a, grown.near(a, 0.4, 0.6))
    grown.pin(crank, "A")
    grown.points.append((crank, "B"))
    grown.driven.add(crank)
    drive = _drives(grown, crank, how)
    grown.scene.statements += drive.others
    for _ in range(chooser.randint(1, 3)):
        grown.random.choice([grown.grounded_dyad, grown.dyad, grown.slider])()
    base = script(grown.scene, seed, "closed")
    times, values, kinds = [0.0], [0.0], []
    for _ in range(chooser.randint(2, 5)):
        kinds.append(chooser.choice(["hold", "run", "ease", "reverse"]))
        times.append(times[-1] + chooser.choice([0.25, 0.5, 0.7, 1.0, 1.3]))
        by = chooser.uniform(0.3, 1.0) * chooser.choice([-1, 1])
        aim = {"hold": values[-1], "reverse": -values[-1]}.get(kinds[-1], by)
        values.append(aim)
    steps: list[str] = []
    whole: list[str] = []
    for i, kind in enumerate(kinds):
        begin, end = (drive.value + drive.range * values[k] for k in (i, i + 1))
        length = times[i + 1] - times[i]
        since = f"(.t - {number(times[i])})"

        def text(clock: str, begin=begin, end=end, kind=kind, length=length) -> str:
            if begin == end:
                return number(begin)
            share = f"{clock}/{number(length)}"
            share = f".ease({share})" if kind == "ease" else f"({share})"
            return f"{number(begin)} + {number(end - begin)}*{share}"

        steps.append(("@0  " if i == 0 else f"@{number(times[i])}  ") + drive.statement.format(text(".t")))
        whole.append(f" > {number(times[i])} : " * (i > 0) + text(since))
    last = f"@{number(times[-1])}\n"
    held = drive.statement.format(number(drive.value + drive.range * values[-1]))
    after = f"@{number(times[-1])}  {held}\n@{number(times[-1] + 0.5)}\n" if chooser.random() < 0.5 else last
    final = number(drive.value + drive.range * values[-1])
    tail = f" > {number(times[-1])} : {final}" if after != last else ""
    single = drive.statement.format("{ .t : " + "".join(whole) + tail + " }")
    end = f"@{number(times[-1] + (0.5 if after != last else 0.0))}\n"
    head, rest = base.split("@0\n")
    return (
        head + steps[0] + "\n" + rest + "\n".join(steps[1:]) + "\n" + after,
        head + "@0  " + single + "\n" + rest + end,
        how,
    )
