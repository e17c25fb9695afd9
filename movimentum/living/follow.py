"""Python twin of ``live.js``: follows a slider as the page does, so that its poses can be compared with `solve`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

from movimentum.living.program import LiveStage, Values
from movimentum.tolerances import DISCRIMINANT_ZERO, FRAME_SOLVED, STEP_HAS_BEGUN

HOPS = 8
"""Settings between the constants' own values and others, by which a start goes from the one to the others."""
MOST_SIGNS = 6
"""Of a step, branches that inequalities may choose."""


class Follower:
    """A motion with any constants, at times that ascend. ``size``: of the scene, in pixels."""

    def __init__(
        self, stages: Sequence[LiveStage], functions: Sequence[Values], defaults: Mapping[str, float], size: float
    ) -> None:
        self.stages, self.functions, self.defaults, self.size = stages, functions, defaults, size

    def film(self, constants: Mapping[str, float], times: Sequence[float]) -> list[list[float] | None]:
        """The outputs at each time; None where it cannot be assembled."""
        found: list[list[float] | None] = []
        now, memory = -1, dict[str, float]()
        for time in times:
            stage = max(
                (k for k, each in enumerate(self.stages) if each.program.start <= time + STEP_HAS_BEGUN), default=0
            )
            if stage != now:
                now, memory = stage, self.begun(stage, constants)
            kept = dict(memory)
            values = self._values(stage, time, constants, memory)
            if not self._good(stage, values):
                memory, values = kept, None
            found.append(values)
        return found

    def begun(self, stage: int, constants: Mapping[str, float]) -> dict[str, float]:
        """What is remembered at the beginning of a step: the solution with the constants' own values, followed to
        these, and the branches that its inequalities choose there.
        """
        start, memory = self.stages[stage].program.start, dict[str, float]()
        if self.stages[stage].follows:
            for hop in range(HOPS):
                way = {name: old + (constants[name] - old) * hop / HOPS for name, old in self.defaults.items()}
                kept = dict(memory)
                if not self._good(stage, self._values(stage, start, way, memory)):
                    memory = kept
        signs = self.stages[stage].signs[:MOST_SIGNS]
        if not self.stages[stage].choices:
            return memory
        for flips in sorted(itertools.product((1.0, -1.0), repeat=len(signs)), key=lambda some: some.count(-1.0)):
            tried = memory | dict(zip(signs, flips, strict=True))
            if self._good(stage, self._values(stage, start, constants, dict(tried))):
                return tried
        return memory

    def _values(self, stage: int, time: float, constants: Mapping[str, float], memory: dict[str, float]) -> list[float]:
        try:
            return [float(value) for value in self.functions[stage](time, constants, memory)]
        except (ArithmeticError, ValueError, OverflowError):
            return [math.nan]

    def _good(self, stage: int, values: Sequence[float]) -> bool:
        one = self.stages[stage]
        if not all(map(math.isfinite, values)):
            return False
        checks = len(values) - one.checks
        choices = checks - one.choices
        return (
            all(value >= -DISCRIMINANT_ZERO for value in values[choices - one.margins : choices])
            and all(value >= -FRAME_SOLVED * self.size for value in values[choices:checks])
            and all(abs(value) <= FRAME_SOLVED * self.size for value in values[checks:])
        )
