"""Text files of PMKS, the planar mechanism kinematic simulator, as joints and gears of a mechanism.

A line is a joint: the links that it connects, its type, x, y, the angle of a slot in degrees, and four flags (``tfff``,
``+---`` or words). The last flag says that the joint is driven: ``ground,input,R,100,100,0,tfft``. Commas and spaces
separate. R is a pin through all its links; P and RP are a slot in the first link, in which the second slides (P) or
slides and turns (RP); G is the point at which the pitch circles of two links touch. A link whose name begins with
``ground``, ``grnd``, ``grd`` or ``gnd`` is the frame. Other lines (``mech=``, ``name=…``) are settings, and ignored.

Source: the examples of the program (https://github.com/DesignEngrLab/PMKS).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError, error_at
from movimentum.interop.mechanisms import GROUND, TURN, MechanismJoint, link_names, mechanism_script
from movimentum.records import dataclass
from movimentum.source import SourceText, Span
from movimentum.syntax.printer import float_text

_GROUND = re.compile(r"(?:ground|grnd|grd|gnd)\w*", re.IGNORECASE)
_SETTING = re.compile(r"\s*\w*\s*=")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_KINDS = ("R", "P", "RP", "G")


@dataclass(frozen=True, slots=True)
class PmksMechanism:
    """``joints``, without the gears' contacts; ``contacts``: two links and the place where their pitch circles touch;
    ``driven``: the number of the joint that is driven, None if no joint can be.
    """

    joints: tuple[MechanismJoint, ...]
    contacts: tuple[tuple[str, str, tuple[float, float], Span], ...]
    driven: int | None


def joint_words(line: str) -> tuple[list[str], int] | None:
    """The words of a line, and the place of the joint's type among them; None if the line is no joint."""
    words = [word for word in re.split(r"[,\s]+", line.strip()) if word]
    place = max((k for k, word in enumerate(words) if word.upper() in _KINDS), default=0)
    numbers = words[place + 1 : place + 3]
    good = place > 0 and len(numbers) == 2 and all(_NUMBER.fullmatch(word) for word in numbers)
    return (words, place) if good else None


def read_pmks(source: SourceText) -> PmksMechanism:
    """The mechanism of a file; raises `ScriptError` for a line that is neither a joint nor a setting."""
    joints: list[MechanismJoint] = []
    contacts: list[tuple[str, str, tuple[float, float], Span]] = []
    flagged: int | None = None
    offset = 0
    for line in source.text.splitlines(keepends=True):
        span = Span(offset, offset + len(line.rstrip()))
        offset += len(line)
        if not line.strip() or _SETTING.match(line):
            continue
        found = joint_words(line)
        if found is None:
            raise error_at("pmks/joint", "this is not a joint", span, "ground,input,R,100,100")
        words, place = found
        links = tuple(dict.fromkeys(GROUND if _GROUND.fullmatch(word) else word for word in words[:place]))
        kind = words[place].upper()
        x, y, *rest = (float(word) for word in words[place + 1 : place + 4] if _NUMBER.fullmatch(word))
        if max(abs(x), abs(y), *map(abs, rest)) >= 1e150:
            raise error_at("pmks/joint", "a number is too large", span)
        if kind != "R" and len(links) != 2:
            raise error_at("pmks/joint", f"a {kind} joint connects two links, and here are {len(links)}", span)
        if kind == "G":
            contacts.append((links[0], links[1], (x, y), span))
            continue
        if _is_driven(words[place + 3 + len(rest) :]):
            flagged = len(joints)
        joints.append(MechanismJoint(kind, (x, y), links, rest[0] if rest and kind != "R" else 0.0))
    if not joints:
        raise ScriptError([Diagnostic("pmks/empty", Severity.ERROR, f"{source.path} has no joint")])
    usual = (n for n, joint in enumerate(joints) if joint.kind in ("R", "P") and len(joint.links) > 1)
    return PmksMechanism(tuple(joints), tuple(contacts), flagged if flagged is not None else next(usual, None))


