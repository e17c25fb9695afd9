"""Converts other programs' files to scripts, whatever their format."""

from __future__ import annotations

from collections.abc import Iterable

from movimentum.diagnostics import Diagnostic
from movimentum.interop.recognised import FileKind, kind_of
from movimentum.source import SourceText


def script_of(
    source: SourceText, title: str, drives: Iterable[tuple[int, int]] = (), snap_angle: float | None = None
) -> tuple[str, tuple[Diagnostic, ...]]:
    """The script that a file becomes, and warnings; its content tells its format. ``drives``: inputs of a mechanism
    expression; ``snap_angle``: repair a linkage file's coordinates, with angles multiples of it. Raises `ScriptError`.
    """
    match kind_of(source):
        case FileKind.MECHANISM:
            from movimentum.interop.mechanisms import mechanism_script, read_mechanism

            return mechanism_script(read_mechanism(source), drives, title), ()
        case FileKind.FORMULAS:
            from movimentum.interop.formula_script import formula_script
            from movimentum.interop.formulas import read_formulas

            return formula_script(read_formulas(source), title)
        case FileKind.PMKS:
            from movimentum.interop.pmks import pmks_script, read_pmks

            return pmks_script(read_pmks(source), title)
        case FileKind.LINKAGE2:
            from movimentum.interop.linkage2 import linkage2_script, read_linkage2

            mechanism, found = read_linkage2(source)
            return linkage2_script(mechanism, title), found
        case FileKind.DXF:
            from movimentum.interop.dxf import dxf_script

            return dxf_script(source, title)
        case FileKind.LINKAGE:
            from movimentum.interop.linkages import linkage_script, read_linkage

            linkage, found = read_linkage(source)
            if snap_angle is not None:
                from movimentum.interop.snapping import snapped

                result = snapped(linkage, snap_angle)
                linkage, found = result.linkage, (*found, *result.diagnostics)
            return linkage_script(linkage, title), found
