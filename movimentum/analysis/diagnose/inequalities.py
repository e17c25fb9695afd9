"""Proposes inequalities that select one of several solutions, ready to paste.

A useful inequality must hold throughout the motion that it selects. So each candidate solution is followed through its
segment first. An inequality is offered only if it always holds for that solution, and fails for every other one at the
beginning.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions.arrays import atan2d
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.model import Scene, ThingAngle, VariableComponent
from movimentum.scene.names import symbol_name
from movimentum.solver.block.closed_form import State
from movimentum.solver.path.follow import follow_path
from movimentum.solver.pose_assembly import placements
from movimentum.solver.segment_motion import PathBeginning, SegmentMotion
from movimentum.solver.start.candidates import Candidate, Part, Selection
from movimentum.tolerances import CLEARLY_FARTHER, SEEN_APART, STANDS_STILL

MOST_CANDIDATES = 6
LARGE_NUMBER = 1000
MOST_WORDS = 4
CLEARANCE = 0.01
"""How far from equality, in units of the scene's size (or radians), an inequality must stay to be offered."""


@dataclass(frozen=True, slots=True, eq=False)
class CandidateMotion:
    """One candidate's motion through its segment: anchor positions (K, 2) by (thing, anchor), and variables (K,)."""

    anchors: dict[tuple[int, int], FloatArray]
    variables: dict[str, FloatArray]

    def without(self, names: Sequence[str]) -> CandidateMotion:
        """Without some variables."""
        return CandidateMotion(self.anchors, {name: v for name, v in self.variables.items() if name not in names})


@dataclass(frozen=True, slots=True)
class _InequalityOption:
    """``text`` > threshold selects where ``values`` (one array (K,) for each candidate) are on its side; ``rank``:
    preference.
    """

    left: str
    right: str
    values: tuple[FloatArray, ...]
    rank: int


def follow_candidates(segment_motion: SegmentMotion, beginning: PathBeginning, part: Part) -> list[CandidateMotion]:
    """The first few candidates of ``part``, followed through the segment (everything else as chosen)."""
    plan = segment_motion.plan
    selection: Selection = beginning.selection
    length = float(segment_motion.segment.end - segment_motion.segment.start)
    result: list[CandidateMotion] = []
    most = MOST_CANDIDATES if len(plan.blocks) < LARGE_NUMBER else 2  # following a very large scene takes a while
    for candidate in part.candidates[:most]:
        choices = [candidate.choices.get(number, choice) for number, choice in enumerate(selection.choices or [])]
        piece, gaps = follow_path(plan, segment_motion.segment.start, beginning.time, length, choices)
        horizon = min((gap.begin for gap in gaps), default=piece.end)
        nodes = piece.nodes[piece.nodes <= horizon]
        nodes = nodes if len(nodes) else piece.nodes[:1]
        with np.errstate(all="ignore"):
            state, _ = piece.evaluate(piece.instants(nodes))
        result.append(_candidate_motion(plan, segment_motion, part, state, len(nodes)))
    return result


def _candidate_motion(
    plan: Plan, segment_motion: SegmentMotion, part: Part, state: State, count: int
) -> CandidateMotion:
    scene = plan.system.scene
    inside = {n for number in part.blocks for n in plan.blocks[number].unknowns}
    things = {plan.system.unknowns[n].thing for n in inside}
    anchors: dict[tuple[int, int], FloatArray] = {}
    for t, placement in placements(plan, state, segment_motion.base.now):
        if t in things:
            for i, anchor in enumerate(scene.things[t].anchors):
                x, y = anchor.local
                points = np.empty((count, 2))
                points[:, 0] = placement.x + (placement.c * x - placement.s * y)
                points[:, 1] = placement.y + (placement.s * x + placement.c * y)
                anchors[t, i] = points
    variables = {
        unknown.name: np.array(np.broadcast_to(state[unknown.number], count), dtype=np.float64)
        for unknown in plan.system.unknowns
        if unknown.number in inside and isinstance(unknown.payload, VariableComponent)
    }
    return CandidateMotion(anchors, variables)


def candidate_at(plan: Plan, segment_motion: SegmentMotion, part: Part, state: State) -> CandidateMotion:
    """A candidate at one instant only."""
    return _candidate_motion(plan, segment_motion, part, state, 1)


def selecting_inequalities(plan: Plan, followed: list[CandidateMotion]) -> list[str | None]:
    """For each followed candidate an inequality (or two) that selects it among the others; None: none was found."""
    options = _options(plan, followed)
    return [_best(plan, options, index, len(followed)) for index in range(len(followed))]


