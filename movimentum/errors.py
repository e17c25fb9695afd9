"""The exceptions, each carrying `Diagnostic`s and the exit code that the command line gives it.

::

    MovimentumError
    ├── ScriptError        1   the script is at fault (syntax, names, kinds, files, conflicts)
    ├── UsageError         2   wrong options, unwritable output
    └── NoSolutionError    3   the scene has no solution at some time
"""

from __future__ import annotations

from collections.abc import Iterable

from movimentum.diagnostics import Diagnostic, Severity


class MovimentumError(Exception):
    """Base of all errors that a user can cause; ``diagnostics`` says everything."""

    exit_code = 1

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("; ".join(item.message for item in self.diagnostics))


class ScriptError(MovimentumError):
    """The script is at fault."""


class UsageError(MovimentumError):
    """The command is at fault: options that do not fit together, a file that cannot be written."""

    exit_code = 2


class NoSolutionError(MovimentumError):
    """The scene has no solution at some time."""

    exit_code = 3


def usage_error(code: str, message: str, *helps: str) -> UsageError:
    """A `UsageError` with one diagnostic, which is not about a place in a script."""
    return UsageError([Diagnostic(code, Severity.ERROR, message, helps=helps)])


def script_error(code: str, message: str, *helps: str) -> ScriptError:
    """A `ScriptError` with one diagnostic, which is not about a place in the script."""
    return ScriptError([Diagnostic(code, Severity.ERROR, message, helps=helps)])
