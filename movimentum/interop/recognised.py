"""The format of a text, judged by its content."""

from __future__ import annotations

import re
from enum import StrEnum

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.interop.formulas import without_comments
from movimentum.source import SourceText


class FileKind(StrEnum):
    """What can be imported."""

    LINKAGE = "linkage"
    MECHANISM = "mechanism"
    FORMULAS = "formulas"

    @property
    def told(self) -> str:
        """The format's name in a sentence."""
        return {"linkage": "a linkage file", "mechanism": "a mechanism expression", "formulas": "a formula"}[self]


_MECHANISM = re.compile(r"\s*M\s*\[")
_FORMULA = re.compile(r"(?:^|[;\r\n])[ \t]*(?:P[A-Za-z]{2,3}[ \t]*\[|[^\W\d]\w*[ \t]*\[[^\]\r\n]*\][ \t]*\()")
_VALUE = re.compile(r"\s*[^\W\d]\w*\s*=\s*[-+\[(\d.]")
_VERTICES = re.compile(r"(?:^|[\r\n])[ \t]*v[^\r\n]*[\r\n]+[ \t]*[-+.\d]\S*[ \t]+[-+.\d]\S*[ \t]*(?:[\r\n]|\Z)")
_SECTION = re.compile(r"(?:^|[\r\n])[ \t]*[vefa]")


def kind_of(source: SourceText) -> FileKind:
    """The format of a text; raises `ScriptError` if it has no known format.

    A mechanism begins with ``M[``; formulas have a function with brackets, or begin with a value; a linkage has a line
    that opens a section. Comments (``#``) are ignored.
    """
    text = without_comments(source.text)
    if _MECHANISM.match(text):
        return FileKind.MECHANISM
    if _FORMULA.search(text) or (_VALUE.match(text) and not _VERTICES.search(text)):
        return FileKind.FORMULAS
    if _SECTION.search(text):
        return FileKind.LINKAGE
    helps = (
        "a linkage file: `v`, and below it two numbers on each line",
        "M[J[R, P[0, 0], L[ground, link_1]]]",
        "PLLP[P1, L1, L2, P2](P3)",
    )
    if text.strip():
        message = "this is neither a linkage file, nor a mechanism expression, nor triangular formulas"
    else:
        message = (
            f"there is nothing in {source.path} but comments" if source.text.strip() else f"{source.path} is empty"
        )
    raise ScriptError([Diagnostic("import/unknown", Severity.ERROR, message, helps=helps)])
