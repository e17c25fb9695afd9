"""Blocks of a plan enclosed over intervals of time: Krawczyk's operator on the equations as they were stated.

For equations F(x, v, t) = 0 with the inputs v(t) already enclosed, near an approximate path y(t): if Y is any matrix,
F' is enclosed on the tube X = y + [-r, r], and K = -Y F(y) + (I - Y F'(X)) [-r, r] lies inside [-r, r], then for each
t there is exactly one solution in X(t), it lies in y + K, and it moves continuously with t. (Krawczyk 1969; Moore 1977;
Rump 1983; see also Neumaier 1990, *Interval Methods for Systems of Equations*, 5.1.) All intervals are handled at once.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.certifying.forms import Forms, TimeForm, nothing, spread, up
from movimentum.certifying.krawczyk import krawczyk, stacked
from movimentum.certifying.nearest import OutlineForms
from movimentum.expressions import ZERO, Expr, add
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.blocks.velocities import BlockRows, rows_of
from movimentum.planning.lowering.calculus import closed_form
from movimentum.planning.lowering.unknowns import PosePart, unknown_number
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field, replace
from movimentum.scene.model import ThingAngle
from movimentum.solver.arithmetic.evaluation import Evaluator, ordered_nodes
from movimentum.solver.block.formulas import UnknownFormulas
from movimentum.solver.block.problem import scale_of
from movimentum.solver.path.piece import Piece, evaluate_piece
from movimentum.tolerances import INDEPENDENT_EQUATIONS, JUMP_IN_TUBE, ROOM_AT_INSTANT, ROOM_IN_TUBE, UNIT_ROUNDOFF

TRIES = 4
"""How often a tube is made wider before it is cut into two."""
CHOICES = 4
"""How many choices of independent equations are tried where there are more than unknowns."""
ENTRIES = 4_000_000
"""Numbers that a matrix of all intervals may have at a time."""
BESIDE = 90.0
"""Degrees: no other turn of a continuous angle is so near."""


@dataclass(slots=True, eq=False)
class Tubes:
    """Intervals of time [``begin``, ``end``] (N,), offsets from the segment's start, and what is enclosed over them.

    ``forms``: the enclosure of each unknown; ``region`` (N,): within how much of its ``c`` + ``s`` u there is no other
    solution. ``failed`` (N,): the number of the first block that could not be enclosed, else -1; ``jumps``: whether
    it is because what is stated jumps.
    """

    begin: FloatArray
    end: FloatArray
    failed: FloatArray
    jumps: BoolArray
    forms: dict[int, TimeForm] = field(default_factory=dict[int, TimeForm])
    region: dict[int, FloatArray] = field(default_factory=dict[int, FloatArray])

    @property
    def good(self) -> BoolArray:
        """Which intervals are enclosed."""
        return self.failed < 0

    def chosen(self, which: BoolArray) -> Tubes:
        """Some of the intervals."""
        every = np.ones(len(self.begin))
        forms = {n: spread(form, len(every))[which] for n, form in self.forms.items()}
        region = {n: (every * radius)[which] for n, radius in self.region.items()}
        return Tubes(self.begin[which], self.end[which], self.failed[which], self.jumps[which], forms, region)


def joined(parts: Sequence[Tubes]) -> Tubes:
    """All intervals of several, in the order of time."""
    order = np.argsort(np.concatenate([part.begin for part in parts]), kind="stable")

    def together(pick: Callable[[Tubes], Any]) -> Any:
        return np.concatenate([np.broadcast_to(pick(part), len(part.begin)) for part in parts])[order]

    forms = {
        n: TimeForm(*(together(lambda part, n=n, name=name: getattr(part.forms[n], name)) for name in ("c", "s", "r")))
        for n in parts[0].forms
    }
    region = {n: together(lambda part, n=n: part.region[n]) for n in parts[0].region}
    return Tubes(
        together(lambda part: part.begin),
        together(lambda part: part.end),
        together(lambda part: part.failed),
        together(lambda part: part.jumps),
        forms,
        region,
    )


@dataclass(slots=True, eq=False)
class Encloser:
    """Encloses the unknowns of a ``piece`` of a path over intervals of time. ``needed``: the numbers of the blocks that
    the poses depend on, in order; ``moving``: the unknowns of those that move.
    """

    piece: Piece
    begun: Mapping[Hashable, TimeForm] = field(default_factory=dict[Hashable, TimeForm])
    forms: Forms = field(default_factory=OutlineForms)
    evaluator: Evaluator = field(init=False)
    needed: tuple[int, ...] = field(init=False)
    moving: frozenset[int] = field(init=False)
    _still: dict[int, tuple[TimeForm, FloatArray]] = field(default_factory=dict[int, "tuple[TimeForm, FloatArray]"])
    _closed: dict[int, Expr | None] = field(default_factory=dict[int, "Expr | None"])
    _stuck: set[int] = field(default_factory=set[int])
    _rows: dict[tuple[int, float], BlockRows | None] = field(
        default_factory=dict[tuple[int, float], "BlockRows | None"]
    )

    def __post_init__(self) -> None:
        self.evaluator = Evaluator(self.forms)  # pyright: ignore[reportArgumentType] - numbers of its own

        plan = self.plan
        drawn = [n.number for n in plan.system.unknowns if isinstance(n.payload, PosePart | ThingAngle)]
        self.needed = plan.rate_blocks(drawn)
        self.moving = frozenset(
            n for number in self.needed if plan.blocks[number].moving for n in plan.blocks[number].unknowns
        )

    @property
    def plan(self) -> Plan:
        """The plan of the piece."""
        return self.piece.plan

    def enclosed(self, begin: FloatArray, end: FloatArray, only: Sequence[int] | None = None) -> Tubes:
        """The unknowns over intervals [``begin``, ``end``] (N,), or at instants where these are equal; of the blocks
        ``only`` (in order, with all that they depend on), or of the needed ones.
        """
        found = Tubes(begin, end, np.full(len(begin), -1.0), np.zeros(len(begin), dtype=np.bool_))
        numbers = self.needed if only is None else only
        guess = _guess(self.piece, begin, end, [n for k in numbers for n in self.plan.blocks[k].unknowns])
        with np.errstate(all="ignore"):
            for number in numbers:
                block = self.plan.blocks[number]
                if not block.moving:
                    self._take_still(block, found)
                    continue
                self._take(block, found, guess)
        return found

    def _take_still(self, block: Block, found: Tubes) -> None:
        if block.unknowns[0] not in self._still and block.number not in self._stuck:
            here = np.array([self.piece.begin])
            once = Tubes(here, here, np.full(1, -1.0), np.zeros(1, dtype=np.bool_))
            once.forms = {n: form for n, (form, _) in self._still.items()}
            once.region = {n: region for n, (_, region) in self._still.items()}
            self._take(block, once, _guess(self.piece, here, here, block.unknowns))
            for n in block.unknowns:
                self._still[n] = once.forms[n], once.region[n]
            if once.failed[0] >= 0:
                self._stuck.add(block.number)
        if block.number in self._stuck:
            found.failed[found.failed < 0] = block.number
        for n in block.unknowns:
            found.forms[n], found.region[n] = self._still[n]

    def _take(self, block: Block, found: Tubes, guess: Guess) -> None:
        """Enclose one block, given those before it."""
        heading = self.plan.heading(block)
        if heading is not None:
            good, jump = self._wind(block, heading, found, guess)
        elif block.continued:
            good, jump = self._accumulate(block, found)
        else:
            good, jump = self._solve(block, found, guess)
        if not self.moving.isdisjoint(block.unknowns):
            jumps = found.good & good & (jump > self.plan.size * JUMP_IN_TUBE) & (found.end > found.begin)
            found.jumps |= jumps
            good = good & ~jumps
        found.failed[~good & found.good] = block.number

    @property
    def known(self) -> set[int]:
        """The unknowns of the needed blocks."""
        return {n for number in self.needed for n in self.plan.blocks[number].unknowns}

    def rows(self, block: Block, at: float | None = None) -> BlockRows | None:
        """A block's equations as they were stated; of more than it has unknowns as many independent ones (``at`` an
        offset: others may be independent elsewhere); None where there are fewer. What the rest say follows from these,
        or no film would meet them.
        """
        at = 0.5 * (self.piece.begin + self.piece.end) if at is None else at
        rows = self.plan.stated_rows(block)
        if len(rows.residuals) <= len(rows.unknowns):
            return None if block.free else rows
        if (block.number, at) not in self._rows:
            self._rows[block.number, at] = self._independent(block, rows, at)
        return self._rows[block.number, at]

    def _independent(self, block: Block, rows: BlockRows, at: float) -> BlockRows | None:
        import scipy.linalg as library

        linalg: Any = library
        middle = np.array([at])
        state, _ = evaluate_piece(self.piece, self.piece.instants(middle))
        tubes = Tubes(middle, middle, np.full(1, -1.0), np.zeros(1, dtype=np.bool_))
        for n, value in enumerate(state):
            if value is not None:
                tubes.forms[n] = TimeForm(np.ravel(value)[:1], np.zeros(1), np.zeros(1))
        matrix = np.zeros((len(rows.residuals), len(rows.unknowns)))
        for (i, j), slope in zip(rows.entries, self.values(rows.slopes, tubes), strict=True):
            matrix[i, j] = slope.c[0] * scale_of(self.plan, rows.unknowns[j : j + 1])[0]
        matrix /= np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), UNIT_ROUNDOFF)
        factor = linalg.qr(matrix.T, mode="r", pivoting=True)
        pivots = np.abs(np.diag(factor[0]))
        if not np.isfinite(pivots).all() or pivots[-1] < INDEPENDENT_EQUATIONS * pivots[0]:
            return None
        kept = sorted(int(k) for k in factor[1][: len(rows.unknowns)])
        return rows_of(self.plan.system, replace(block, equations=tuple(block.equations[k] for k in kept)))

    def values(self, expressions: Sequence[Expr], found: Tubes) -> list[TimeForm]:
        """Expressions of enclosed unknowns."""
        self.forms.jump = 0.0  # of as many intervals as were evaluated before
        return self.evaluator.values(ordered_nodes(expressions), expressions, self._leaf(found, {}))

    def _leaf(
        self, found: Tubes, own: dict[int, TimeForm], part: BoolArray | None = None
    ) -> Callable[[Expr], TimeForm]:
        start = self.piece.segment_start

        def leaf(node: Expr) -> TimeForm:
            if node.op == "clock":
                form = time_form(found, start - node.start)
            else:
                n = unknown_number(node.payload)
                if n in own:
                    return own[n]
                form = found.forms[n]
            return form if part is None else form[part]

        return leaf

    def closed(self, block: Block) -> Expr | None:
        """What an integral has come to, as a formula of time; None where it has none."""
        if block.number not in self._closed:
            equation = self.plan.system.equations[block.equations[0]]
            start, unknowns = self.piece.segment_start, self.plan.system.unknowns

            def begun(n: int) -> Expr:
                value = self.begun.get(unknowns[n].payload)
                return ZERO if value is None else self.evaluator.given(value)

            assert equation.integrand is not None
            inside = UnknownFormulas(self.plan, start, begun).of_time(equation.integrand)
            found = None if inside is None else closed_form(inside, start)
            (n,) = block.unknowns
            self._closed[block.number] = None if found is None else add(begun(n), found)
        return self._closed[block.number]

    def _accumulate(self, block: Block, found: Tubes) -> tuple[BoolArray, FloatArray]:
        """An integral that is a formula of time."""
        (n,) = block.unknowns
        formula, count = self.closed(block), len(found.begin)
        if formula is None:
            found.forms[n], found.region[n] = nothing(count), np.zeros(count)
            return np.zeros(count, dtype=np.bool_), np.zeros(1)
        (value,) = self.values([formula], found)
        form = found.forms[n] = spread(value, count)
        found.region[n] = np.full(count, np.inf)  # there is no other value
        return np.isfinite(form.r), np.zeros(1)

    def _wind(self, block: Block, heading: Expr, found: Tubes, guess: Guess) -> tuple[BoolArray, FloatArray]:
        """A continuous angle: that direction of its vector which is near the film's."""
        (n,) = block.unknowns
        sine, cosine = heading.args
        y, x = self.values([sine, cosine], found)
        near = TimeForm(guess.c[n], guess.s[n], np.zeros(1))
        form = spread(self.forms.direction_near(y, x, near), len(found.begin))
        found.forms[n], found.region[n] = form, np.full(len(form.r), BESIDE)
        return np.isfinite(form.r) & (form.r < BESIDE), np.zeros(1)

    def _solve(self, block: Block, found: Tubes, guess: Guess) -> tuple[BoolArray, FloatArray]:
        """Where Krawczyk's operator finds a solution, (N,), and how far the equations may jump."""
        unknowns, count, order = block.unknowns, len(found.begin), len(block.unknowns)
        c, s, bend = (np.stack([part[n] for n in unknowns], axis=-1) for part in (guess.c, guess.s, guess.bend))
        room = ROOM_AT_INSTANT if (found.begin == found.end).all() else ROOM_IN_TUBE
        room = room * np.maximum(scale_of(self.plan, unknowns), np.abs(c))
        r, region = np.full_like(c, np.inf), np.zeros_like(c)
        good, jump = np.zeros(count, dtype=np.bool_), np.zeros(count)
        step = max(1, ENTRIES // (order * order))
        rows = self.rows(block)
        for _ in range(CHOICES):
            for first in range(0, 0 if rows is None else count, step):
                part = found.good & ~good & (np.arange(count) // step == first // step)
                if rows is not None and part.any():
                    own: dict[int, TimeForm] = {}
                    leaf = self._leaf(found, own, None if part.all() else part)
                    one = self._contracted(rows, leaf, own, c[part], s[part], bend[part], room[part])
                    r[part], region[part], good[part], jump[part] = one
            failed = np.flatnonzero(found.good & ~good)
            if rows is None or not len(failed) or len(self.plan.stated_rows(block).residuals) == order:
                break
            k = failed[len(failed) // 2]
            rows = self.rows(block, float(0.5 * (found.begin[k] + found.end[k]))) or rows
        for j, n in enumerate(unknowns):
            found.forms[n], found.region[n] = TimeForm(c[:, j], s[:, j], r[:, j]), region[:, j]
        return good, jump

    def _contracted(
        self,
        rows: BlockRows,
        leaf: Callable[[Expr], TimeForm],
        own: dict[int, TimeForm],
        c: FloatArray,
        s: FloatArray,
        bend: FloatArray,
        room: FloatArray,
    ) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
        """(N, n) radii of the solution and of the tube in which it is the only one, (N,) whether there is one, and how
        far the equations may jump.
        """
        still = np.zeros(1)
        own.update({n: TimeForm(c[:, j], s[:, j], still) for j, n in enumerate(rows.unknowns)})
        self.forms.jump = 0.0
        f = stacked(self.evaluator.values(rows.nodes, rows.residuals, leaf), len(c))
        jump = np.broadcast_to(self.forms.jump, len(c))
        region = 1.5 * bend + room
        radius, good = np.full_like(region, np.inf), np.zeros(len(c), dtype=np.bool_)
        for _ in range(TRIES):
            own.update({n: TimeForm(c[:, j], s[:, j], region[:, j]) for j, n in enumerate(rows.unknowns)})
            slopes = stacked(self.evaluator.values(rows.slope_nodes, rows.slopes, leaf), len(c))
            found = krawczyk(f, slopes, rows.entries, region)
            inside = (found < region).all(axis=1)
            radius = np.where((inside & ~good)[:, None], found, radius)
            good |= inside
            wider = ~good & np.isfinite(found).all(axis=1)
            if not wider.any():
                break
            region = np.where(wider[:, None], 1.25 * found + room, region)
        return radius, region, good, jump


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """The film's own path as chords ``c`` + ``s`` u, by unknown, and how far it ``bend``s away from them, about."""

    c: dict[int, FloatArray]
    s: dict[int, FloatArray]
    bend: dict[int, FloatArray]


def _guess(piece: Piece, begin: FloatArray, end: FloatArray, unknowns: Iterable[int]) -> Guess:
    count = len(begin)
    with np.errstate(all="ignore"):
        state, _ = evaluate_piece(piece, piece.instants(np.concatenate([begin, 0.5 * (begin + end), end])))
    found = Guess({}, {}, {})
    for n in unknowns:
        value = state[n]
        values = np.full(3 * count, np.nan) if value is None else np.broadcast_to(value, 3 * count)
        first, middle, last = values[:count], values[count : 2 * count], values[2 * count :]
        off = 0.5 * (middle - 0.5 * (first + last))
        found.c[n], found.s[n], found.bend[n] = middle - off, 0.5 * (last - first), np.abs(off)
    return found


def time_form(tubes: Tubes, offset: Fraction) -> TimeForm:
    """What a clock reads that shows ``offset`` at the segment's start; the intervals' times to within their rounding,
    so that an instant may also be the exact time of a frame.
    """
    shown = float(offset)
    middle, half = 0.5 * (tubes.begin + tubes.end), 0.5 * (tubes.end - tubes.begin)
    off = 8.0 * UNIT_ROUNDOFF * (np.abs(tubes.begin) + np.abs(tubes.end) + abs(shown))
    return TimeForm(shown + middle, half, up(off))
