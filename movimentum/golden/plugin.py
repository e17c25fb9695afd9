"""The pytest plugin: with ``--movimentum-golden``, every script that has golden frames is a test.

Without the option it does nothing and costs nothing: its imports happen when there is a test to run.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from movimentum.golden.check import GoldenResult


class Differs(Exception):
    """A script no longer agrees with its recording."""

    def __init__(self, outcome: GoldenResult) -> None:
        self.outcome = outcome
        super().__init__(outcome.diagnostics[0].message)


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options."""
    group = parser.getgroup("movimentum")
    group.addoption(
        "--movimentum-golden", action="store_true", help="test every .mov script that has golden frames beside it"
    )
    group.addoption(
        "--movimentum-golden-dir", metavar="DIR", help="where the golden frames are, if not beside the scripts"
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> GoldenFile | None:
    """A script with golden frames."""
    if file_path.suffix != ".mov" or not parent.config.getoption("--movimentum-golden"):
        return None
    from movimentum.golden.record import golden_of

    folder = parent.config.getoption("--movimentum-golden-dir")
    if not golden_of(file_path, Path(folder) if folder else None).exists:
        return None
    return GoldenFile.from_parent(parent, path=file_path)


class GoldenFile(pytest.File):
    """One script."""

    def collect(self) -> Iterator[pytest.Item]:
        """Its one test."""
        yield GoldenItem.from_parent(self, name="golden")


class GoldenItem(pytest.Item):
    """Compares a script with its golden frames."""

    def runtest(self) -> None:
        """See the class."""
        from movimentum.golden.check import check
        from movimentum.golden.page import write_report
        from movimentum.golden.record import golden_of

        folder = self.config.getoption("--movimentum-golden-dir")
        outcome = check(golden_of(self.path, Path(folder) if folder else None))
        if not outcome.good:
            write_report(outcome)
            raise Differs(outcome)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The report of `movimentum golden check`."""
        from movimentum.diagnostics import render_text
        from movimentum.errors import MovimentumError
        from movimentum.golden.page import report_folder
        from movimentum.workflow.read import read

        error = excinfo.value
        if isinstance(error, Differs):
            text = render_text(error.outcome.diagnostics, read(str(self.path)))
            return f"{text}see {report_folder(error.outcome) / 'index.html'}"
        if isinstance(error, MovimentumError):
            return render_text(error.diagnostics, read(str(self.path)))
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Its place in a report."""
        return self.path, None, f"golden: {self.path.name}"
