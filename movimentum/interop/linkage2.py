"""Files of the program Linkage (``.linkage2``), as joints of a mechanism.

A file is XML: connectors (``id``, ``x``, ``y`` up; ``anchor``: fixed; ``input`` with ``rpm``, clockwise if positive;
``slider`` between two connectors, its ``slidelimit``s; ``draw``: its path is drawn) and links (the ``connector``s that
they hold; ``actuator`` with ``throw`` and ``cpm``; ``gear``), and the ``ratio``s of pairs of gears and chains.

Source: the program's own files and documentation (D. Rector, Linkage Mechanism Designer and Simulator).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from xml.etree.ElementTree import Element, ParseError, fromstring

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.interop.mechanisms import GROUND, MechanismJoint, link_names, mechanism_script, point_text
from movimentum.records import dataclass, field
from movimentum.source import SourceText
from movimentum.syntax.printer import float_text

SECONDS = 60.0
"""In a minute: inputs and actuators are given for a minute, and a time unit of the script is a second."""
LONGEST = 60.0
"""Time units of a film at most, if no input turns faster."""


@dataclass(frozen=True, slots=True)
class Linkage2:
    """``joints`` in the order of the file's connectors; ``turning``: degrees in a second by which links turn, by link;
    ``actuators``: two joints, the stroke in pixels, and its cycles in a second; ``ratios``: two gears, how often the
    second turns for a turn of the first (negative: the other way round), and the link that holds their centres;
    ``drawn``: joints whose paths are drawn.
    """

    joints: tuple[MechanismJoint, ...]
    turning: dict[str, float] = field(default_factory=dict[str, float])
    actuators: tuple[tuple[int, int, float, float], ...] = ()
    ratios: tuple[tuple[str, str, float, str], ...] = ()
    drawn: tuple[int, ...] = ()


def read_linkage2(source: SourceText) -> tuple[Linkage2, tuple[Diagnostic, ...]]:
    """The mechanism of a file, and a warning for each part that has no counterpart; raises `ScriptError`."""
    root = _root(source)
    found: list[Diagnostic] = []
    connectors = {item.get("id", ""): item for item in root.findall("connector")}
    if not connectors:
        raise ScriptError([Diagnostic("linkage2/empty", Severity.ERROR, f"{source.path} has no connector")])
    number = {name: n for n, name in enumerate(connectors)}
    places = [(_number(item, "x"), _number(item, "y")) for item in connectors.values()]
    links: dict[str, list[int]] = {}
    of_id: dict[str, str] = {}
    actuators: list[tuple[int, int, float, float]] = []
    for item in root.findall("Link"):
        members = [number[name] for c in item.findall("connector") if (name := c.get("id", "")) in number]
        members = list(dict.fromkeys(members))
        if _says(item, "actuator") and len(members) == 2:
            rate = _number(item, "cpm") / SECONDS
            actuators.append((members[0], members[1], math.copysign(_number(item, "throw"), rate), abs(rate)))
        elif len(members) > 1 or _says(item, "gear"):
            name = of_id[item.get("id", "")] = _link_name(item, links)
            links[name] = members
        if item.get("fastenlink") or item.get("fastenconnector"):
            found.append(_left_out(f"link {item.get('id')} is fastened to another element"))
    joints: list[MechanismJoint] = []
    turning: dict[str, float] = {}
    for n, item in enumerate(connectors.values()):
        here = [link for link, members in links.items() if n in members]
        fixed = _says(item, "anchor")
        slot = _slot(item, number, links, connectors) if _says(item, "slider") else None
        sliding = () if slot is None else (*([GROUND] if fixed else []), *(link for link in here if link != slot[0]))
        if slot is not None and sliding and slot[0] != sliding[0]:
            (ax, ay), (bx, by) = (places[end] for end in slot[1:])
            angle = math.degrees(math.atan2(by - ay, bx - ax))
            joints.append(MechanismJoint("RP", places[n], (slot[0], *sliding), angle))
        else:
            if _says(item, "slider") and slot is None:
                found.append(_left_out(f"connector {item.get('id')} slides between connectors that no link holds"))
            joints.append(MechanismJoint("R", places[n], (*([GROUND] if fixed else []), *here)))
        if item.get("slideradius"):
            found.append(_left_out(f"connector {item.get('id')} slides on an arc, which is written as a straight line"))
        if fixed and _says(item, "input"):
            turning |= dict.fromkeys(here, -_number(item, "rpm") * 360.0 / SECONDS)
    drawn = tuple(n for n, item in enumerate(connectors.values()) if _says(item, "draw") and joints[n].links)
    mechanism = Linkage2(
        tuple(joints), turning, tuple(actuators), tuple(_ratios(root, of_id, links, joints, found)), drawn
    )
    return mechanism, tuple(found)


def _root(source: SourceText) -> Element:
    if re.search(r"<!\s*(?:DOCTYPE|ENTITY)", source.text):
        raise _error(f"{source.path} defines entities, which no such file does")
    try:
        return fromstring(source.text)
    except (ParseError, ValueError) as problem:
        raise _error(f"{source.path} is no XML: {problem}") from problem


def _error(message: str) -> ScriptError:
    return ScriptError([Diagnostic("linkage2/syntax", Severity.ERROR, message)])


def _left_out(message: str) -> Diagnostic:
    return Diagnostic("linkage2/left-out", Severity.WARNING, f"{message}: this is left out")


def _says(item: Element, name: str) -> bool:
    return item.get(name, "").lower() == "true"


def _number(item: Element, name: str) -> float:
    try:
        value = float(item.get(name, "0"))
    except ValueError:
        value = math.nan
    if not abs(value) < 1e150:
        raise _error(f"`{name}` of {item.tag} {item.get('id')} is not a number: {item.get(name)}")
    return value


def _link_name(item: Element, taken: dict[str, list[int]]) -> str:
    """The name that its author gave it, or its number in the file."""
    name = item.get("name") or f"Link{item.get('id', len(taken))}"
    return name if name not in taken and name != GROUND else f"Link{item.get('id', len(taken))}_{len(taken)}"


def _slot(
    item: Element, number: dict[str, int], links: dict[str, list[int]], connectors: dict[str, Element]
) -> tuple[str, int, int] | None:
    """The link along which a connector slides, and the ends of the slot."""
    limits = [limit.get("id", "") for limit in item.findall("slidelimit")]
    if len(limits) != 2 or any(name not in number for name in limits):
        return None
    a, b = (number[name] for name in limits)
    if all(_says(connectors[name], "anchor") for name in limits):
        return GROUND, a, b
    return next(((link, a, b) for link, members in links.items() if a in members and b in members), None)


def _ratios(
    root: Element,
    of_id: dict[str, str],
    links: dict[str, list[int]],
    joints: Sequence[MechanismJoint],
    found: list[Diagnostic],
) -> Iterator[tuple[str, str, float, str]]:
    for ratio in root.iterfind("ratios/ratio"):
        pair = [(of_id.get(item.get("id", "")), _number(item, "size")) for item in ratio.findall("link")]
        named = [(name, size) for name, size in pair if name is not None and size > 0.0 and links[name]]
        if len(named) != 2:
            found.append(_left_out("a ratio does not say two gears with their sizes"))
            continue
        (first, size), (second, other) = named
        centres = [set(joints[links[name][0]].links) - {first, second} for name in (first, second)]
        arms = centres[0] & centres[1]
        if not arms:
            found.append(_left_out(f"nothing holds the centres of the gears `{first}` and `{second}` together"))
            continue
        sign = 1.0 if ratio.get("type") == "chain" else -1.0
        yield first, second, sign * size / other, GROUND if GROUND in arms else min(arms)


def linkage2_script(mechanism: Linkage2, title: str) -> str:
    """A script that states the mechanism, with its inputs, actuators and ratios."""
    joints = mechanism.joints
    names = link_names(joints)

    def anchor(n: int) -> str:
        link = next((link for link in joints[n].links if link != GROUND), None)
        return f"Ground{n}.P{n}" if link is None else f"{names[link]}.P{n}"

    def against(link: str, arm: str) -> str:
        return f"{names[link]}.angle" if arm == GROUND else f"({names[link]}.angle - {names[arm]}.angle)"

    held = {n for a, b, _, _ in mechanism.actuators for n in (a, b)} & {
        n for n, joint in enumerate(joints) if not set(joint.links) - {GROUND}
    }
    more = [f"{anchor(n)} = {point_text(joints[n].place)};" for n in sorted(held)]
    more += [f"{names[link]}.angle = {float_text(rate)}*.t;" for link, rate in mechanism.turning.items()]
    for a, b, stroke, rate in mechanism.actuators:
        length = float_text(math.dist(joints[a].place, joints[b].place))
        swing = f"(1 - .abs(1 - .mod({float_text(2.0 * rate)}*.t, 2)))"
        sign = "-" if stroke < 0.0 else "+"
        more.append(f"({anchor(b)} - {anchor(a)}).l = {length} {sign} {float_text(abs(stroke))}*{swing};")
    for first, second, ratio, arm in mechanism.ratios:
        more.append(f"{against(second, arm)} = {float_text(ratio)}*{against(first, arm)};")
    drawn = [f"Cylinder{n} : .cylinder {anchor(a)} {anchor(b)};" for n, (a, b, _, _) in enumerate(mechanism.actuators)]
    drawn += [f"Path{n} : .trace {anchor(n)} .whole;" for n in mechanism.drawn]
    text = mechanism_script(joints, (), title, more)
    if drawn:
        text = text.replace("\n\n@0\n", "\n".join(["", "", *drawn, "", "@0", ""]), 1)
    rates = [abs(rate) / 360.0 for rate in mechanism.turning.values()] + [a[3] for a in mechanism.actuators]
    slowest = min((rate for rate in rates if rate > 0.0), default=0.0)
    return text + (f"@{float_text(round(min(1.0 / slowest, LONGEST), 6))}\n" if slowest else "")