def _options(plan: Plan, followed: list[CandidateMotion]) -> list[_InequalityOption]:
    scene = plan.system.scene
    options: list[_InequalityOption] = []

    def name(key: tuple[int, int]) -> str:
        return f"{scene.things[key[0]].name}.{scene.things[key[0]].anchors[key[1]].name}"

    keys = sorted(followed[0].anchors)
    for (t, i), (u, j) in _pairs(keys):
        if t == u:  # two anchors of one thing: which way it points
            for axis in (0, 1):
                values = tuple(f.anchors[t, i][:, axis] - f.anchors[u, j][:, axis] for f in followed)
                options.append(
                    _InequalityOption(f"{name((t, i))}.{'xy'[axis]}", f"{name((u, j))}.{'xy'[axis]}", values, 1)
                )
    for left, joint, right in _dyads(scene, followed[0]):  # on which side a joint lies
        values = tuple(
            np.radians(_angle(f.anchors[left] - f.anchors[joint[0]], f.anchors[right] - f.anchors[joint[1]]))
            * plan.size
            for f in followed
        )
        text = f".a({name(left)} - {name(joint[0])}, {name(right)} - {name(joint[1])})"
        options.append(_InequalityOption(text, "0", values, 0))
    for variable in sorted(followed[0].variables):
        options.extend(_against_number(variable, [f.variables[variable] for f in followed], 1))
    for key in keys:
        for axis in (0, 1):
            options.extend(_against_number(f"{name(key)}.{'xy'[axis]}", [f.anchors[key][:, axis] for f in followed], 2))
    return options


def _pairs(keys: list[tuple[int, int]]) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    return [(a, b) for k, a in enumerate(keys[:40]) for b in keys[k + 1 : 40] if a[0] == b[0]]


def _angle(u: FloatArray, v: FloatArray) -> FloatArray:
    return atan2d(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], u[:, 0] * v[:, 0] + u[:, 1] * v[:, 1])


Key = tuple[int, int]


def _dyads(scene: Scene, first: CandidateMotion) -> list[tuple[Key, tuple[Key, Key], Key]]:
    """Pairs of things that share a joint (two anchors at one place all along), each with another anchor: (left, (joint,
    joint), right).
    """
    keys = sorted(first.anchors)[:40]
    result: list[tuple[Key, tuple[Key, Key], Key]] = []
    for k, a in enumerate(keys):
        for b in keys[k + 1 :]:
            if a[0] == b[0] or np.max(np.abs(first.anchors[a] - first.anchors[b])) > SEEN_APART * (
                1 + np.max(np.abs(first.anchors[a]))
            ):
                continue
            left = next(((a[0], i) for i in range(len(scene.things[a[0]].anchors)) if (a[0], i) != a), None)
            right = next(((b[0], i) for i in range(len(scene.things[b[0]].anchors)) if (b[0], i) != b), None)
            if left is not None and right is not None:
                result.append((left, (a, b), right))
    return result


def _against_number(text: str, values: list[FloatArray], rank: int) -> list[_InequalityOption]:
    """Comparisons of a coordinate with a round number between the candidates."""
    begins = sorted(float(v[0]) for v in values)
    options: list[_InequalityOption] = []
    for low, high in pairwise(begins):
        if high - low > STANDS_STILL * (1 + abs(high)):
            number = _round_between(low, high)
            options.append(_InequalityOption(text, f"{number:g}", tuple(v - number for v in values), rank))
    return options


def _round_between(low: float, high: float) -> float:
    """The roundest number in the middle half of an interval."""
    middle, quarter = 0.5 * (low + high), 0.25 * (high - low)
    for digits in range(-8, 12):
        number = round(middle, digits)
        if abs(number - middle) <= quarter:
            return number + 0.0
    return middle


def _best(plan: Plan, options: list[_InequalityOption], index: int, count: int) -> str | None:
    single: list[tuple[tuple[int, float], str]] = []
    partial: list[tuple[frozenset[int], tuple[int, float], str]] = []
    for option in options:
        for sign, relation in ((1.0, ">"), (-1.0, "<")):
            mine = float(np.min(sign * option.values[index])) / plan.size
            if not mine > CLEARANCE:
                continue
            excluded = frozenset(
                other
                for other in range(count)
                if other != index and sign * float(option.values[other][0]) / plan.size < -CLEARANCE
            )
            if not excluded:
                continue
            worst = min(-sign * float(option.values[other][0]) / plan.size for other in excluded)
            rank = (option.rank, -min(mine, worst))
            text = f"{option.left} {relation} {option.right};"
            if len(excluded) == count - 1:
                single.append((rank, text))
            partial.append((excluded, rank, text))
    if single:
        return min(single)[1]
    everyone = frozenset(range(count)) - {index}
    pairs = [
        ((a[1], b[1]), f"{a[2]} {b[2]}")
        for k, a in enumerate(partial[:60])
        for b in partial[k + 1 : 60]
        if a[0] | b[0] == everyone
    ]
    return min(pairs)[1] if pairs else None


