"""Reads a command's files: the script, and the pictures that it names."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.errors import script_error, usage_error
from movimentum.records import dataclass, field
from movimentum.source import SourceText, UnfoldedText, drawing_file
from movimentum.workflow.choices import MAX_SCRIPT_BYTES

if TYPE_CHECKING:
    from movimentum.diagnostics import Diagnostic
    from movimentum.expressions.tables import Table
    from movimentum.scene.expansion.table_files import TableColumn
    from movimentum.scene.model import Scene


def read(path: str) -> SourceText:
    """The script at ``path`` (``-`` is stdin); `UsageError` if there is none, `ScriptError` if it is not text."""
    return decoded(read_bytes(path), path)


def _shown(path: str) -> str:
    return "<stdin>" if path == "-" else path


def read_bytes(path: str) -> bytes:
    """The bytes of the script at ``path`` (``-`` is stdin); `UsageError` without one, `ScriptError` for too many."""
    shown = _shown(path)
    try:
        if path == "-":
            data = sys.stdin.buffer.read(MAX_SCRIPT_BYTES + 1)
        else:
            with Path(path).open("rb") as stream:
                data = stream.read(MAX_SCRIPT_BYTES + 1)
    except (OSError, ValueError, AttributeError) as problem:
        reason = (getattr(problem, "strerror", None) or str(problem)).lower()
        helps = _alike(path) if isinstance(problem, FileNotFoundError) else ()
        raise usage_error("usage/script", f"cannot read {shown}: {reason}", *helps) from problem
    if len(data) > MAX_SCRIPT_BYTES:
        raise script_error("limit/script", f"{shown} is larger than the limit of {MAX_SCRIPT_BYTES // 2**20} MiB")
    return data


def decoded(data: bytes, path: str) -> SourceText:
    """The script that was read from ``path``; `ScriptError` if it is not text."""
    shown = _shown(path)
    try:
        return SourceText(shown, data.decode("utf-8-sig"))
    except UnicodeDecodeError as problem:
        if b"SolveSpaceREV" in data[:64]:
            raise script_error(
                "syntax/solvespace",
                f"{shown} is a sketch of SolveSpace, and a script cannot state all of its constraints",
                "draw the mechanism as bars: `movimentum import --help` lists what can be imported",
            ) from problem
        line = data.count(b"\n", 0, problem.start) + 1
        raise script_error(
            "syntax/encoding",
            f"{shown} is not text: byte {problem.start} (line {line}) is not UTF-8",
            "a script is a plain text file; save it as UTF-8",
        ) from problem


def _alike(path: str) -> tuple[str, ...]:
    """A help with the name of a script beside where ``path`` would be that it may have meant."""
    from movimentum.syntax.suggest import nearest
    from movimentum.terminal import typed

    wanted = Path(path)
    try:
        names = [name for name in os.listdir(wanted.parent) if name.endswith((".mov", wanted.suffix or ".mov"))]
    except OSError:
        return ()
    guess = nearest(wanted.name, names) or nearest(f"{wanted.stem}.mov", names)
    return () if guess is None else (f"did you mean {typed(wanted.with_name(guess))}?",)


NOT_SENT = "usage/dask"
"""The code for a file that another process would need."""


@dataclass(eq=False)
class ScriptFiles:
    """The data that a scene needs from a script's files: each is read once, and then known, also in other processes.

    If they are ``complete``, no file is opened: one that is not known is a `UsageError` (``usage/dask``).
    """

    texts: dict[str, SourceText] = field(default_factory=dict[str, SourceText])
    sizes: dict[str, tuple[int, int] | Diagnostic] = field(default_factory=dict[str, "tuple[int, int] | Diagnostic"])
    centres: dict[tuple[str, str], tuple[float, float] | Diagnostic] = field(
        default_factory=dict[tuple[str, str], "tuple[float, float] | Diagnostic"]
    )
    tables: dict[TableColumn, Table | Diagnostic] = field(default_factory=dict["TableColumn", "Table | Diagnostic"])
    complete: bool = False

    def text(self, path: str) -> SourceText:
        """The text of an included file; errors as in `read`."""
        if path not in self.texts:
            self._refuse_unknown(path)
            self.texts[path] = read(path)
        return self.texts[path]

    def image_size(self, path: str) -> tuple[int, int] | Diagnostic:
        """(width, height) of a picture in pixels, or what is wrong with it."""
        if path not in self.sizes:
            self._refuse_unknown(path)
            from movimentum.rendering.images import image_size

            self.sizes[path] = image_size(path)
        return self.sizes[path]

    def element_centre(self, path: str, name: str) -> tuple[float, float] | Diagnostic:
        """Where the element called ``name`` of a drawing is, in its pixels, or what is wrong with it."""
        if (path, name) not in self.centres:
            self._refuse_unknown(path)
            from movimentum.rendering.rasters import element_centre

            self.centres[path, name] = element_centre(path, name)
        return self.centres[path, name]

    def table(self, column: TableColumn) -> Table | Diagnostic:
        """A table of a file, or what is wrong with it."""
        if column not in self.tables:
            self._refuse_unknown(column.path)
            from movimentum.interop.table_files import read_table

            self.tables[column] = read_table(column)
        return self.tables[column]

    def _refuse_unknown(self, path: str) -> None:
        if self.complete:
            message = f"a variant uses {path}, which was not sent: the script with its own constants does not use it"
            helps = (
                Advised("use `", Choose.SET.to(), "` to give constants with which the script uses it"),
                Advised("or leave out ", Choose.DASK.to()),
            )
            raise usage_error(NOT_SENT, message, *helps)


def reads(source: SourceText, scene: Scene | None) -> tuple[str, ...]:
    """Every file that a command reads for a script: the script, what it includes and its pictures (without a scene, the
    files that it may mean).
    """
    if scene is None:
        return (source.path, *map(str, mentioned_files(source)))
    files = scene.source.files if isinstance(scene.source, UnfoldedText) else ()
    included = [*(file.path for file in files), *(each.path for each in scene.tables)]
    if (theme := scene.config.theme) is not None and theme.endswith(".theme"):
        included.append(theme)
    return (
        source.path,
        *dict.fromkeys(included + [drawing_file(own.image) for each in scene.things if (own := each.picture)]),
    )


def mentioned_files(source: SourceText) -> tuple[Path, ...]:
    """Every file that the script may refer to, whether or not it exists or the script can be parsed.

    For watching: each quoted text is treated as a file name. The text of a label is not one, but that does no harm.
    """
    import re

    folder = Path() if source.path.startswith("<") else Path(source.path).parent
    return tuple(folder / drawing_file(name) for name in re.findall(r"""['"]([^'"\n\0]{1,255})['"]""", source.text))
