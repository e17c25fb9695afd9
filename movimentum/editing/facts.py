"""Facts about the names of a solved script: their values at the film's beginning, and the statements that determine
them.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from movimentum.editing.about import NO_FACTS, Facts
from movimentum.errors import MovimentumError
from movimentum.expressions import Expr, symbol
from movimentum.scene.model import AnchorCoordinate, ThingAngle, VariableComponent

if TYPE_CHECKING:
    from movimentum.solver.poses import Poses
    from movimentum.workflow.engine import Revision

MOST_CAUSES = 8
"""So many statements are shown that determine something."""


class KnownFacts:
    """The facts of one text; each when it is first asked for."""

    def __init__(self, revision: Revision) -> None:
        self.revision = revision
        self._found: dict[str, Facts] = {}

    def __call__(self, name: str) -> Facts:
        """The facts about ``name``, such as ``Rod``, ``Rod.A``, ``S[2].A.P`` or ``x``."""
        if name not in self._found:
            try:
                self._found[name] = self._facts(name)
            except (MovimentumError, ArithmeticError, ValueError):
                return NO_FACTS
        return self._found[name]

    def prepare(self) -> None:
        """Find what takes time before somebody asks."""
        if self.revision.moves:
            _ = self.poses, self._numbers

    @cached_property
    def poses(self) -> Poses:
        """The poses at the beginning (F = 1)."""
        return self.revision.motion.poses_at([self.revision.timeline.start])

    @cached_property
    def _numbers(self) -> dict[str, tuple[int, int | None]]:
        """(number of the thing, of the anchor) by name."""
        found: dict[str, tuple[int, int | None]] = {}
        for thing in self.revision.scene.things:
            found[thing.name] = found[f"{thing.name}.angle"] = found[f"{thing.name}.a"] = thing.number, None
            for number, anchor in enumerate(thing.anchors):
                found[f"{thing.name}.{anchor.name}"] = thing.number, number
        return found

    def constant(self, name: str) -> str:
        """The value of a constant of the script; empty if it has none."""
        if not self.revision.moves:
            return ""
        for each in self.revision.scene.constants:
            if each.name == name:
                values = [_number(float(part.value)) for part in each.value]
                return values[0] if len(values) == 1 else f"[{', '.join(values)}]"
        return ""

    def _facts(self, name: str) -> Facts:
        if not self.revision.moves:
            return NO_FACTS
        if value := self.constant(name):
            return Facts(value)
        scene, poses = self.revision.scene, self.poses
        if name in self._numbers:
            thing, anchor = self._numbers[name]
            if not scene.things[thing].is_body:
                return NO_FACTS
            if anchor is None:
                value = f"{_number(float(poses.angle[thing][0]))}°" + (" (its angle)" if "." not in name else "")
                return Facts(value, self._causes([symbol(ThingAngle(thing))]))
            place = poses.world(thing, scene.things[thing].anchors[anchor].local)[0]
            parts = [symbol(AnchorCoordinate(thing, anchor, axis)) for axis in (0, 1)]
            return Facts(f"[{', '.join(_number(float(part)) for part in place)}]", self._causes(parts))
        if name in poses.variables:
            values = poses.variables[name][0]
            if values.ndim == 0:
                return Facts(_number(float(values)), self._causes([symbol(VariableComponent(name, None))]))
            parts = [symbol(VariableComponent(name, axis)) for axis in (0, 1)]
            return Facts(f"[{', '.join(_number(float(part)) for part in values)}]", self._causes(parts))
        return NO_FACTS

    def _causes(self, expressions: list[Expr]) -> tuple[str, ...]:
        """The statements that determine something, in the order in which the solver uses them, each with its line."""
        from movimentum.analysis.interactive.determination import determination

        scene = self.revision.scene
        plan = self.revision.motion.segments[0].plan
        numbers = {item.number: item for item in scene.constraints()}
        found: list[str] = []
        for reason in determination(plan, expressions).reasons:
            if reason.constraint is not None:
                span = numbers[reason.constraint].span
                found.append(f"{scene.source.position(span.start).line}: {scene.source.statement(span)}")
        more = len(found) - MOST_CAUSES
        return (*found[:MOST_CAUSES], *([f"and {more} more"] if more > 0 else []))


def _number(value: float) -> str:
    return f"{round(value, 4) + 0.0:g}" if abs(value) < 1e6 else f"{value:.6g}"
