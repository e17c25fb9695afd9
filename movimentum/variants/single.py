"""Solves variants one by one, each as a script of its own, if they cannot be solved together."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.errors import ScriptError, UsageError
from movimentum.records import dataclass, field, replace
from movimentum.scene.model import Scene
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.syntax.printer import float_text
from movimentum.syntax.tree import ScriptTree
from movimentum.timeline.model import Timeline
from movimentum.variants.lowered import LoweredMeasures, evaluated, lower_measures
from movimentum.variants.measures import MeasureSet
from movimentum.variants.outcomes import VariantOutcome, outcome_of
from movimentum.variants.tracing import settings_of, with_values
from movimentum.workflow.choices import Choices
from movimentum.workflow.frames import PoseChunks
from movimentum.workflow.read import NOT_SENT, ScriptFiles
from movimentum.workflow.stages import arranged, built, moved, parsed

Row = tuple[VariantOutcome, float, FloatArray]
"""The outcome, its time, and (M,) the measures."""


@dataclass(frozen=True, slots=True, eq=False)
class VariantMotion:
    """One variant: its outcome and when it fails (see `outcome_of`), and its ``motion``; None where the script makes no
    sense with its constants, or no step has a solution to begin with.
    """

    outcome: VariantOutcome
    time: float
    motion: PathMotion | None = None


@dataclass(eq=False)
class Variants:
    """The variants of one script: its text, the choices it is read with, the constants ``names`` that vary, and what is
    measured; what is known of its ``files``.
    """

    source: SourceText
    choices: Choices
    names: tuple[str, ...]
    measures: MeasureSet
    files: ScriptFiles = field(default_factory=ScriptFiles)
    tree: ScriptTree = field(init=False)
    lowered: dict[Hashable, LoweredMeasures | None] = field(init=False)

    def __post_init__(self) -> None:
        self.tree = parsed(self.source, self.choices)
        self.lowered = {}

    def scene(self, values: Mapping[str, float]) -> Scene:
        """The scene of one variant; `ScriptError` for values with which the script makes no sense."""
        return built(self.tree, self.source, self.choices_of(values), files=self.files)

    def without_claims(self, values: Mapping[str, float]) -> Timeline:
        """The timeline of one variant, without claims and goals: what moves; `ScriptError` as `scene`."""
        return replace(arranged(self.scene(values), self.choices), claims=(), aims=())

    def timeline(self, choices: Choices) -> Timeline:
        """The script's timeline with these choices, such as `choices_of` and `traced_choices` make."""
        return arranged(built(self.tree, self.source, choices, files=self.files), choices)

    def choices_of(self, values: Mapping[str, float]) -> Choices:
        """The choices that make a variant of the script."""
        others = ((name, text) for name, text in self.choices.settings if name not in values)
        own = ((name, float_text(float(value))) for name, value in values.items())
        return replace(self.choices, settings=(*others, *own))

    def traced_choices(self, values: Mapping[str, float]) -> Choices:
        """The same, in a form that knows what depends on the varied constants."""
        others = ((name, text) for name, text in self.choices.settings if name not in values)
        return replace(self.choices, settings=(*others, *settings_of(tuple(values), tuple(values.values()))))

    def solved(self, values: Mapping[str, float]) -> VariantMotion:
        """One variant, solved by itself; `UsageError` where it needs a file that was not sent here."""
        timeline: Timeline | None = None
        try:
            timeline = self.without_claims(values)
            motion = moved(timeline, resumes=False)
        except ScriptError as error:
            unknown = [item for item in error.diagnostics if item.code == NOT_SENT]
            if unknown:  # nobody knows whether it could be assembled
                raise UsageError(unknown) from error
            start = float("nan") if timeline is None else float(timeline.start)
            return VariantMotion(VariantOutcome.UNASSEMBLED, start)
        return VariantMotion(*outcome_of(motion), motion)

    def row(self, values: Mapping[str, float]) -> Row:
        """One variant's row of the table; `UsageError` as `solved`."""
        found = self.solved(values)
        if found.motion is None or not found.outcome.moves:
            return found.outcome, found.time, np.full(len(self.measures.measures), np.nan)
        return found.outcome, found.time, self._measured(found.motion, values)

    def _measured(self, motion: PathMotion, values: Mapping[str, float]) -> FloatArray:
        if not self.measures.measures:
            return np.zeros(0)
        from movimentum.query import reader

        timeline = motion.timeline
        lowered = self.lowered_for(timeline, values)
        read = reader(timeline.scene, with_values(lowered.read, values))
        frames = PoseChunks(motion, range(timeline.frame_count), skip=False)
        found = evaluated(read, frames)
        times = lowered.measures.times
        at = evaluated(read, (motion.poses_at(times),)) if times else [values_[:, :0] for values_ in found]
        varied = {name: np.array([value]) for name, value in values.items()}
        return lowered.values(found, at, varied, np.array([motion.size]))[:, 0]

    def lowered_for(self, timeline: Timeline, values: Mapping[str, float]) -> LoweredMeasures:
        """What the measures mean for a variant whose timeline is ``timeline``; lowered once for all variants that have
        the same things and steps.
        """
        key = structure_key(timeline)
        found = self.lowered.get(key)
        if found is None:
            choices = self.traced_choices(values)
            traced = self.timeline(choices)
            found = self.lowered[key] = lower_measures(self.measures, self.source, choices, traced, self.files)
        return found


def structure_key(timeline: Timeline) -> Hashable:
    """What the numbers of things and anchors, and the times of frames, depend on."""
    scene = timeline.scene
    things = tuple((thing.name, tuple(anchor.name for anchor in thing.anchors)) for thing in scene.things)
    steps = tuple(segment.start for segment in timeline.segments)
    lives = tuple(sorted(timeline.lifetimes.items()))
    return things, tuple(scene.variables), steps, timeline.end, timeline.fps, timeline.loops, lives
