"""Kinds of things: one record each, found by itself; and the recipe of docs/how-to-add.md, followed."""

from __future__ import annotations

import os
import pickle
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from movimentum.drawing.figures import FIGURES
from movimentum.drawing.symbols import CAPTIONS, SYMBOLS
from movimentum.syntax.grammar import grammar_text
from movimentum.things.kind import ThingKind
from movimentum.things.registry import KINDS, SHAPES, kind_of
from tests.broad import broad
from tests.command import ROOT

MARKS = {"sprite", "arrow", "label", "trace", "graph", "velocities", "polode", "skeleton", "group", "inset"}
"""Kinds that are drawn by a mark of their own."""


def test_the_grammar_has_the_words_of_all_kinds() -> None:
    for word in SHAPES:
        assert re.search(rf"^{word.upper()}: /\\\.{word}\(", grammar_text(), re.MULTILINE), word


@pytest.mark.parametrize("kind", KINDS.values(), ids=str)
def test_every_kind_says_what_it_is_and_is_drawn(kind: ThingKind) -> None:
    assert kind.anchors is not None or kind.points is not None or kind.wholes is not None
    own = kind.anchors is not None or kind.word in ("trace", "polode", "skeleton", "group")
    assert (kind.word in FIGURES) + (kind.word in MARKS) == own
    follows = kind.points is not None and kind.word != "trace"
    about = kind.wholes is not None and kind.word not in MARKS and kind.word not in FIGURES
    assert (kind.word in SYMBOLS) == (follows or (kind.valued > 0 and kind.word != "inset") or about)
    fields = getattr(kind.own, "__slots__", ())
    said = {rule.key for each in KINDS.values() if each.own is kind.own for rule in (*each.options, *each.arguments)}
    assert set(fields) - {"image", "image_size", "radii", "outline", "pieces"} <= said, (
        "what only such kinds have, a definition can say"
    )


def test_what_only_one_kind_has_comes_from_its_options() -> None:
    assert CAPTIONS.keys() <= SYMBOLS.keys()
    spring = kind_of("spring")
    assert spring.made({"coils": 5, "width": 3.0}) == spring.own(coils=5)
    assert kind_of("gear").made({"teeth": 9}) == kind_of("bar").made({}), "nothing without its arguments"


def test_another_process_has_the_same_kinds() -> None:
    assert pickle.loads(pickle.dumps(kind_of("gear"))) is kind_of("gear")


STAR = '''
"""A star about its first anchor."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import AREA, JOINTS, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class Star(Own):
    """``rays``: how many; ``radius`` to their tips, in world pixels."""

    rays: int
    radius: float = 30.0


STAR = ThingKind(
    "star",
    place=19,
    arguments=(OptionRule("rays", OptionForm.WHOLE, "the number of rays", lowest=3, highest=50),),
    options=(*AREA, *JOINTS, OptionRule("radius", OptionForm.POSITIVE, "the radius")),
    own=Star,
    width=1.5,
    inside=True,
    filled=True,
)
'''

DRAWN = """

def _star(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    import math

    own: Any = thing.own
    (x, y), count = points[0], 2 * own.rays
    turns = [2.0 * math.pi * k / count for k in range(count)]
    reach = [own.radius * (1.0 if k % 2 == 0 else 0.4) for k in range(count)]
    corners = tuple((x + r * math.cos(a), y + r * math.sin(a)) for r, a in zip(reach, turns, strict=True))
    return outlined(corners, _edge(thing.look))


FIGURES["star"] = _star
"""

SCRIPT = """.config(4, 100, 100) .background('white');
S : .star(5) C = [50,50] .radius(40) .fill('red');
@0 S.C = [50,50]; S.angle = 90*.t; @1
"""


@pytest.fixture(scope="module")
def with_a_star(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with a new kind of thing: one file more, and two that are changed."""
    home = tmp_path_factory.mktemp("star")
    for folder in ("movimentum", "grammar"):
        shutil.copytree(ROOT / folder, home / folder, ignore=shutil.ignore_patterns("__pycache__", "static"))
    grammar = home / "grammar/movimentum.lark"
    text = grammar.read_text(encoding="utf-8").replace('| DISC "(" sum ")"', '| (DISC | STAR) "(" sum ")"')
    grammar.write_text(text + "\nSTAR: /\\.star(?![A-Za-z0-9_])/\n", encoding="utf-8")
    (home / "movimentum/things/kinds/star.py").write_text(STAR, encoding="utf-8")
    with (home / "movimentum/drawing/figures.py").open("a", encoding="utf-8") as file:
        file.write(DRAWN)
    return home


def with_the_star(home: Path, *words: str, text: str) -> subprocess.CompletedProcess[str]:
    (home / "a.mov").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "movimentum", words[0], "a.mov", *words[1:]]
    environment = {**os.environ, "PYTHONPATH": str(home), "NO_COLOR": "1"}
    return subprocess.run(command, capture_output=True, text=True, cwd=home, env=environment)


@pytest.mark.slow
def test_the_recipe_for_a_kind_of_thing_makes_one(with_a_star: Path) -> None:
    from PIL import Image

    done = with_the_star(with_a_star, "run", "-o", "a.png", "--at", "0", text=SCRIPT)
    assert done.returncode == 0, done.stderr
    image = Image.open(with_a_star / "a.png").convert("RGB")
    assert image.getpixel((50, 50)) == (255, 0, 0)
    assert image.getpixel((75, 50)) == (255, 0, 0), "a ray points to the right"
    assert image.getpixel((50 - 25, 50)) == (255, 255, 255), "and none to the left"
    done = with_the_star(
        with_a_star, "run", "-o", "a.svg", text=SCRIPT.replace(" .background('white')", " .theme('dark')")
    )
    assert done.returncode == 0, done.stderr
    assert "<path" in (with_a_star / "a.svg").read_text(encoding="utf-8")


@broad(
    ("wrong", "told"),
    [
        (("star(5)", "stra(5)"), "did you mean `.star`?"),
        (("star(5)", "star(2)"), "the number of rays must be a whole number from 3 to 50"),
        ((".radius(40)", ".raduis(40)"), "did you mean `.radius`?"),
        ((".radius(40)", ".coils(4)"), "a `.star` takes no `.coils`"),
        (("C = [50,50] .", "."), "a `.star` needs at least 1 anchor"),
    ],
    first=1,
)
def test_messages_know_the_new_kind(with_a_star: Path, wrong: tuple[str, str], told: str) -> None:
    done = with_the_star(with_a_star, "check", text=SCRIPT.replace(*wrong))
    assert done.returncode == 1
    assert told in done.stderr + done.stdout


def test_the_recipe_names_the_files_that_the_example_changes() -> None:
    recipe = (ROOT / "docs/how-to-add.md").read_text(encoding="utf-8").partition("## A kind of thing")[2]
    steps = recipe.partition("`pytest tests/things")[0]
    for file in ("grammar/movimentum.lark", "movimentum/things/kinds/", "movimentum/drawing/figures.py"):
        assert f"`{file}`" in steps