def selecting_wish(plan: Plan, part: Part, index: int, without: Sequence[str] = ()) -> str | None:
    """A wish that selects candidate ``index`` if no inequality stays true (a crank turns through all angles).

    It is about the angle or the variable in which the candidate differs most from the nearest other one; None if there
    is none.
    """
    best: tuple[float, str] | None = None
    mine = part.candidates[index].values
    for n, value in sorted(mine.items()):
        payload = plan.system.unknowns[n].payload
        if not isinstance(payload, ThingAngle | VariableComponent) or plan.system.unknowns[n].name in without:
            continue
        scale = 57.0 if isinstance(payload, ThingAngle) else plan.size
        others = [other.values[n] for k, other in enumerate(part.candidates) if k != index]
        apart = min(abs(value - other) for other in others) / scale
        if apart > CLEARANCE and (best is None or apart > best[0] * (1.0 + CLEARLY_FARTHER)):
            rounded = round(value, max(0, 2 - int(np.floor(np.log10(scale * apart)))))
            best = apart, f"{symbol_name(plan.system.scene, payload)} ~ {rounded + 0.0:g};"
    return None if best is None else best[1]


def described(
    plan: Plan, candidates: Sequence[Candidate], followed: Sequence[CandidateMotion], without: Sequence[str] = ()
) -> list[str]:
    """Candidates in a few words each: what differs between them, the largest difference first, ``without`` some
    variables.

    ``followed`` has each candidate's anchors where it begins. A thing is described by its turn, or by the place of an
    anchor if all candidates turn it alike.
    """
    items = sorted(_differences(plan, candidates, followed, without), key=lambda item: -item[0])
    differences = [words for apart, words in items if apart > SEEN_APART]
    return [
        ", ".join(words[k] for words in differences[:MOST_WORDS]) + (", …" if len(differences) > MOST_WORDS else "")
        or "differs in what is not drawn"
        for k in range(len(candidates))
    ]


def _differences(
    plan: Plan, candidates: Sequence[Candidate], followed: Sequence[CandidateMotion], without: Sequence[str]
) -> Iterator[tuple[float, list[str]]]:
    """For each thing and each variable: how far apart the candidates are (of the scene's size, rounded so that equal
    differences keep their order), and its value in each of them.
    """
    scene = plan.system.scene
    unknowns = plan.system.unknowns
    angle_of = {p.thing: n for n in candidates[0].values if isinstance(p := unknowns[n].payload, ThingAngle)}
    of_thing: dict[int, list[int]] = {}
    for t, i in sorted(followed[0].anchors):
        of_thing.setdefault(t, []).append(i)
    for t, anchors in of_thing.items():
        body = scene.things[t]
        turns = [_turn(plan, t, candidate.values) or 0.0 for candidate in candidates]
        if t in angle_of:
            turns = [candidate.values[angle_of[t]] for candidate in candidates]
        apart = _spread([np.array([np.cos(np.radians(a)), np.sin(np.radians(a))]) for a in turns])
        if apart > SEEN_APART:
            yield apart, [f"`{body.name}` turned {round(a, 2) + 0.0:g} degrees" for a in turns]
            continue
        points = [np.array([f.anchors[t, anchors[0]][0]]).ravel() for f in followed]
        yield (
            _spread([point / plan.size for point in points]),
            [f"`{body.name}.{body.anchors[anchors[0]].name}` at [{x:.6g}, {y:.6g}]" for x, y in points],
        )
    for n in sorted(candidates[0].values):
        if isinstance(unknowns[n].payload, VariableComponent) and unknowns[n].name not in without:
            values = [candidate.values[n] for candidate in candidates]
            yield (
                _spread([np.array([value / plan.size]) for value in values]),
                [f"{unknowns[n].name} = {value:.6g}" for value in values],
            )


def _turn(plan: Plan, thing: int, values: dict[int, float]) -> float | None:
    """How far a thing is turned in a candidate: degrees in (-180, 180]; None where the candidate does not say."""
    system = plan.system
    known = [values.get(system.number_of.get(part(thing), -1)) for part in (PoseCos, PoseSin)]
    if known[0] is None or known[1] is None:
        return None
    c, s = system.frame(thing).to_thing(known[0], known[1])
    return float(np.degrees(np.arctan2(s, c)))


def _spread(values: Sequence[FloatArray]) -> float:
    """How far apart values are at the most, to two digits."""
    stacked = np.array(values)
    apart = float(np.max(np.max(stacked, axis=0) - np.min(stacked, axis=0), initial=0.0))
    return float(f"{apart:.1e}")
