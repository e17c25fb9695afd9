"""Recognises the format of a text by its content."""

from __future__ import annotations

import codecs
import re
from enum import StrEnum
from pathlib import Path

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.source import SourceText
from movimentum.terminal import typed

SHAPES = {
    "PLA": "PLa",
    "PLAP": "PLaP",
    "PLLP": "PLLP",
    "PLPP": "PLPP",
    "PALP": "PaLP",
    "PXY": "PLL",
    "PPP": "PPP",
}
"""What each function takes: points (P), lengths (L) and angles (a). PLAP is also written without its last point."""
_LINE_END = re.compile(r"[\r\n]")


def without_comments(text: str) -> str:
    """The text with its comments blanked out; the rest keeps its place."""
    parts: list[str] = []
    place, closed = 0, True
    while (begin := text.find("#", place)) >= 0:
        end = text.find("#]", begin + 2) if closed and text.startswith("#[", begin) else begin
        if end < 0:  # then no later one ends either, so it is not searched again
            closed, end = False, begin
        line_end = _LINE_END.search(text, end)
        end = len(text) if line_end is None else line_end.start()
        parts += [text[place:begin], re.sub(r"[^\r\n]", " ", text[begin:end])]
        place = end
    return "".join([*parts, text[place:]])


def binary_drawing(data: bytes) -> str:
    """The kind of a binary drawing, or nothing."""
    if data.startswith(b"AutoCAD Binary DXF"):
        return "a binary DXF"
    return "a DWG, which only CAD programs read" if re.match(rb"AC10\d\d\0", data) else ""


def code_page_of_dxf(data: bytes) -> str | None:
    """The encoding of a DXF that is not in UTF-8, as its head names it (else that of Western Europe); None for other
    files.
    """
    text = data.decode("latin-1")
    if not _DXF.match(text):
        return None
    named = _CODE_PAGE.search(text)
    name = "1252" if named is None else named[1]
    for encoding in (f"cp{name}", name):  # ANSI_936 is cp936, Python's name for GBK
        try:
            codecs.lookup(encoding)
        except LookupError:
            continue
        return encoding
    return "cp1252"


class FileKind(StrEnum):
    """The kinds of files that can be imported."""

    LINKAGE = "linkage"
    MECHANISM = "mechanism"
    FORMULAS = "formulas"
    PMKS = "pmks"
    LINKAGE2 = "linkage2"
    DXF = "dxf"

    @property
    def description(self) -> str:
        """The format's name in a sentence."""
        return {
            "linkage": "a linkage file",
            "mechanism": "a mechanism expression",
            "formulas": "a formula",
            "pmks": "a text file of PMKS",
            "linkage2": "a file of the program Linkage",
            "dxf": "a drawing in DXF",
        }[self]


_DXF = re.compile(r"(?:\s*999[^\S\r\n]*\r?\n[^\r\n]*\r?\n)*\s*0[^\S\r\n]*\r?\n\s*SECTION\b")
_CODE_PAGE = re.compile(r"\$DWGCODEPAGE[^\S\r\n]*\r?\n\s*3[^\S\r\n]*\r?\n[^\S\r\n]*(?:ANSI|DOS)?_?(\w+)", re.IGNORECASE)
_LINKAGE2 = re.compile(r"\s*(?:<\?xml[^>]*>\s*)?<linkage2\b")
_PMKS = re.compile(
    r"(?:^|[\r\n])[ \t]*\w+(?:[ \t]*[, \t][ \t]*\w+)*[ \t]*[, \t][ \t]*(?:RP|R|P|G)[ \t]*[, \t][ \t]*[-+.\d]"
    r"[^\s,]*[ \t]*[, \t][ \t]*[-+.\d]",
    re.IGNORECASE,
)
_MECHANISM = re.compile(r"\s*M\s*\[")
_FORMULA = re.compile(r"(?:^|[;\r\n])[ \t]*(?:P[A-Za-z]{2,3}[ \t]*\[|[^\W\d]\w*[ \t]*\[[^\]\r\n]*\][ \t]*\()")
_VALUE = re.compile(r"\s*[^\W\d]\w*\s*=\s*[-+\[(\d.]")
_VERTICES = re.compile(r"(?:^|[\r\n])[ \t]*v[^\r\n]*[\r\n]+[ \t]*[-+.\d]\S*[ \t]+[-+.\d]\S*[ \t]*(?:[\r\n]|\Z)")
_TRIANGLE = re.compile(rf"\s*(?:{'|'.join(SHAPES)})[ \t]*\[")
_SCRIPT = re.compile(r"(?:^|[\r\n])[ \t]*@|\w\s*:|=[^\r\n;]*;[ \t]*(?:[\r\n]|\Z)")
"""Signs of a script that other programs' formats lack: a step, a definition, a statement with its end."""
_SECTION = re.compile(r"(?:^|[\r\n])[ \t]*[vefa]")


def kind_of(source: SourceText) -> FileKind:
    """The format of a text; raises `ScriptError` if it has no known format.

    A mechanism begins with ``M[``, a file of Linkage with its element; a line of PMKS has links, a type and two
    numbers; formulas have a function with brackets, or begin with a value; a linkage has a line that opens a section.
    Comments (``#``) are ignored.
    """
    text = without_comments(source.text)
    if _MECHANISM.match(text):
        return FileKind.MECHANISM
    if _DXF.match(source.text):
        return FileKind.DXF
    if _LINKAGE2.match(source.text):
        return FileKind.LINKAGE2
    if _PMKS.search(text):
        return FileKind.PMKS
    if _FORMULA.search(text) or (_VALUE.match(text) and not _VERTICES.search(text)):
        return FileKind.FORMULAS
    if _SECTION.search(text):
        return FileKind.LINKAGE
    helps = (
        "ground,crank,R,100,100",
        "a linkage file: `v`, and below it two numbers on each line",
        "M[J[R, P[0, 0], L[ground, link_1]]]",
        "PLLP[P1, L1, L2, P2](P3)",
    )
    if text.strip():
        message = (
            "this is neither a linkage file, nor a mechanism expression, nor triangular formulas, nor a file of PMKS or"
            " Linkage"
        )
    else:
        message = (
            f"there is nothing in {source.path} but comments" if source.text.strip() else f"{source.path} is empty"
        )
    raise ScriptError([Diagnostic("import/unknown", Severity.ERROR, message, helps=helps)])


def not_a_script(source: SourceText) -> Diagnostic | None:
    """The error for another program's file where a script is expected; None if it may be meant as a script."""
    text = without_comments(source.text)
    foreign = any(beginning.match(text) for beginning in (_MECHANISM, _TRIANGLE, _LINKAGE2, _PMKS, _DXF))
    foreign |= _SECTION.match(text) is not None and _VERTICES.search(text) is not None
    if not foreign or _SCRIPT.search(text):
        return None
    kind = kind_of(source)
    target = Path(source.path).with_suffix(".mov")
    return Diagnostic(
        "syntax/foreign",
        Severity.ERROR,
        f"{source.path} is {kind.description} and not a script",
        helps=(f"movimentum import {typed(source.path)} -o {typed(target)}",),
    )