def _is_driven(flags: Sequence[str]) -> bool:
    if len(flags) == 1:
        return len(flags[0]) >= 4 and flags[0][3] in "t+"
    return len(flags) >= 4 and flags[3].lower() == "true"


def pmks_script(mechanism: PmksMechanism, title: str) -> tuple[str, tuple[Diagnostic, ...]]:
    """A script that states the mechanism, with its driven joint, and a warning for what it cannot drive."""
    joints, driven = mechanism.joints, mechanism.driven
    names = link_names(joints)
    found: list[Diagnostic] = []
    rolling = [_rolling(joints, contact, names) for contact in mechanism.contacts]
    pushed: list[tuple[int, int]] = []
    if driven is not None:
        joint = joints[driven]
        moving = [link for link in joint.links if link != GROUND]
        if not moving:
            found.append(Diagnostic("pmks/drive", Severity.WARNING, f"joint {driven} is driven, and holds no link"))
        elif GROUND not in joint.links:
            message = f"joint {driven} is driven between two links that move: no drive is written"
            found.append(Diagnostic("pmks/drive", Severity.WARNING, message, helps=(f"{names[moving[0]]}.angle = …",)))
        elif joint.kind == "P":
            pushed.append((driven, driven))
        else:
            rolling += [f"{names[moving[0]]}.angle = {TURN}*.t;  // joint {driven} is driven"]
    text = mechanism_script(joints, pushed, title, rolling)
    if driven is not None and not pushed and not found:
        text += f"@{360 // TURN}\n"
    return text, tuple(found)


def _rolling(
    joints: Sequence[MechanismJoint], contact: tuple[str, str, tuple[float, float], Span], names: dict[str, str]
) -> str:
    """The equation of two links whose pitch circles roll on each other, about centres that one link (the arm) holds."""
    first, second, place, span = contact
    for one in joints:
        for two in joints:
            arms = set(one.links) & set(two.links) - {first, second} if one is not two else set[str]()
            centred = {one.kind, two.kind} == {"R"} and one.place != two.place
            if arms and centred and _about(one, first, arms) and _about(two, second, arms):
                arm = GROUND if GROUND in arms else sorted(arms)[0]
                return _ratio(names, (first, second, arm), (one.place, two.place, place))
    for link, other in ((first, second), (second, first)):
        if link == GROUND:  # a ring that stands still: its centre is where the arm of the other turns
            held = [(one, two) for one in joints for two in joints if other in two.links and one is not two]
            for one, two in held:
                arms = set(one.links) & set(two.links) - {GROUND, other}
                if GROUND in one.links and arms and {one.kind, two.kind} == {"R"}:
                    return _ratio(names, (other, GROUND, sorted(arms)[0]), (two.place, one.place, place))
    message = f"nothing holds the centres of `{first}` and `{second}` at a distance, so their circles are unknown"
    raise error_at("pmks/gear", message, span, "give both a pin (R) on one other link")


def _about(joint: MechanismJoint, link: str, arms: set[str]) -> bool:
    return link in joint.links and bool(arms & set(joint.links))


def _ratio(names: dict[str, str], links: tuple[str, str, str], places: tuple[tuple[float, float], ...]) -> str:
    """``second`` turns against the arm as the radii say: the other way round where the circles touch from outside."""
    (ax, ay), (bx, by), (px, py) = places
    first, second, arm = links
    inside = (px - ax) * (px - bx) + (py - ay) * (py - by) > 0.0
    r1, r2 = math.hypot(px - ax, py - ay), math.hypot(px - bx, py - by)
    sign = "" if inside else "-"
    turned = [_against(names, link, arm) for link in (second, first)]
    return f"{float_text(r2)}*{turned[0]} = {sign}{float_text(r1)}*{turned[1]};  // pitch circles roll"


def _against(names: dict[str, str], link: str, arm: str) -> str:
    """How far a link has turned against the arm."""
    if arm == GROUND:
        return f"{names[link]}.angle"
    return f"({names[link]}.angle - {names[arm]}.angle)" if link != GROUND else f"(-{names[arm]}.angle)"
