"""Living figures from Python: what `Script.live` gives."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.api.arguments import called
from movimentum.diagnostics import Diagnostics, Severity, told_html
from movimentum.records import dataclass

if TYPE_CHECKING:
    from movimentum.living.page import Figure
    from movimentum.source import SourceText


@dataclass(frozen=True, eq=False, repr=False)
class LivingFigure:
    """A figure whose constants are sliders and whose drive is a handle. It shows itself at the end of a cell, and needs
    neither Python nor a network then. ``diagnostics``: everything that is to be said of it.
    """

    name: str
    source: SourceText
    figure: Figure
    diagnostics: Diagnostics

    @property
    def constants(self) -> dict[str, tuple[float, float]]:
        """The constants that have a slider, each with the least and the most that it may be."""
        return {slider.name: (slider.least, slider.most) for slider in self.figure.sliders}

    @called
    def save(self, path: str | os.PathLike[str], /) -> Path:
        """Write one page of HTML, which needs nothing else; `UsageError` where it cannot be written."""
        from movimentum.workflow.living import written_page

        return written_page(self.figure, Path(path), self.source)

    def _repr_html_(self) -> str:
        from movimentum.notebook.player import figure_html

        worse = [item for item in self.diagnostics if item.severity is not Severity.NOTE]
        return figure_html(self.figure) + told_html(worse, self.source)

    def __repr__(self) -> str:
        return f"LivingFigure({self.name}: {', '.join(self.constants)})"
