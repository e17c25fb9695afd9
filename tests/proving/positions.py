"""Other positions of a mechanism, found by following it with Newton's method: what no proof has a hand in.

From a pose of the film the planner's equations are followed in time, far beyond the film, and where one drive moves the
mechanism also without it, along the curve of all its positions. Steps are short, and end where the equations come near
to losing rank, so that no position lies on another branch. Each is refined to 60 digits before a claim is looked at.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import ClassVar

import numpy as np
from mpmath import mp, mpf

from movimentum.expressions import RADIANS, symbols
from movimentum.expressions import walk as below
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.proving.film import lowered, state_at
from movimentum.scene.model import Relation

DIGITS = 60
STEPS = 16
REFUTED = mpf(10) ** -25


class NoPosition(Exception):
    """A position cannot be followed or refined."""


def rational(value):
    """A rational number of mpmath's."""
    value = Fraction(value)
    return mpf(value.numerator) / value.denominator


class Near:
    """Operations on arrays of floats."""

    named: ClassVar = {
        "add": np.add, "mul": np.multiply, "div": np.divide, "neg": np.negative, "sqrt": np.sqrt, "abs": np.abs,
        "min": np.minimum, "max": np.maximum, "floor": np.floor, "exp": np.exp, "ln": np.log,
        "sind": lambda a: np.sin(np.radians(a)), "cosd": lambda a: np.cos(np.radians(a)),
        "tand": lambda a: np.tan(np.radians(a)), "asind": lambda a: np.degrees(np.arcsin(a)),
        "acosd": lambda a: np.degrees(np.arccos(a)), "atand": lambda a: np.degrees(np.arctan(a)),
        "atan2d": lambda a, b: np.degrees(np.arctan2(a, b)), "mod": np.mod,
        "ease": lambda u: np.clip(u, 0, 1) ** 2 * (3 - 2 * np.clip(u, 0, 1)),
        "le": lambda a, b, v, w: np.where(a <= b, v, w),
    }  # fmt: skip

    def constant(self, node):
        return node.value

    def start(self, node):
        return float(node.start)

    def of(self, node, args):
        if node.op == "pow":
            return np.power(args[0], node.payload)
        if node.op not in self.named:
            raise NoPosition(node.op)
        return self.named[node.op](*args)


class Exact:
    """Operations in mpmath; constants by what they were folded from."""

    named: ClassVar = {
        "add": lambda a, b: a + b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b, "neg": lambda a: -a,
        "sqrt": mp.sqrt, "abs": abs, "min": min, "max": max, "floor": mp.floor, "exp": mp.exp, "ln": mp.log,
        "sind": lambda a: mp.sin(a * mp.pi / 180), "cosd": lambda a: mp.cos(a * mp.pi / 180),
        "tand": lambda a: mp.tan(a * mp.pi / 180), "asind": lambda a: mp.asin(a) * 180 / mp.pi,
        "acosd": lambda a: mp.acos(a) * 180 / mp.pi, "atand": lambda a: mp.atan(a) * 180 / mp.pi,
        "atan2d": lambda a, b: mp.atan2(a, b) * 180 / mp.pi, "mod": lambda a, b: a - b * mp.floor(a / b),
        "ease": lambda u: min(max(u, mpf(0)), mpf(1)) ** 2 * (3 - 2 * min(max(u, mpf(0)), mpf(1))),
        "le": lambda a, b, v, w: v if a <= b else w,
    }  # fmt: skip

    def __init__(self):
        self.constants = {}

    def constant(self, node):
        found = self.constants.get(id(node))
        if found is None:
            if node.origin is not None:
                value = self.of(node.origin, [self.constant(each) for each in node.origin.args])
            elif node.value in (math.pi, RADIANS, 1 / RADIANS):
                value = {math.pi: mp.pi, RADIANS: mp.pi / 180, 1 / RADIANS: 180 / mp.pi}[node.value] + 0
            else:
                value = rational(repr(node.value))
            found = self.constants[id(node)] = node, value
        return found[1]

    def start(self, node):
        return rational(node.start)

    def of(self, node, args):
        if node.op == "pi":
            return mp.pi + 0
        if node.op == "rational":
            return rational(node.payload)
        if node.op == "pow":
            return args[0] ** rational(Fraction(node.payload).limit_denominator(1000))
        if node.op not in self.named:
            raise NoPosition(node.op)
        value = self.named[node.op](*args)
        if not isinstance(value, mpf) or not mp.isfinite(value):
            raise NoPosition("no finite real value")
        return value


def evaluated(numbers, nodes, state, time):
    """The value of every node, by identity."""
    found = {}
    for node in nodes:
        match node.op:
            case "const":
                value = numbers.constant(node)
            case "symbol":
                value = state[node.payload]
            case "clock":
                value = time - numbers.start(node)
            case _:
                value = numbers.of(node, [found[id(each)] for each in node.args])
        found[id(node)] = value
    return found


