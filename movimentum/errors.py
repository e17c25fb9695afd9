"""The exceptions, each carrying `Diagnostic`s and the exit code that the command line gives it.

::

    MovimentumError
    ├── ScriptError        1   the script is at fault (syntax, names, kinds, files, conflicts)
    │   └── UnknownNameError   a motion has nothing of this name; a KeyError too
    ├── UsageError         2   wrong options, unwritable output
    └── NoSolutionError    3   the scene has no solution at some time
"""

from __future__ import annotations

from collections.abc import Generator, Iterable
from contextlib import contextmanager

from movimentum.diagnostics import Diagnostic, Severity, render_text
from movimentum.source import SourceText, Span


class MovimentumError(Exception):
    """Base of all errors that a user can cause; ``diagnostics`` explains it, with places in the text ``source``.

    Printed, it looks as in a terminal: codes, places, lines with carets, helps.

    >>> import movimentum as mv
    >>> try:
    ...     mv.loads("@0 x = ;")
    ... except mv.MovimentumError as error:
    ...     print(error.diagnostics[0].code, error.exit_code)
    syntax/unexpected 1
    """

    exit_code = 1

    def __init__(self, diagnostics: Iterable[Diagnostic], source: SourceText | None = None) -> None:
        self.diagnostics = tuple(diagnostics)
        self.source = source
        super().__init__("; ".join(item.message for item in self.diagnostics))

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.diagnostics, self.source)

    def __str__(self) -> str:
        shown = [item for item in self.diagnostics if item.severity is not Severity.NOTE] or self.diagnostics
        return self._rendered(shown)

    def _rendered(self, some: Iterable[Diagnostic], *, color: bool = False) -> str:
        return render_text(some, self.source or SourceText("movimentum", ""), color=color).rstrip("\n")

    def _render_traceback_(self) -> list[str]:
        """What IPython shows when this error ends a cell: the line that was run, and the same text as in a terminal."""
        import os
        import traceback

        own = os.path.dirname(os.path.abspath(__file__))
        outside = [item for item in traceback.extract_tb(self.__traceback__) if not item.filename.startswith(own)]
        lines = [f"line {outside[-1].lineno}: {outside[-1].line}"] if outside and outside[-1].line else []
        return [*lines, *self._rendered(self.diagnostics, color=not os.environ.get("NO_COLOR")).split("\n")]

    def _repr_html_(self) -> str:
        from movimentum.markup import text_html

        return text_html(self._rendered(self.diagnostics, color=True))


class ScriptError(MovimentumError):
    """The script is at fault.

    >>> import movimentum as mv
    >>> mv.loads("Rod : .bar A = [0,0] B = [9,0]; @0 Rod.A = 5;")
    Traceback (most recent call last):
        ...
    movimentum.errors.ScriptError: error[kind/mismatch]: ...
    """


class UnknownNameError(ScriptError, KeyError):
    """The scene has nothing of the requested name.

    >>> import movimentum as mv
    >>> motion = mv.loads("Rod : .bar A = [0,0] B = [9,0]; @0 Rod.A = [5,5]; Rod.angle = 0;").solve()
    >>> try:
    ...     motion["Rood.A"]
    ... except KeyError as error:
    ...     print(error.diagnostics[0].helps[0])
    did you mean `Rod.A`?
    """


class UsageError(MovimentumError):
    """The command, or the call, is at fault: options that do not fit, a file that cannot be read or written.

    >>> import movimentum as mv
    >>> mv.load("no-such-script.mov")
    Traceback (most recent call last):
        ...
    movimentum.errors.UsageError: error[usage/script]: cannot read no-such-script.mov: no such file or directory
    """

    exit_code = 2


class NoSolutionError(MovimentumError):
    """The scene has no solution at some time; its diagnostics say when and why.

    >>> import movimentum as mv
    >>> script = mv.loads("Rod : .bar A=[0,0] B=[9,0]; @0 Rod.A = [0,0]; Rod.B = [8 + 2*.t, y]; y > 0; @1")
    >>> try:
    ...     script.solve()
    ... except mv.NoSolutionError as error:
    ...     print(error.diagnostics[0].code)
    solve/unreachable
    """

    exit_code = 3


def usage_error(code: str, message: str, *helps: str) -> UsageError:
    """A `UsageError` with one diagnostic, which is not about a place in a script."""
    return UsageError([Diagnostic(code, Severity.ERROR, message, helps=helps)])


def script_error(code: str, message: str, *helps: str) -> ScriptError:
    """A `ScriptError` with one diagnostic, which is not about a place in the script."""
    return error_at(code, message, None, *helps)


def error_at(code: str, message: str, span: Span | None, *helps: str) -> ScriptError:
    """A `ScriptError` with one diagnostic, about the text at ``span``."""
    return ScriptError([Diagnostic(code, Severity.ERROR, message, span, helps=helps)])


@contextmanager
def errors_in(source: SourceText) -> Generator[None, None, None]:
    """Errors inside show the lines of ``source`` that they are about."""
    try:
        yield
    except MovimentumError as error:
        if error.source is None:
            error.source = source
        raise
