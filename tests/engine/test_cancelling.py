"""Work that nobody waits for ends soon in every stage, and leaves nothing wrong behind."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from movimentum.cancellation import Cancelled, cancellable
from movimentum.source import SourceText
from movimentum.studio.descriptions import whole_film
from movimentum.workflow.engine import Engine, Revision
from tests.engine.edits import edited
from tests.engine.families import dyads
from tests.engine.test_engine import FREE, STEPS, answer

COUNT = 12


STAGES: dict[str, Callable[[Revision], Any]] = {
    "reading": lambda revision: revision._tree,  # pyright: ignore[reportPrivateUsage]
    "scene": lambda revision: revision.timeline,
    "solving": lambda revision: revision.motion,
    "film": lambda revision: whole_film(revision.motion),
    "examining": lambda revision: revision.examination,
}


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_looks_for_each_thing_whether_anybody_still_waits(stage: str) -> None:
    looks = 0

    def unwanted() -> bool:
        nonlocal looks
        looks += 1
        return False

    revision = Engine().revise(SourceText("x.mov", dyads(COUNT)))
    with np.errstate(all="ignore"):
        for name, work in STAGES.items():
            if name == stage:
                with cancellable(unwanted):
                    work(revision)
                break
            work(revision)
    assert looks >= 2 * COUNT  # as many as there are things


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(STEPS, id="steps"),
        pytest.param(FREE, id="free", marks=pytest.mark.slow),
        pytest.param(dyads(2), id="dyads"),
    ],
)
def test_what_was_given_up_anywhere_does_not_change_the_next_answer(text: str) -> None:
    chance = random.Random(5)
    engine = Engine()
    given_up = 0
    with np.errstate(all="ignore"):
        for after in edited(chance, text, 4):
            source = SourceText("x.mov", after)
            left = chance.randrange(1, 300)

            def unwanted() -> bool:
                nonlocal left
                left -= 1
                return left < 0

            try:
                with cancellable(unwanted):
                    answer(engine.revise(source))
            except Cancelled:
                given_up += 1
            assert answer(engine.revise(source)) == answer(Engine().revise(source)), after
    assert given_up
