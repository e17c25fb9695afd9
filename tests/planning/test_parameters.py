"""Numbers and places are parameters of compiled code: what is of one structure is compiled once."""

import random
import re
from collections import Counter
from pathlib import Path

import pytest

from movimentum.memo import Memo
from movimentum.planning.blocks.block_cache import BlockCache
from movimentum.planning.codegen.writing import structures_compiled
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.rendering.images import image_size
from movimentum.scene.build import build
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.timeline.arrange import arrange
from tests.broad import broad

SCRIPTS = Path(__file__).parents[2] / "scripts"
EDITS = 6
RELATED = {"cam-follower", "clockwork", "geneva-slots", "jansen-walker", "planetary", "tracer", "whitworth"}
"""Scripts in which one number makes others equal: a third or a whole turn, teeth, places that others are computed from,
the distance of two axles, two arms of a pantograph."""
LITERAL = re.compile(r"(?<![\w.@#])(?<!e-)\d+(?:\.\d+)?(?![\w.])")


def compiled_for(text, path=SCRIPTS / "x.mov"):
    """How many structures are compiled for a script's plans."""
    source = SourceText(str(path), text)
    timeline = arrange(build(parse(source), source, image_size))
    before = structures_compiled()
    for segment in timeline.segments:
        _ = compile_structure(structure_of(timeline.scene, segment, {}), 100.0, BlockCache(Memo(1))).schedule
    return structures_compiled() - before


def edits(text, count, seed):
    """Scripts with one number changed a little; of the numbers that stand nowhere else, as equal ones make a
    structure (a rhombus is no quadrangle).
    """
    bare = re.sub(r"//.*", lambda comment: " " * len(comment[0]), text)
    numbers = [m for m in LITERAL.finditer(bare) if m.start() > bare.index(";") and float(m[0]) > 3.0]
    once = Counter(float(m[0]) for m in numbers)
    chosen = [m for m in numbers if once[float(m[0])] == 1]
    for m in random.Random(seed).sample(chosen, min(count, len(chosen))):
        yield text[: m.start()] + repr(float(m[0]) * 1.0007) + text[m.end() :]


@broad("count", [1, pytest.param(EDITS, marks=pytest.mark.slow)], first=3)
@broad("path", sorted(SCRIPTS.glob("*.mov")), every=6, ids=lambda path: path.stem)
def test_another_number_compiles_nothing(path, count):
    text = path.read_text(encoding="utf-8")
    compiled_for(text, path)
    assert compiled_for(text, path) == 0
    for edited in edits(text, 0 if path.stem in RELATED else count, 1):
        assert edited != text
        assert compiled_for(edited, path) == 0


BARS = """.config(10);
Arm : .bar A = [0,0] B = [57,0];  Fore : .bar A = [0,0] B = [43,0];
@0 Arm.A = [0,0]; Fore.A = Arm.B; {}
@1"""


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Fore.B ~ [61,32];", "Fore.B ~ [17,-71];"),
        ("Fore.B ~ [61,32] .speed(8);", "Fore.B ~ [61,32] .speed(9);"),
        ("Fore.B = [61,32];", "Fore.B = [44,-29];"),
        ("Arm.angle = 30 + 7*.t; Fore.angle = 20;", "Arm.angle = -11 + 5*.t; Fore.angle = 62;"),
        ("Arm.angle = 30; Fore.B.x = 77 - 5*.t;", "Arm.angle = 21; Fore.B.x = 71 - 3*.t;"),
        ("Arm.angle = c; c = 30*.t + 7; Fore.angle = 9;", "Arm.angle = c; c = 31*.t + 8; Fore.angle = 9;"),
    ],
)
def test_another_target_or_constant_compiles_nothing(one, other):
    compiled_for(BARS.format(one))
    assert compiled_for(BARS.format(other)) == 0


def test_later_steps_of_one_structure_compile_nothing():
    step = "@{} Arm.angle = {} + {}*.t;\n"
    text = BARS.format("Arm.angle = 5; Fore.angle = 21;").removesuffix("@1")
    compiled_for(text + step.format(1, 17, 4) + "@2")
    assert compiled_for(text + "".join(step.format(k, 10 + k, 3 + k) for k in range(1, 8)) + "@9") == 0


def test_equal_loops_compile_once():
    """Each loop of a chain of four-bars hangs from the one before it."""

    def chain(count):
        things, stated = "", "G.O = [0,0]; G.angle = 30*.t + 40;"
        for k in range(count):
            before = "G.P" if k == 0 else f"R{k - 1}.B"
            things += f"C{k} : .bar A = [0,0] B = [83,{k + 4}]; R{k} : .bar O = [0,0] B = [0,{57 + k}];\n"
            stated += f"C{k}.A = {before}; R{k}.O = [{91 * (k + 1)},{k}]; C{k}.B = R{k}.B;\n"
        return f".config(10);\nG : .bar O = [0,0] P = [31,0];\n{things}@0 {stated}@1"

    few = chain(3)
    compiled_for(few)
    extra = compiled_for(chain(9))
    assert extra <= 4  # the fused run is longer, and its parts are not
    assert compiled_for(chain(9).replace("83,", "84,")) == 0