def _ordered(outputs):
    """Every node below, arguments first, each by identity: equal constants may come from different things."""
    seen, order, stack = set(), [], [(each, False) for each in outputs]
    while stack:
        node, done = stack.pop()
        if done:
            order.append(node)
        elif id(node) not in seen:
            seen.add(id(node))
            stack.append((node, True))
            stack.extend((each, False) for each in node.args)
    return order


class Positions:
    """A claim of a segment's ``motion``, followed from offset ``tau``."""

    def __init__(self, held, motion, tau):
        claim, plan = held.claim, motion.plan
        self.claim = claim
        self.sides = lowered(motion, [*claim.left, *claim.right])
        wanted, stack, blocks = set(), list(symbol_numbers(*self.sides)), set()
        while stack:
            n = stack.pop()
            owner = plan.owner.get(n)
            if owner is None:
                raise NoPosition("an unknown is not solved for")
            if owner not in blocks:
                blocks.add(owner)
                block = plan.blocks[owner]
                wanted.update(block.unknowns)
                for e in block.equations:
                    stack.extend(symbol_numbers(plan.system.equations[e].residual))
                stack.extend({*block.inputs, *block.unknowns})
        equations = [plan.system.equations[e] for k in sorted(blocks) for e in plan.blocks[k].equations]
        if any(each.form not in (Form.PLAIN, Form.WINDING) or each.residual.op == "integral" for each in equations):
            raise NoPosition("it is no closed form of the instant")
        if any(one.op in ("integral", "derivative", "reduction") for each in equations for one in below(each.residual)):
            raise NoPosition("it depends on what was")
        self.turning = np.array([each.form is Form.WINDING for each in equations])
        self.rows = [each.residual for each in equations]
        self.unknowns = sorted(wanted)
        self.place = {n: k for k, n in enumerate(self.unknowns)}
        state = state_at(motion, tau)
        self.x = np.array([state[n] for n in self.unknowns], dtype=np.float64)
        if not np.isfinite(self.x).all():
            raise NoPosition("the film has no value")
        self.time = float(motion.segment.start) + tau
        self.order = _ordered(self.rows)
        self.side_order = _ordered(self.sides)
        self.near, self.exact = Near(), Exact()
        self.size = np.maximum(np.abs(self.x), 1.0)

    def residual(self, numbers, x, time):
        """The rows; an angle is one modulo a turn. (n, k) floats ``x`` and (k,) times give (m, k)."""
        found = evaluated(numbers, self.order, {n: x[k] for n, k in self.place.items()}, time)
        rows = [found[id(row)] for row in self.rows]
        if numbers is self.near:
            rows = np.stack(np.broadcast_arrays(*rows))
            rows[self.turning] -= 360 * np.round(rows[self.turning] / 360)
            if not np.isfinite(rows).all():
                raise NoPosition("no finite value")
            return rows
        return [
            value - 360 * mp.floor(value / 360 + mpf(0.5)) if turning else value
            for value, turning in zip(rows, self.turning, strict=True)
        ]

    def slopes(self, x, time):
        """The rows, (m,), and their slopes, (m, n + 1): by the unknowns and by time."""
        n = len(x)
        h = np.append(self.size, 1.0) * 1e-6
        ends = np.tile(np.append(x, time)[:, None], 2 * n + 3)
        places = np.arange(n + 1)
        ends[places, places] += h
        ends[places, n + 1 + places] -= h
        rows = self.residual(self.near, ends[:-1], ends[-1])
        return rows[:, -1], (rows[:, : n + 1] - rows[:, n + 1 : -1]) / (2 * h)

    def ranked(self, jacobian):
        """Its pseudo-inverse, rank and smallest share of a singular value that counts."""
        rows = np.linalg.norm(jacobian, axis=1)
        rows[rows == 0] = 1.0
        scaled = jacobian / rows[:, None] * self.size[None, : jacobian.shape[1]]
        u, s, v = np.linalg.svd(scaled, full_matrices=False)
        share = s / s[0]
        rank = int((share > 1e-7).sum())
        inverse = (v[:rank].T / s[:rank]) @ u[:, :rank].T
        return inverse / rows[None, :] * self.size[: jacobian.shape[1], None], rank, float(share[rank - 1])

    def corrected(self, x, time, keep):
        """Newton's iteration for the rows that are ``keep``."""
        for _ in range(8):
            rows, slopes = self.slopes(x, time)
            inverse, rank, share = self.ranked(slopes[keep, :-1])
            step = inverse @ rows[keep]
            x = x - step
            if np.max(np.abs(step) / self.size) < 1e-11:
                return x, rank, share
        raise NoPosition("Newton's iteration does not end")

    def refined(self, x, time, keep):
        """To 60 digits, by the float slopes."""
        with mp.workdps(DIGITS):
            inverse, _, _ = self.ranked(self.slopes(x, float(time))[1][keep, :-1])
            exact = [mpf(float(value)) for value in x]
            for _ in range(14):
                r = [v for v, k in zip(self.residual(self.exact, exact, time), keep, strict=True) if k]
                largest = max(map(abs, r), default=mpf(0))
                if largest < mpf(10) ** (10 - DIGITS):
                    return exact
                step = inverse @ np.array([float(v / largest) for v in r])
                exact = [a - largest * mpf(float(b)) for a, b in zip(exact, step, strict=True)]
        raise NoPosition("it cannot be refined")

    def off(self, exact, time):
        """How far the sides are apart, positive where the claim fails; and the roots and turns in them."""
        with mp.workdps(DIGITS):
            known = evaluated(self.exact, self.side_order, {n: exact[k] for n, k in self.place.items()}, time)
            values = [known[id(side)] for side in self.sides]
            count = len(self.claim.left)
            a, b = values[:count], values[count:]
            match self.claim.relation:
                case Relation.BELOW:
                    return a[0] - b[0]
                case Relation.ABOVE:
                    return b[0] - a[0]
            apart = [abs(p - q) for p, q in zip(a, b, strict=True)]
            if self.claim.left[0].op == "atan2d":
                apart[0] = min(apart[0], abs(apart[0] - 360))
            return max(apart)

    def watched(self, x, time):
        """What must not change its sign: what roots are taken of in the claim (as signed as it can be told), and where
        directions are."""
        found = {}
        values = evaluated(self.near, self.side_order, {n: x[k] for n, k in self.place.items()}, time)
        for node in self.side_order:
            value = values[id(node)]
            if node.op in ("sqrt", "abs", "atan2d") and (symbols(node) or node.timed):
                found[id(node)] = node.op, value, node.op == "abs" and values[id(node.args[0])] < 0
        return found

    def walk(self, chance, *, freely, sides_kept, steps=STEPS, stride=None):
        """Refined positions with their times: ``freely`` without the timed rows, else in time. ``sides_kept``: end
        where a length of the claim is near 0 or a direction jumps.
        """
        keep = np.array([not (freely and row.timed) for row in self.rows])
        x, time = self.x.copy(), self.time
        x, rank, share = self.corrected(x, time, keep)
        least = min(share * 0.05, 1e-3)
        seen = self.watched(x, time)
        sizes = {key: abs(value) for key, (op, value, _) in seen.items() if op != "atan2d"}
        direction = None
        stride = stride or chance.choice((-1.0, 1.0)) * 10 ** chance.uniform(-2.0, -0.9)
        for k in range(steps):
            slopes = self.slopes(x, time)[1][keep]
            if freely:
                inverse, _, _ = self.ranked(slopes[:, :-1])
                if direction is None:
                    direction = np.array([chance.gauss(0, 1) for _ in x])
                scaled = slopes[:, :-1] * self.size[None, :]
                direction = direction - np.linalg.pinv(scaled, rcond=1e-7) @ (scaled @ direction)
                norm = float(np.linalg.norm(direction))
                if norm < 1e-9:
                    return
                direction = direction / norm
                guess, at = x + abs(stride) * direction * self.size, time
            else:
                inverse, _, _ = self.ranked(slopes[:, :-1])
                guess, at = x - inverse @ slopes[:, -1] * stride, time + stride
            found, new_rank, share = self.corrected(guess, at, keep)
            if new_rank != rank or share < least:
                return
            if np.max(np.abs(found - guess) / self.size) > 0.1 * (np.max(np.abs(guess - x) / self.size) + 1e-9):
                stride *= 0.3  # too long for a step that is surely on this branch
                if abs(stride) < 1e-6:
                    return
                continue
            x, time = found, at
            now = self.watched(x, time)
            for key, (op, value, side) in now.items():
                if op == "atan2d" and sides_kept and abs(value - seen[key][1]) > 90:
                    return
                change = abs(value - seen[key][1])
                if op != "atan2d" and sides_kept and (value < 4 * change + 1e-3 * sizes[key] or side != seen[key][2]):
                    return
            seen = now
            if k % 5 == 4:
                when = rational(time)
                yield self.refined(x, when, keep), when


def positions_off(held, motion, tau, chance, *, sides_kept=False):
    """How far off a claim is at other positions, as (amount, time) pairs; none where it cannot be told."""
    found = []
    try:
        start = Positions(held, motion, tau)
    except (NoPosition, Exception) as error:
        if not isinstance(error, NoPosition) and type(error).__name__ not in ("NotAlgebraic",):
            raise
        return found
    timed = [row for row in start.rows if row.timed]
    ways = [False]
    if len(timed) == 1 and not any(side.timed for side in start.sides):
        ways += [True]
    for freely in ways:
        try:
            for exact, time in start.walk(chance, freely=freely, sides_kept=sides_kept):
                found.append((start.off(exact, time), float(time)))
        except (NoPosition, np.linalg.LinAlgError, ZeroDivisionError, ValueError, OverflowError):
            continue
    return found


def off_at(held, motion, tau):
    """How far off a claim is at a pose of the film."""
    at = Positions(held, motion, tau)
    time = rational(motion.segment.start + Fraction(tau))
    return at.off(at.refined(at.x, time, np.ones(len(at.rows), dtype=bool)), time)
