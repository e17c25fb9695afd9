"""Pyslvs' mechanism expressions, and their translation into a script.

``M[J[R, color[Green], P[0.0, 0.0], L[ground, link_1]], J[RP, A[30], P[…], L[…]], …]``: joints with their type, place
and the links that they connect (and a colour, which is ignored). R is a pin through all its links. P and RP are a slot
in the first link, at A degrees as drawn, in which the other links slide (P) or slide and turn (RP). ``ground`` is the
frame. Comments: ``# …`` to the end of the line, ``#[ … #]``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import UsageError, error_at
from movimentum.records import dataclass
from movimentum.source import SourceText, Span
from movimentum.syntax.printer import float_text
from movimentum.text import counted

GROUND = "ground"
TURN = 60
"""Degrees by which a driven link turns in a time unit."""


@dataclass(frozen=True, slots=True)
class MechanismJoint:
    """``kind`` is "R", "P" or "RP"; ``angle`` (degrees) that of a slot; ``links`` the slot's first."""

    kind: str
    place: tuple[float, float]
    links: tuple[str, ...]
    angle: float = 0.0


# --- reading --------------------------------------------------------------------------------------------

_TOKEN = re.compile(
    r"(?P<skip>\s+|\#\[.*?\#\][^\n]*|\#[^\n]*)|(?P<word>[A-Za-z_][\w-]*)|(?P<mark>[\[\](),])"
    r"|(?P<number>[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    span: Span


class _Reader:
    """Reads tokens one after the other, and reports what it expected."""

    def __init__(self, source: SourceText) -> None:
        self.tokens = list(_tokens(source))
        self.place = 0

    def peek(self) -> str:
        return self.tokens[self.place].text

    def take(self, *wanted: str, kind: str | None = None) -> _Token:
        token = self.tokens[self.place]
        if token.kind != kind and token.text not in wanted:
            what = " or ".join(f"`{word}`" for word in wanted) if wanted else f"a {kind}"
            shown = f"`{token.text}`" if token.text else "the end"
            raise error_at("mechanism/syntax", f"found {shown} where {what} should be", token.span)
        self.place += 1
        return token

    def bracket(self, *names: str) -> _Token:
        """``name [``."""
        token = self.take(*names)
        self.take("[")
        return token

    def number(self) -> float:
        token = self.take(kind="number")
        value = float(token.text)
        if not abs(value) < 1e150:
            raise error_at("mechanism/syntax", f"{token.text} is too large a number", token.span)
        return value


def _tokens(source: SourceText) -> Iterator[_Token]:
    place = 0
    while place < len(source.text):
        match = _TOKEN.match(source.text, place)
        if match is None:
            raise error_at("mechanism/syntax", f"`{source.text[place]}` has no meaning here", Span(place, place + 1))
        if match.lastgroup != "skip":
            yield _Token(str(match.lastgroup), match[0], Span(place, match.end()))
        place = match.end()
    yield _Token("end", "", Span(place, place))


def read_mechanism(source: SourceText) -> tuple[MechanismJoint, ...]:
    """The joints of a mechanism expression; raises `ScriptError` with the place of the error."""
    reader = _Reader(source)
    reader.bracket("M")
    joints: list[MechanismJoint] = []
    while reader.peek() != "]":
        joints.append(_joint(reader))
        if reader.peek() != "]":
            reader.take(",", "]")
    end = reader.take("]")
    if reader.peek():
        raise error_at("mechanism/syntax", "something follows the mechanism", reader.tokens[reader.place].span)
    if not joints:
        raise error_at("mechanism/empty", "the mechanism has no joint", end.span, "M[J[R, P[0, 0], L[ground, link_1]]]")
    return tuple(joints)


def _joint(reader: _Reader) -> MechanismJoint:
    begin = reader.bracket("J")
    kind = reader.take("R", "P", "RP").text
    reader.take(",")
    angle = 0.0
    has_angle = reader.peek() == "A"
    if has_angle or kind != "R":
        reader.bracket("A")
        angle = reader.number()
        reader.take("]")
        reader.take(",")
    if reader.peek() == "color":
        reader.bracket("color")
        _color(reader)
        reader.take("]")
        reader.take(",")
    reader.bracket("P")
    x = reader.number()
    reader.take(",")
    y = reader.number()
    reader.take("]")
    reader.take(",")
    reader.bracket("L")
    links: list[str] = []
    while reader.peek() != "]":
        link = reader.take(kind="word")
        if link.text in links:
            raise error_at("mechanism/links", f"`{link.text}` is named twice", link.span)
        links.append(link.text)
        if reader.peek() != "]":
            reader.take(",", "]")
    reader.take("]")
    end = reader.take("]")
    span = begin.span.to(end.span)
    if kind != "R" and len(links) < 2:
        raise error_at("mechanism/links", f"a {kind} joint needs the link with the slot and one that slides", span)
    return MechanismJoint(kind, (x, y), tuple(links), angle)


def _color(reader: _Reader) -> None:
    if reader.peek() != "(":
        reader.take(kind="word")
        return
    reader.take("(")
    for mark in (",", ",", ")"):
        reader.number()
        reader.take(mark)


# --- as a script ----------------------------------------------------------------------------------------


def mechanism_script(
    joints: Sequence[MechanismJoint], drives: Iterable[tuple[int, int]], title: str, more: Sequence[str] = ()
) -> str:
    """A script that states the mechanism: links as bars, whose anchors are named after their joints, and the equations
    of the joints; each of ``drives`` (base, driven) turns the driven joint about the base, one turn from where it is
    drawn. (A slider that is its own base is moved along its slot.) ``more`` statements stand behind the joints.

    Raises `UsageError` for a drive that is not possible.
    """
    names = link_names(joints)
    drives = list(drives)
    turning = {pair: _driven_link(joints, pair) for pair in drives}
    pushed = {base for base, driven in drives if base == driven}
    lines = [
        f"// {title}: {counted(len(joints), 'joint')}, {counted(len(names), 'link')} and the ground.",
        "// Joint 2 is the anchor P2 of every link that it connects.",
        "",
        ".config(24);",
        "",
    ]
    for link, name in names.items():
        lines.append(_definition(joints, link, name))
    for n, joint in enumerate(joints):
        if not set(joint.links) - {GROUND}:
            lines.append(f"Ground{n} : .disc(3)  P{n} = {point_text(joint.place)};{_spoken(joint)}")
    lines += ["", "@0"]
    stated = [line for n, joint in enumerate(joints) for line in _statements(n, joint, names, n in pushed)]
    lines += [*stated, *_free_links(joints, names, [*stated, *more]), *more]
    for base, driven in drives:
        if base == driven:
            reach = float_text(float(f"{0.1 * _size(joints):.2g}"))
            lines += ["", f"slide_{base} = {reach}*.sin({TURN}*.t);  // how far joint {base} is from where it is drawn"]
            continue
        (bx, by), (dx, dy) = joints[base].place, joints[driven].place
        first = float_text(math.degrees(math.atan2(dy - by, dx - bx)))
        name = f"input_{base}_{driven}"
        lines += [
            "",
            f"{name} = {first} + {TURN}*.t;  // the direction from joint {base} to joint {driven}",
            f"{names[turning[base, driven]]}.angle = {name} - ({first});",
        ]
    if drives:
        lines.append(f"@{360 // TURN}")
    return "\n".join(lines) + "\n"


_OURS = re.compile(r"Ground\d+|slide_\d+|input_\d+_\d+")


def link_names(joints: Sequence[MechanismJoint]) -> dict[str, str]:
    """Each link's name in the script."""
    names: dict[str, str] = {}
    for joint in joints:
        for link in joint.links:
            if link != GROUND and link not in names:
                names[link] = script_name(link, "L", lambda name: name in names.values() or _OURS.fullmatch(name))
    return names


def _driven_link(joints: Sequence[MechanismJoint], pair: tuple[int, int]) -> str:
    base, driven = pair
    for number in pair:
        if not 0 <= number < len(joints):
            raise _usage(Advised(Choose.DRIVE.to(), f" {base},{driven}: joints are numbered 0 to {len(joints) - 1}"))
    if base == driven:
        if joints[base].kind == "R":
            raise _usage(
                Advised(Choose.DRIVE.to(), f" {base},{driven}: joint {base} is not a slider and cannot be its own base")
            )
        return joints[base].links[0]
    common = [link for link in joints[base].links if link in joints[driven].links]
    if GROUND in common:
        raise _usage(Advised(Choose.DRIVE.to(), f" {base},{driven}: both joints are fixed to the ground"))
    if not common:
        near = next(
            (
                f"{base},{n}"
                for n, other in enumerate(joints)
                if n != base and set(other.links) & set(joints[base].links)
            ),
            "0,1",
        )
        raise _usage(
            Advised(Choose.DRIVE.to(), f" {base},{driven}: no link connects joint {base} and joint {driven}"),
            Choose.DRIVE.to(near),
        )
    return common[0]


def _usage(message: str, *helps: str) -> UsageError:
    return UsageError([Diagnostic("usage/drive", Severity.ERROR, message, helps=helps)])


def _definition(joints: Sequence[MechanismJoint], link: str, name: str) -> str:
    """A link as a bar through its joints; with a slot, to a point further along it."""
    anchors: list[str] = []
    for n, joint in enumerate(joints):
        if link not in joint.links:
            continue
        anchors.append(f"P{n} = {point_text(joint.place)}")
        if joint.kind != "R" and _has_direction(joint, link):
            length = float_text(float(f"{0.2 * _size(joints):.2g}"))
            turn = float_text(joint.angle)
            anchors.append(f"S{n} = P{n} + [{length}*.cos({turn}), {length}*.sin({turn})]")
    if len(anchors) == 1:
        return f"{name} : .disc(3)  {anchors[0]};"
    return f"{name} : .bar  {'  '.join(anchors)};"


def _has_direction(joint: MechanismJoint, link: str) -> bool:
    """Whether the direction of a joint's slot is marked on ``link``: on the slot's link, and on links that must not
    turn in it.
    """
    return link == joint.links[0] or (joint.kind == "P" and joint.links[0] != GROUND)


def _statements(n: int, joint: MechanismJoint, names: dict[str, str], pushed: bool) -> list[str]:
    """The equations of a joint about its links."""
    lines: list[str] = []
    if joint.kind == "R":
        bodies = [link for link in joint.links if link != GROUND]
        if GROUND in joint.links and bodies:
            lines.append(f"{names[bodies[0]]}.P{n} = {point_text(joint.place)};")
        lines += [f"{names[link]}.P{n} = {names[bodies[0]]}.P{n};" for link in bodies[1:]]
        return lines
    slot, *pins = joint.links
    along = f"slide_{n}" if pushed else "_"
    if slot == GROUND:
        track = f"{point_text(joint.place)} + [{along}, 0].r({float_text(joint.angle)})"
    else:
        origin, ahead = f"{names[slot]}.P{n}", f"{names[slot]}.S{n}"
        length = f"/({ahead} - {origin}).l" if pushed else ""
        track = f"{origin} + ({ahead} - {origin}) * {along}{length}"
    if GROUND in pins:
        lines.append(f"{track} = {point_text(joint.place)};")
        lines += [f"{names[pin]}.P{n} = {point_text(joint.place)};" for pin in pins if pin != GROUND]
    else:
        lines.append(f"{names[pins[0]]}.P{n} = {track};")
        lines += [f"{names[pin]}.P{n} = {names[pins[0]]}.P{n};" for pin in pins[1:]]
    if joint.kind == "P":
        for pin in pins:
            if slot == GROUND:
                lines.append(f"{names[pin]}.angle = 0;")
            elif pin == GROUND:
                lines.append(f"{names[slot]}.angle = 0;")
            else:
                sides = ", ".join(f"{names[link]}.S{n} - {names[link]}.P{n}" for link in (slot, pin))
                lines.append(f".a({sides}) = 0;")
    return lines


def _free_links(joints: Sequence[MechanismJoint], names: dict[str, str], stated: Iterable[str]) -> list[str]:
    """For each link that no statement mentions, a statement that it may be anywhere, so that it is not a backdrop."""
    mentioned = set(re.findall(r"\w+(?=\.)", "\n".join(stated)))
    first = {link: n for n, joint in reversed([*enumerate(joints)]) for link in joint.links}
    return [
        f"{name}.P{first[link]} = [_, _];  // free to be anywhere"
        for link, name in names.items()
        if name not in mentioned
    ]


def _spoken(joint: MechanismJoint) -> str:
    return "  // no link" if not joint.links else ""


def _size(joints: Sequence[MechanismJoint]) -> float:
    """The mechanism's extent as drawn; 1 if it has none."""
    return max(max(j.place[k] for j in joints) - min(j.place[k] for j in joints) for k in (0, 1)) or 1.0


def point_text(place: tuple[float, float]) -> str:
    """A place as a script has it."""
    return f"[{float_text(place[0])}, {float_text(place[1])}]"


def script_name(word: str, prefix: str, taken: Callable[[str], object]) -> str:
    """A name that the language allows, as near to ``word`` as possible: it begins with a letter (otherwise with
    ``prefix``), and is lengthened by ``_`` until it is not ``taken``.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", word)
    name = name if re.match(r"[A-Za-z]", name) else f"{prefix}{name}"
    while taken(name):
        name += "_"
    return name
