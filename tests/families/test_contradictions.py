"""What contradicts is named: the smallest set, with the wrong number in it, by how much, and soon.

The truth is known by construction (see `tests.families.contradictions`); that a set is the smallest is judged by SciPy,
from residuals that share no code with the package.
"""

import random
import re
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from movimentum.analysis.examine import examine
from movimentum.diagnostics import Severity
from movimentum.solver.start import contradictions
from movimentum.solver.start.contradictions import find_contradiction
from tests.broad import broad
from tests.families.contradictions import Scene, broken_scene
from tests.solver.scenes import motion_of

SCRIPTS = Path(__file__).parents[2] / "scripts"


def told(text, motion=None):
    """(first error or None, source, exit code, CPU seconds) of a script's text; of its motion, if that is known."""
    begin = time.process_time()
    motion = motion or motion_of(text)
    examination = examine(motion)
    errors = [d for d in examination.diagnostics if d.severity is Severity.ERROR]
    source = motion.timeline.scene.source
    return (errors[0] if errors else None), source, examination.fault, time.process_time() - begin


def plain(text):
    return " ".join(text.split()).rstrip("; ")


def labels(diagnostic, source):
    """Text of each place -> what is said about it."""
    places = [(diagnostic.span, diagnostic.label), *((label.span, label.message) for label in diagnostic.labels)]
    return {plain(source.slice(span)): message for span, message in places if span is not None}


def can_be_met(scene: Scene, chosen: list[int]) -> bool:
    """Whether a pose meets the statements ``chosen``, by SciPy: from the true pose, then from poses about it."""
    pose = scene.flat()
    generator = np.random.default_rng(1)
    bodies = sorted({int(n) for i in chosen for n in re.findall(r"B(\d+)\b", scene.statements[i].text)})
    columns = [3 * body + part for body in bodies for part in range(3)]

    def off(z):
        there = pose.copy()
        there[columns] = z
        return scene.residuals(there, chosen)

    for spread in (0.0, 0.05, 0.3, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0):
        start = pose + spread * generator.normal(size=len(pose)) * np.tile([30.0, 30.0, 50.0], len(scene.bodies))
        size = np.tile([100.0, 100.0, 57.0], len(bodies))
        found = least_squares(off, start[columns], x_scale=size, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=300)
        if np.max(np.abs(found.fun), initial=0.0) < 1e-7:
            return True
    return False


def verdict(scene: Scene) -> tuple[str, float]:
    error, source, fault, seconds = told(scene.script())
    if error is None:
        return "nothing told", seconds
    if error.code != "constraint/conflict" or fault != 1:
        return error.code, seconds
    texts = [plain(s.script(scene.amount if i == scene.wrong else 0.0)) for i, s in enumerate(scene.statements)]
    said = labels(error, source)
    named = [i for i, text in enumerate(texts) if text in said]
    if scene.wrong not in named:
        return "without the wrong one", seconds
    amount = re.search(r"off by ([\d.e+-]+)", said[texts[scene.wrong]])
    if amount is None or not 0.0 < float(amount[1]) <= 1.001 * abs(scene.amount):
        return "amount", seconds
    if len(named) <= 10 and not all(can_be_met(scene, [n for n in named if n != i]) for i in named):
        return "not the smallest", seconds
    return "right", seconds


def judged(seeds, sizes):
    size = {seed: sizes[seed % len(sizes)] for seed in seeds}
    results = {(seed, size[seed]): verdict(broken_scene(seed, size[seed])) for seed in seeds}
    counts = Counter(word for word, _ in results.values())
    seconds = sorted(s for _, s in results.values())
    print(dict(counts), f"median {seconds[len(seconds) // 2]:.2f} s, longest {seconds[-1]:.2f} s")
    print({key: value for key, value in results.items() if value[0] != "right" or value[1] > 2.0})
    return counts


@pytest.mark.slow
def test_one_wrong_number_is_named():
    counts = judged(range(10), (5, 8, 12))
    assert counts["right"] == 10


@pytest.mark.slow
@pytest.mark.long
def test_one_wrong_number_is_named_in_many_scenes():
    counts = judged(range(100, 164), (5, 8, 12, 16, 20, 30, 40, 60))
    assert counts["without the wrong one"] == 0
    assert counts["right"] + counts["amount"] >= 0.98 * 64
    assert counts["right"] >= 0.93 * 64


def too_many(name: str, seed: int) -> tuple[str, str]:
    """A script's first step with a true distance between two anchors at its beginning, 5 to 20 longer; and that."""
    text = re.sub(r"//.*", "", (SCRIPTS / f"{name}.mov").read_text()).split("@1")[0]
    r = random.Random(seed)
    motion = motion_of(text + "@1\n")
    poses = motion.poses(0, 1)
    scene = motion.timeline.scene
    held = {thing for thing, first in scene.mentioned.items() if first == 0}
    bodies = [t for t in scene.things if t.number in held and t.kind.word != "label" and t.anchors]
    while True:
        one, other = r.sample(bodies, 2)
        a, b = r.choice(one.anchors), r.choice(other.anchors)
        far = np.hypot(*(poses.world(one.number, a.local)[0] - poses.world(other.number, b.local)[0]))
        if far > 20.0:
            break
    added = f"({one.name}.{a.name} - {other.name}.{b.name}).l = {far + r.uniform(5.0, 20.0):.9f}"
    return f"{text}\n{added};\n@1\n", added


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("walschaerts", marks=pytest.mark.slow), "stephenson"])
def test_one_distance_too_many_in_a_valve_gear(name):
    for seed in range(1):
        text, added = too_many(name, seed)
        error, source, fault, seconds = told(text)
        print(name, added, error and (error.code, error.message), fault, f"{seconds:.2f} s")
        assert error is not None
        assert error.code in ("constraint/conflict", "solve/unreachable")
        assert added in labels(error, source)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", ["walschaerts", "stephenson"])
