"""What a motion knows of the script that it is of."""

from __future__ import annotations

from typing import Any, Protocol

from movimentum.api.names import Names
from movimentum.api.options import Limits, Number
from movimentum.scene.model import Scene
from movimentum.settings import Accuracy, AccuracyWord, FailurePolicy, FailureWord
from movimentum.source import SourceText


class Origin(Protocol):
    """The script that a motion is of; see `movimentum.Script`."""

    @property
    def source(self) -> SourceText:
        """Its text."""
        ...

    @property
    def scene(self) -> Scene:
        """What it says."""
        ...

    @property
    def limits(self) -> Limits:
        """What it may cost."""
        ...

    @property
    def name(self) -> str:
        """What it is called in short."""
        ...

    @property
    def names(self) -> Names:
        """What can be asked of its motions."""
        ...

    @property
    def things(self) -> tuple[str, ...]:
        """The names of its things."""
        ...

    @property
    def constants(self) -> dict[str, float | tuple[float, float]]:
        """Its constants, by name."""
        ...

    def solve(
        self,
        accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
        *,
        digits: int | None = None,
        fps: Number | None = None,
        on_failure: FailurePolicy | FailureWord = FailurePolicy.STOP,
        strict: bool = False,
    ) -> Any:
        """Its `Motion`, with other choices."""
        ...
