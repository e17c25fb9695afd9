"""How long somebody waits who edits a script: medians, in one process, warm.

    python benchmarks/live.py [--rounds N] [--only NAME,NAME]

For every script of the gallery (milliseconds): what parsing and the scene take; the whole answer (all diagnostics of
the motion) from nothing, after an edit of a comment, and after an edit of a number in the last step that has one; the
first picture after that edit, at the middle of the film; and the debugger's answer to a statement typed there. Then a
move of a hand: Peaucellier's cell and two tilings are dragged along a curve.
"""

# ruff: noqa: E402 (the number of threads is set before NumPy is imported)

from __future__ import annotations

import argparse
import gc
import math
import os
import re
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # the checkout, where it is not installed
for _library in ("OPENBLAS", "MKL", "OMP"):  # as the commands do
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

from penrose import transformable

from movimentum.analysis.interactive.drag import Grip
from movimentum.errors import MovimentumError
from movimentum.expressions import symbol
from movimentum.interop.linkages import linkage_script
from movimentum.repl.session import Session, opened
from movimentum.repl.shell import answer
from movimentum.scene.model import AnchorCoordinate
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
_NUMBER = re.compile(r"(?<![\w.@])\d+(?:\.\d+)?(?![\w.])")
MOVES = 200


def milliseconds(work: Callable[[], object]) -> float:
    """The wall-clock time of one call."""
    begin = time.perf_counter()
    work()
    return 1000.0 * (time.perf_counter() - begin)


def last_number(path: Path, text: str) -> tuple[int, int] | None:
    """Where the last number stands that can be replaced in a step."""
    for match in reversed(list(_NUMBER.finditer(text, text.index("@")))):
        if not Engine().revise(SourceText(str(path), f"{text[: match.start()]}7.25{text[match.end() :]}")).moves:
            continue
        if not text[: match.start()].rstrip().endswith("@"):
            return match.start(), match.end()
    return None


def with_other_numbers(path: Path, text: str) -> Iterator[str]:
    """The text with one number after the other, near to what it was."""
    place = last_number(path, text)
    if place is None:
        raise ValueError("there is no number in any step")
    begin, end = place
    for count in range(1, 10**6):
        yield f"{text[:begin]}{float(text[begin:end]) + 1e-4 * count:.6f}{text[end:]}"


def edits(path: Path, rounds: int) -> list[float]:
    """The row of one script."""
    text = path.read_text(encoding="utf-8")

    def source(other: str) -> SourceText:
        return SourceText(str(path), other)

    def said(engine: Engine, other: str) -> object:
        return engine.revise(source(other)).diagnostics

    engine = Engine()
    said(engine, text)
    read = [milliseconds(lambda: Engine().revise(source(text)).timeline) for _ in range(rounds)]
    nothing = [milliseconds(lambda: said(Engine(), text)) for _ in range(rounds)]
    comment = [milliseconds(lambda n=n: said(engine, f"// edit {n}\n{text}")) for n in range(rounds)]
    numbers = with_other_numbers(path, text)
    last = [milliseconds(lambda: said(engine, next(numbers))) for _ in range(rounds)]
    middle = (engine.revise(source(text)).timeline.start + engine.revise(source(text)).timeline.end) / 2
    said(engine, text)
    picture = [milliseconds(lambda: first_picture(engine, source(next(numbers)), middle)) for _ in range(rounds)]
    session = opened(str(path), Choices())
    assert session.work.diagnostics is not None
    try:
        stated(session.at(middle), -1)
        session = session.at(middle)
    except MovimentumError:  # the middle is in one turn of a loop
        session = session.at(Fraction(0))
    typed = [milliseconds(lambda n=n: stated(session, n)) for n in range(rounds)]
    return [statistics.median(row) for row in (read, nothing, comment, last, picture, typed)]


def first_picture(engine: Engine, source: SourceText, time: Fraction) -> None:
    """What the engine shows before the path is known."""
    if engine.revise(source).preview(time) is None:
        raise ValueError(f"{source.path}: no picture")


def stated(session: Session, number: int) -> None:
    """Type a statement that is true already."""
    scene = session.work.scene
    thing = next(each for each in scene.things if each.is_body and each.number in scene.mentioned)
    answer(session, f"{thing.name}.angle > {-5000 - number};")


def drags() -> Iterator[tuple[str, float, float]]:
    """What is dragged, and the median and the 95th percentile of a move, placements of all things included."""
    cell = re.sub(r"^[^/\n]*~[^;]*;", "", (SCRIPTS / "peaucellier-linkage.mov").read_text(encoding="utf-8"), flags=re.M)
    five = (SCRIPTS / "penrose-five.mov").read_text(encoding="utf-8")
    whole = linkage_script(transformable(4), "tiling of order 4")
    for name, text in (("Peaucellier's cell", cell), ("penrose-five", five), ("tiling of 571 vertices", whole)):
        revision = Engine().revise(SourceText(str(SCRIPTS / "dragged.mov"), text))
        segment_motion = revision.motion.segments[0]
        for thing in reversed([each for each in revision.scene.things if each.is_body and len(each.anchors) > 1]):
            left = [symbol(AnchorCoordinate(thing.number, 1, axis)) for axis in (0, 1)]
            grip = Grip(segment_motion, segment_motion.pieces[0], 0.0, left)  # pyright: ignore[reportArgumentType]
            if not grip.fixed:
                break
        x, y = thing.anchors[1].local
        took: list[float] = []
        for k in range(MOVES):
            target = (x + 25 * math.sin(k / 15) + 3, y + 25 * math.sin(k / 11))
            took.append(milliseconds(lambda held=grip, goal=target: (held.move(goal), held.placements())))
        yield name, statistics.median(took), sorted(took)[int(0.95 * MOVES)]


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="")
    chosen = parser.parse_args()
    gc.freeze()  # as the commands do
    gc.set_threshold(200_000, 50, 100)
    only = set(chosen.only.split(",")) - {""}
    print(f"{'':22}" + "".join(f"{head:>12}" for head in ("read", "nothing", "comment", "number", "picture", "typed")))
    for path in sorted(SCRIPTS.glob("*.mov")):
        if not only or path.stem in only:
            print(f"{path.stem:22}" + "".join(f"{value:12.1f}" for value in edits(path, chosen.rounds)), flush=True)
    if not only or "drag" in only:
        print(f"\n{'a move of a hand':28}{'median':>10}{'95 %':>10}")
        for name, median, most in drags():
            print(f"{name:28}{median:10.1f}{most:10.1f}", flush=True)


if __name__ == "__main__":
    main()
