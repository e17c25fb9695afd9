"""The file format of the rigidity simulator "linkages", and its translation into a script.

A file consists of lines. One that starts with ``v``, ``e``, ``f`` or ``a`` opens a section (the rest of it is ignored).
Each line after it holds, by section, two floats (a vertex), two indices (a rod between two vertices), one index (a
fixed vertex) or three indices ``i j k`` (the angle at vertex i, from j to k, is fixed). Indices start at 0. Sections
may be repeated, in any order. Lengths and angles follow from the coordinates. Anything else is ignored, with a warning.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from movimentum.diagnostics import Diagnostic, Label, Severity, the_first
from movimentum.errors import ScriptError
from movimentum.records import dataclass, replace
from movimentum.source import SourceText, Span
from movimentum.syntax.printer import float_text
from movimentum.tolerances import NOISE, NOISE_DEG

Vertex = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Linkage:
    """``vertices`` (x, y); ``rods`` pairs, ``fixed`` single ones and ``angles`` triples (i, j, k) of vertex numbers.

    ``degrees`` has for each angle the turn from i-j to i-k, in (-180, 180].
    """

    vertices: tuple[Vertex, ...]
    rods: tuple[tuple[int, int], ...] = ()
    fixed: tuple[int, ...] = ()
    angles: tuple[tuple[int, int, int], ...] = ()
    degrees: tuple[float, ...] = ()

    def length(self, rod: int) -> float:
        """The length of rod number ``rod``."""
        i, j = self.rods[rod]
        return math.dist(self.vertices[i], self.vertices[j])


def turn(vertices: Sequence[Vertex], angle: tuple[int, int, int]) -> float:
    """The angle (i, j, k) that vertices imply, in degrees, in (-180, 180]."""
    (x, y), (ux, uy), (vx, vy) = (vertices[n] for n in angle)
    ux, uy, vx, vy = ux - x, uy - y, vx - x, vy - y
    return math.degrees(math.atan2(ux * vy - uy * vx, ux * vx + uy * vy))


# --- reading and writing files ----------------------------------------------------------------------------

_NUMBERS = {"v": 2, "e": 2, "f": 1, "a": 3}
_KIND = {"v": "vertex", "e": "rod", "f": "fixed vertex", "a": "angle"}
_SHAPE = {"v": "two numbers", "e": "two vertex numbers", "f": "one vertex number", "a": "three vertex numbers"}


def read_linkage(source: SourceText) -> tuple[Linkage, tuple[Diagnostic, ...]]:
    """The linkage of a file, and a warning for each line that was left out; `ScriptError` if no vertex is left."""
    found: list[Diagnostic] = []
    lines: dict[str, list[tuple[tuple[float, ...], Span]]] = {kind: [] for kind in _NUMBERS}
    section: str | None = None
    offset = 0
    for line in re.split(r"(\r\n|\r|\n)", source.text):
        words = line.split()
        first = line.lstrip()
        span = Span(offset + len(line) - len(first), offset + len(line.rstrip()))
        offset += len(line)
        if not words:
            continue
        if words[0][0] in _NUMBERS:
            section = words[0][0]
            continue
        numbers = None if section is None else _numbers(section, words)
        if section is None:
            found.append(_left_out("import/line", "this line belongs to no section", span, "begin a section with v"))
        elif numbers is None:
            article = "an" if section == "a" else "a"
            found.append(
                _left_out(
                    "import/line", f"this line does not describe {article} {_KIND[section]}", span, _SHAPE[section]
                )
            )
        else:
            lines[section].append((numbers, span))
    linkage = _linked(lines, found)
    found.sort(key=lambda item: item.span or Span(0, 0))
    found = the_first(found)
    if not linkage.vertices:
        raise ScriptError([*found, Diagnostic("import/empty", Severity.ERROR, f"{source.path} has no vertex")])
    return linkage, tuple(found)


def _numbers(section: str, words: list[str]) -> tuple[float, ...] | None:
    if len(words) != _NUMBERS[section] or not all(word.isascii() and "_" not in word for word in words):
        return None  # Python would read 1_0 and other scripts' digits
    try:
        numbers = tuple(float(word) if section == "v" else int(word) for word in words)
    except ValueError:
        return None
    return numbers if all(math.isfinite(number) and abs(number) < 1e150 for number in numbers) else None


def _linked(lines: dict[str, list[tuple[tuple[float, ...], Span]]], found: list[Diagnostic]) -> Linkage:
    """The linkage from the lines of all sections; what makes no sense is left out and reported."""
    vertices = tuple((x, y) for (x, y), _ in lines["v"])
    taken: dict[tuple[str, tuple[int, ...], frozenset[int]], Span] = {}

    def accepted(kind: str) -> list[tuple[int, ...]]:
        result: list[tuple[int, ...]] = []
        for numbers, span in lines[kind]:
            indices = tuple(int(number) for number in numbers)
            name = _KIND[kind]
            wrong = next((index for index in indices if not 0 <= index < len(vertices)), None)
            if wrong is not None:
                known = f"vertices are numbered 0 to {len(vertices) - 1}" if vertices else "there is no vertex"
                found.append(_left_out("import/index", f"this {name} names vertex {wrong}; {known}", span))
            elif len(set(indices)) < len(indices):
                found.append(_left_out("import/degenerate", f"this {name} names a vertex twice", span))
            elif len(indices) > 1 and any(vertices[indices[0]] == vertices[other] for other in indices[1:]):
                found.append(_left_out("import/degenerate", f"this {name} is between vertices at the same place", span))
            elif (key := (kind, indices[: len(indices) % 2], frozenset(indices))) in taken:
                first = (Label(taken[key], "here"),)
                found.append(
                    replace(_left_out("import/duplicate", f"this {name} is already there", span), labels=first)
                )
            else:
                taken[key] = span
                result.append(indices)
        return result

    rods = tuple((i, j) for i, j in accepted("e"))
    fixed = tuple(i for (i,) in accepted("f"))
    angles = tuple((i, j, k) for i, j, k in accepted("a"))
    return Linkage(vertices, rods, fixed, angles, tuple(turn(vertices, angle) for angle in angles))


def _left_out(code: str, message: str, span: Span, help_text: str | None = None) -> Diagnostic:
    helps = () if help_text is None else (f"a line here holds {help_text}",)
    return Diagnostic(code, Severity.WARNING, f"{message}: left out", span, helps=helps)


def linkage_text(linkage: Linkage) -> str:
    """The linkage in the file's format; coordinates read back exactly."""
    parts = ["v\n", *(f"{float(x)!r} {float(y)!r}\n" for x, y in linkage.vertices)]
    parts += ["f\n", *(f"{i}\n" for i in linkage.fixed)]
    parts += ["e\n", *(f"{i} {j}\n" for i, j in linkage.rods)]
    parts += ["a\n", *(f"{i} {j} {k}\n" for i, j, k in linkage.angles)]
    return "".join(parts)


