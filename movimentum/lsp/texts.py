"""The texts that are open in an editor, and positions in them: lines end as the protocol says, columns are UTF-16."""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

from lsprotocol import types

from movimentum.editing.project import text_on_disk
from movimentum.records import dataclass
from movimentum.source import SourceText, Span
from movimentum.workflow.read import ScriptFiles

_LINE_END = re.compile(r"\r\n|\r|\n")


class OpenText:
    """A text with its version."""

    def __init__(self, uri: str, text: str, version: int) -> None:
        self.uri = uri
        self.version = version
        self.text = text
        self.starts: list[int] = []
        self._count()

    def _count(self) -> None:
        self.starts = [0, *(found.end() for found in _LINE_END.finditer(self.text))]

    def offset(self, position: types.Position) -> int:
        """The offset of a position; one behind the end of its line is that end."""
        if position.line < 0:
            return 0
        if position.line >= len(self.starts):
            return len(self.text)
        start = self.starts[position.line]
        end = self.starts[position.line + 1] if position.line + 1 < len(self.starts) else len(self.text)
        line = self.text[start:end].rstrip("\r\n")
        if line.isascii():
            return start + min(max(position.character, 0), len(line))
        left = position.character
        for number, letter in enumerate(line):
            left -= 2 if ord(letter) > 0xFFFF else 1
            if left < 0:
                return start + number
        return start + len(line)

    def position(self, offset: int) -> types.Position:
        """The position of an offset."""
        offset = max(0, min(offset, len(self.text)))
        line = bisect_right(self.starts, offset) - 1
        before = self.text[self.starts[line] : offset]
        return types.Position(line, len(before) if before.isascii() else len(before.encode("utf-16-le")) // 2)

    def range(self, span: Span) -> types.Range:
        """The range of a span."""
        return types.Range(self.position(span.start), self.position(span.end))

    def change(self, changes: list[types.TextDocumentContentChangeEvent] | tuple[object, ...], version: int) -> None:
        """Take over what was typed, one change after the other."""
        for each in changes:
            if isinstance(each, types.TextDocumentContentChangePartial):
                start, end = self.offset(each.range.start), self.offset(each.range.end)
                self.text = self.text[:start] + each.text + self.text[max(start, end) :]
            elif isinstance(each, types.TextDocumentContentChangeWholeDocument):
                self.text = each.text
            self._count()
        self.version = version


def path_of(uri: str) -> str:
    """The path of a document; an untitled one gets a name that no file has."""
    parts = urlsplit(uri)
    if parts.scheme != "file":
        return f"<{uri}>"
    path = unquote(parts.path)
    if re.match(r"/[A-Za-z]:", path):
        path = path[1:]
    return os.path.normpath((f"//{parts.netloc}" if parts.netloc else "") + path)


def uri_of(path: str) -> str:
    """The address of a path."""
    if path.startswith("<"):
        return path.strip("<>")
    return Path(path).as_uri() if os.path.isabs(path) else "file:" + quote(path)


class Texts:
    """Every text that is open, by its path; other files are read from the disk."""

    def __init__(self) -> None:
        self.open: dict[str, OpenText] = {}

    def text(self, path: str) -> str | None:
        """The text at a path: that of the editor, if it is open there."""
        opened = self.open.get(path)
        if opened is not None:
            return opened.text
        return None if path.startswith("<") else text_on_disk(path)

    def at(self, path: str) -> OpenText | None:
        """The text at a path, for its positions."""
        if path in self.open:
            return self.open[path]
        text = self.text(path)
        return None if text is None else OpenText(uri_of(path), text, 0)


@dataclass(eq=False)
class EditedFiles(ScriptFiles):
    """What a script's files tell, as they are in the editor."""

    edited: Texts | None = None

    def text(self, path: str) -> SourceText:
        """The text of an included file; errors as in `movimentum.workflow.read.read`."""
        opened = None if self.edited is None else self.edited.open.get(os.path.normpath(path))
        return ScriptFiles.text(self, path) if opened is None else SourceText(path, opened.text)
