"""Chains of triangular formulas: evaluated, imported as a script, and exported again, they say the same."""

from __future__ import annotations

import random

import numpy as np
import pytest

from movimentum.errors import ScriptError
from movimentum.interop.formula_script import formula_script
from movimentum.interop.formulas import Formulas, evaluate, formulas_text, read_formulas
from movimentum.interop.triangles import triangles_of
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read
from movimentum.workflow.stages import arranged, examined, moved, understand
from tests.command import ROOT
from tests.families.triangle_chains import Chain, Complexes, chain


def formulas_of(made: Chain, seed: int) -> Formulas:
    return read_formulas(SourceText("chain.pyslvs", made.text(random.Random(seed))))


def places_of(motion: PathMotion) -> dict[str, list[Complexes]]:
    """Where every anchor is in all frames, by its name: points are anchors that are called after them."""
    poses = motion.poses(0, motion.timeline.frame_count)
    found: dict[str, list[Complexes]] = {}
    for thing in motion.timeline.scene.things:
        for anchor in thing.anchors:
            found.setdefault(anchor.name, []).append(poses.world(thing.number, anchor.local) @ [1, 1j])
    return found


def imported(formulas: Formulas) -> PathMotion:
    """The motion of the script that formulas become, which has no fault but that listed inputs may pass a reach between
    two frames.
    """
    script, found = formula_script(formulas, "chain")
    assert found == ()
    timeline = arranged(understand(SourceText("chain.mov", script)), Choices())
    solution = examined(timeline, Choices())
    assert isinstance(solution.motion, PathMotion)
    assert solution.fault == 0 or solution.motion.poses(0, timeline.frame_count).solved.all()
    return solution.motion


def how_far(made: Chain, seed: int) -> tuple[float, float]:
    """How far the evaluated points are from the truth, and how far those of the imported script."""
    formulas = formulas_of(made, seed)
    points = evaluate(formulas)
    drawn = places_of(imported(formulas))
    assert drawn.keys() >= made.points.keys()
    off = max(float(np.abs(place - made.points[name]).max()) for name in drawn for place in drawn[name])
    return max(float(np.abs(points[name] @ [1, 1j] - made.points[name]).max()) for name in points), off


@pytest.mark.parametrize("seed", range(20))
def test_a_chain_is_where_its_meaning_puts_it(seed: int) -> None:
    evaluated, solved = how_far(chain(seed), seed)
    assert evaluated < 1e-10
    assert solved < 1e-9


@pytest.mark.slow
def test_many_chains_are_where_their_meaning_puts_them() -> None:
    wrong = [seed for seed in range(1000, 1300) if max(how_far(chain(seed), seed)) > 1e-9]
    assert wrong == []


def off_after_a_round_trip(motion: PathMotion) -> float | None:
    """How far a motion's joints are off when it is exported and imported again; None where it cannot be exported."""
    try:
        triangles = triangles_of(motion)
    except ScriptError as error:
        if error.diagnostics[-1].code not in ("export/not-triangular", "export/turns-over"):
            raise
        return None
    again = imported(read_formulas(SourceText("again.pyslvs", formulas_text(triangles.formulas, ["a comment"]))))
    assert (again.timeline.frame_count, again.timeline.fps) == (motion.timeline.frame_count, motion.timeline.fps)
    poses, drawn = motion.poses(0, motion.timeline.frame_count), places_of(again)
    things = {thing.name: thing for thing in motion.timeline.scene.things}
    worst = 0.0
    for name, told in triangles.names:
        thing, anchor = told.split(" = ")[0].split(".")
        local = next(item.local for item in things[thing].anchors if item.name == anchor)
        truth = poses.world(things[thing].number, local) @ [1, 1j]
        worst = max(worst, *(float(np.abs(place - truth).max()) for place in drawn[name]))
    return worst


@pytest.mark.slow
def test_chains_that_were_exported_give_the_same_poses_when_they_are_imported() -> None:
    found = [off_after_a_round_trip(imported(formulas_of(chain(seed), seed))) for seed in range(10)]
    assert max(off for off in found if off is not None) < 1e-9


@pytest.mark.slow
def test_many_chains_that_were_exported() -> None:
    found = [off_after_a_round_trip(imported(formulas_of(chain(seed), seed))) for seed in range(2000, 2150)]
    exported = [off for off in found if off is not None]
    assert len(exported) >= 75
    assert max(exported) < 1e-8


@pytest.mark.parametrize("script", ["four-bar", "slider-crank", "jansen", "coupling-rods", "scotch-yoke", "pantograph"])
def test_what_was_exported_gives_the_same_poses_when_it_is_imported(script: str) -> None:
    source = read(str(ROOT / "scripts" / f"{script}.mov"))
    off = off_after_a_round_trip(moved(arranged(understand(source), Choices())))
    assert off is not None
    assert off < 1e-9
