"""The files that a command reads: the script, and the pictures that it names."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.errors import script_error, usage_error
from movimentum.source import SourceText, UnfoldedText, drawing_file
from movimentum.workflow.limits import MAX_SCRIPT_BYTES

if TYPE_CHECKING:
    from movimentum.scene.model import Scene


def read(path: str) -> SourceText:
    """The script at ``path`` (``-`` is stdin); `UsageError` if there is none, `ScriptError` if it is not text."""
    shown = "<stdin>" if path == "-" else path
    try:
        if path == "-":
            data = sys.stdin.buffer.read(MAX_SCRIPT_BYTES + 1)
        else:
            with Path(path).open("rb") as stream:
                data = stream.read(MAX_SCRIPT_BYTES + 1)
    except (OSError, ValueError, AttributeError) as problem:
        reason = (getattr(problem, "strerror", None) or str(problem)).lower()
        raise usage_error("usage/script", f"cannot read {shown}: {reason}") from problem
    if len(data) > MAX_SCRIPT_BYTES:
        raise script_error("limit/script", f"{shown} is larger than the limit of {MAX_SCRIPT_BYTES // 2**20} MiB")
    try:
        return SourceText(shown, data.decode("utf-8-sig"))
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        raise script_error(
            "syntax/encoding",
            f"{shown} is not text: byte {problem.start} (line {line}) is not UTF-8",
            "a script is a plain text file; save it as UTF-8",
        ) from problem


def reads(source: SourceText, scene: Scene | None) -> tuple[str, ...]:
    """Every file that a command reads for a script: the script, what it includes and its pictures (without a scene, the
    files that it may mean).
    """
    if scene is None:
        return (source.path, *map(str, mentioned_files(source)))
    files = scene.source.files if isinstance(scene.source, UnfoldedText) else ()
    included = [file.path for file in files]
    return (
        source.path,
        *dict.fromkeys(included + [drawing_file(each.image) for each in scene.things if each.image is not None]),
    )


def mentioned_files(source: SourceText) -> tuple[Path, ...]:
    """Every file that the script may refer to, whether or not it exists or the script can be parsed.

    For watching: each quoted text is treated as a file name. The text of a label is not one, but that does no harm.
    """
    import re

    folder = Path() if source.path.startswith("<") else Path(source.path).parent
    return tuple(folder / drawing_file(name) for name in re.findall(r"""['"]([^'"\n\0]{1,255})['"]""", source.text))