# --- as a script ----------------------------------------------------------------------------------------


def linkage_script(linkage: Linkage, title: str) -> str:
    """A script that states the linkage: rods as bars whose anchors are named after their vertices, joints as
    coincidences, fixed vertices, angles, and that the rest is free. It is drawn as it is, and nothing drives it.
    """
    counts = (
        _counted(len(linkage.vertices), "vertex", "vertices"),
        _counted(len(linkage.rods), "rod"),
        _counted(len(linkage.fixed), "fixed vertex", "fixed vertices"),
        _counted(len(linkage.angles), "angle"),
    )
    size = max(abs(number) for place in linkage.vertices for number in place)
    vertices = [tuple(0.0 if abs(n) <= NOISE * size else n for n in place) for place in linkage.vertices]
    lines = [
        f"// {title}: {', '.join(counts)}.",
        *_names_explained(linkage),
        "",
        ".config(24);",
        "",
    ]
    end_of: dict[int, str] = {}
    joints: list[str] = []
    anchors: dict[str, str] = {}
    for i, j in linkage.rods:
        name = f"R{i}_{j}"
        anchors[name] = f"{name}.V{i}"
        ends = "  ".join(f"V{n} = {_point(vertices[n])}" for n in (i, j))
        lines.append(f"{name} : .bar  {ends};")
        for n in (i, j):
            anchor = f"{name}.V{n}"
            if n in end_of:
                joints.append(f"{anchor} = {end_of[n]};")
            else:
                end_of[n] = anchor
    for n, place in enumerate(vertices):
        if n not in end_of:
            lines.append(f"P{n} : .disc(3)  V{n} = {_point(place)};")
            end_of[n] = anchors[f"P{n}"] = f"P{n}.V{n}"
    lines += ["", "@0"]
    if joints:
        lines += ["// joints", *joints]
    if linkage.fixed:
        lines += ["// fixed vertices", *(f"{end_of[n]} = {_point(vertices[n])};" for n in linkage.fixed)]
    if linkage.angles:
        lines.append("// angles")
        rod_of = {frozenset(rod): f"R{rod[0]}_{rod[1]}" for rod in linkage.rods}
        for (i, j, k), degrees in zip(linkage.angles, linkage.degrees, strict=True):
            u, v = (_side(rod_of, end_of, i, n) for n in (j, k))
            lines.append(f".a({u}, {v}) = {float_text(_without_noise(degrees))};")
    mentioned = set(re.findall(r"\w+(?=\.V)", "\n".join(lines[lines.index("@0") :])))
    free = [f"    {anchor} = [_, _];" for name, anchor in anchors.items() if name not in mentioned]
    if free:
        # a thing that no statement mentions would be a backdrop, which stays where it is drawn
        lines += ["// free to be anywhere", *free]
    return "\n".join(lines) + "\n"


def _names_explained(linkage: Linkage) -> list[str]:
    """A comment about the names in a script, with a rod of this linkage as the example."""
    if not linkage.rods:
        return []
    i, j = linkage.rods[0]
    rod = f"R{i}_{j} is the rod from vertex {i} to vertex {j}"
    return [f"// Vertex {j} is the anchor V{j} of every rod that ends there: {rod}."]


def _side(rod_of: dict[frozenset[int], str], end_of: dict[int, str], start: int, end: int) -> str:
    """The vector from one vertex to another: along their rod, if they have one."""
    rod = rod_of.get(frozenset((start, end)))
    if rod is not None:
        return f"{rod}.V{end} - {rod}.V{start}"
    return f"{end_of[end]} - {end_of[start]}"


def _point(place: Sequence[float]) -> str:
    return f"[{float_text(place[0])}, {float_text(place[1])}]"


def _without_noise(degrees: float) -> float:
    """An angle from coordinates; a whole number that is off by rounding only is that number."""
    whole = round(degrees)
    return float(whole) if abs(degrees - whole) < NOISE_DEG else degrees


def _counted(count: int, one: str, many: str | None = None) -> str:
    return f"{count or 'no'} {one if count == 1 else many or one + 's'}"