def test_any_distance_too_many_in_a_valve_gear(name):
    right, times = 0, []
    for seed in range(100, 120):
        text, added = too_many(name, seed)
        error, source, _, seconds = told(text)
        times.append(seconds)
        good = error is not None and added in labels(error, source)
        right += good
        if not good or seconds > 2.0:
            print(added, error and (error.code, error.message), f"{seconds:.2f} s")
    print(f"{right} of 20, median {sorted(times)[10]:.2f} s, longest {max(times):.2f} s")
    assert right >= 17  # the others are told as inequalities that leave nothing, which is as true


@pytest.mark.parametrize(
    ("statements", "named"),
    [
        ("x = 5; y = 3; x = 6;", {"x = 5", "x = 6"}),
        ("x + y = 3; x - y = 1; z = 2*x; y = 5; z = 4;", {"x + y = 3", "x - y = 1", "y = 5"}),
        ("A.a = [0,0]; A.b = [60,0];", {"A.a = [0,0]", "A.b = [60,0]"}),
        ("A.a = [0,0]; B.a = A.b; B.b = [120,0]; A.angle = 10;", {"A.a = [0,0]", "B.a = A.b", "B.b = [120,0]"}),
        ("A.angle = 20; B.angle - A.angle = 30; B.angle = 60;", {"A.angle = 20", "B.angle - A.angle = 30", "B.angle = 60"}),  # noqa: E501
    ],
)  # fmt: skip
def test_few_statements_that_disagree(statements, named):
    things = "A : .bar a=[0,0] b=[50,0]; B : .bar a=[0,0] b=[50,0];"
    error, source, fault, _ = told(f".config(10,200,200);\n{things}\n@0 {statements}\n@1\n")
    assert error is not None
    assert (error.code, fault) == ("constraint/conflict", 1)
    assert {text for text in labels(error, source) if ".bar" not in text} == named


def test_angles_agree_modulo_a_turn():
    # 30 + 340 is 10 and a turn: whatever else may be said of it, this is no contradiction
    things = " ".join(f"{n} : .bar a=[0,0] b=[50,0];" for n in "ABC")
    for more in ("A.a=[0,0]; B.a=A.b; C.a=B.b;", "A.a=[0,0]; A.angle=20; B.a=A.b; C.a=B.b;"):
        loop = "A.angle - B.angle = 30; B.angle - C.angle = 340; A.angle - C.angle = 10;"
        error, _, _, _ = told(f".config(10,200,200);\n{things}\n@0 {more} {loop}\n@1\n")
        assert error is None or error.code != "constraint/conflict"


@broad("count", [3, 10, 25], first=2)
@broad("scale", [0.02, 1.0, 30.0], every=2)
def test_products_of_variables_are_solved_whatever_their_size(count, scale):
    # linear in the logarithms: the one solution with positive numbers is known
    right = scale**3 * (np.arange(count) + 2.0)
    matrix = 2.0 * np.eye(count) + np.roll(np.eye(count), 1, axis=1)
    truth = np.exp(np.linalg.solve(matrix, np.log(right)))
    equations = " ".join(f"x{i}^2*x{(i + 1) % count} = {float(right[i])!r};" for i in range(count))
    text = f".config(10,200,200);\nA : .bar a=[0,0] b=[50,0];\n@0 A.a=[0,0]; {equations}\n@1\n"
    motion = motion_of(text)
    error, _, _, _ = told(text, motion)
    assert error is None
    poses = motion.poses(0, 1)
    found = np.array([poses.variables[f"x{i}"][0] for i in range(count)])
    assert np.max(np.abs(found**2 * np.roll(found, -1) / right - 1.0)) < 1e-9
    if count % 2 == 0:  # else a sign could not be told either
        assert np.max(np.abs(np.abs(found) / truth - 1.0)) < 1e-9


def test_a_search_without_a_find_does_not_say_that_there_is_none():
    # more equations with the same factors, of which the last has no solution: nobody can tell from a search
    equations = " ".join(f"x{i}^2*x{(i + 1) % 9} + .sin(40*x{(i + 4) % 9}) = {i + 2} + .t;" for i in range(9))
    error, _, fault, _ = told(f".config(10,200,200);\nA : .bar a=[0,0] b=[50,0];\n@0 A.a=[0,0]; {equations}\n@1\n")
    assert error is None or (error.code, fault) == ("solve/not-converged", 3)


def test_what_contradicts_in_every_step_is_looked_for_once(monkeypatch):
    """A contradiction that a step begins with is known from the step before, if all that takes part is still stated."""
    monkeypatch.chdir(SCRIPTS)
    text = (SCRIPTS / "walschaerts.mov").read_text(encoding="utf-8")
    first = text.index("\n@1")
    looked: list[int] = []

    def counted(*arguments, **more):
        looked.append(1)
        return find_contradiction(*arguments, **more)

    monkeypatch.setattr(contradictions, "find_contradiction", counted)
    motion = motion_of(f"{text[:first]} Rod.angle = 12;{text[first:]}")
    assert len(looked) == 1
    found = [segment_motion.failures[0].selection.contradiction for segment_motion in motion.segments]
    assert all(each is not None and each.members == found[0].members for each in found)
