"""The merit of variants: how far they miss goals and violate requirements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.fitting.aims import Evaluation, LoweredAim, LoweredAims, SideLayout
from movimentum.records import dataclass, replace
from movimentum.tolerances import REQUIREMENT_EQUAL

Evaluate = Callable[..., Evaluation]
"""(V, C) constants, ``slopes`` or not -> `Evaluation`."""


STEEP = 30.0
"""The most that an exponent is, of terms that are to be small."""


@dataclass(frozen=True, slots=True, eq=False)
class Extreme:
    """A term that is to be as small as can be: the greatest of its ``sides`` (numbers), times its ``weight``.

    While starts are looked for and followed, its rows are roots of exp((side - base)/spread), of which the sum is
    smooth (Kreisselmeier & Steinhauser 1979); ``base`` and ``spread`` are those of some variants.
    """

    sides: IntArray
    weight: float
    base: float
    spread: float

    def greatest(self, sides: FloatArray) -> FloatArray:
        """(V,) the term of variants with these sides (V, S), without its weight."""
        return np.asarray(np.max(sides[:, self.sides], axis=1))

    def begun(self, sides: FloatArray) -> Extreme:
        """With the base and the spread of variants with these sides (V, S)."""
        found = self.greatest(sides)
        base = float(np.min(found))
        return replace(self, base=base, spread=float(np.mean(found)) - base or abs(base) or 1.0)

    def rows(self, sides: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(V, N) its rows, and what slopes of sides are multiplied by."""
        share = np.minimum((sides[:, self.sides] - self.base) / self.spread, STEEP)
        rows = np.sqrt(self.weight * self.spread) * np.exp(0.5 * share)
        return rows, rows * (0.5 / self.spread)


@dataclass(frozen=True, slots=True, eq=False)
class Merit:
    """How sides count. All arrays are (S,): ``goals`` and ``required`` tell which sides are which, ``equal`` those of
    equations. ``allowed``: what a requirement may be off by; ``shift``: what is added to it so that rounding does not
    undo an inequality that is met; ``scale``: see `SideLayout`. ``extremes``: terms that are to be as small as can be.
    """

    goals: BoolArray
    required: BoolArray
    equal: BoolArray
    allowed: FloatArray
    shift: FloatArray
    scale: FloatArray
    extremes: tuple[Extreme, ...] = ()

    @staticmethod
    def of(lowered: LoweredAims, layout: SideLayout, size: float) -> Merit:
        """For a scene of this ``size``."""
        aims: list[LoweredAim] = [lowered.aims[int(a)] for a in layout.aim]
        required = np.array([aim.required for aim in aims], dtype=np.bool_)
        equal = np.array([aim.sign == 0.0 for aim in aims], dtype=np.bool_)
        tiny = REQUIREMENT_EQUAL * size
        allowed = np.array([_allowed(aim, tiny) for aim in aims])
        shift = np.where(required & ~equal, tiny - allowed, 0.0)
        extremes = tuple(
            Extreme(np.nonzero(layout.aim == n)[0], aim.timed_claim.claim.weight, 0.0, size)
            for n, aim in enumerate(lowered.aims)
            if aim.extreme
        )
        extreme = np.array([aim.extreme for aim in aims], dtype=np.bool_)
        goals = ~required & ~extreme
        return Merit(goals, required, equal & ~extreme, allowed, shift, layout.scale, extremes)

    def relaxed(self, amount: float) -> Merit:
        """Where requirements may be off by ``amount`` more."""
        allowed = self.allowed + np.where(self.required, amount, 0.0)
        shift = self.shift - np.where(self.required & ~self.equal, amount, 0.0)
        return replace(self, allowed=allowed, shift=shift)

    def missed(self, sides: FloatArray) -> FloatArray:
        """(V, S) by how much each side is off: an inequality that holds is not."""
        return np.where(self.equal, sides, np.maximum(sides, 0.0))

    def cost(self, sides: FloatArray) -> FloatArray:
        """(V,) the weighted sum of squares of what goals miss by, and of what is to be small."""
        off = np.where(self.goals, self.missed(sides) * self.scale, 0.0)
        total = np.sum(off * off, axis=1) + sum(each.weight * each.greatest(sides) for each in self.extremes)
        return np.asarray(total, dtype=np.float64)

    def excess(self, sides: FloatArray) -> FloatArray:
        """(V, S) by how much requirements are off, beyond what is allowed."""
        off = np.where(self.equal, np.abs(sides), sides)
        return np.where(self.required, np.maximum(off - self.allowed, 0.0), 0.0)

    def penalty(self, sides: FloatArray) -> FloatArray:
        """(V,) the sum of squares of what requirements are off by, in units of `scale`."""
        off = self.excess(sides) * self.scale
        return np.asarray(np.sum(off * off, axis=1), dtype=np.float64)

    def balanced(self, sides: FloatArray, slopes: FloatArray) -> Merit:
        """Where requirements change as much as goals do, so that neither is out of sight of the other: they may be
        about seconds or angles, and goals about pixels. ``sides`` (V, S), ``slopes`` (V, S, C): of some variants, by
        units of the box.
        """
        extremes = tuple(each.begun(sides) for each in self.extremes)
        scale = self.scale.copy()
        for each in extremes:
            scale[each.sides] = 0.5 * np.sqrt(each.weight / each.spread)
        steep = np.sqrt(np.nanmedian(np.einsum("vsc,vsc->vs", slopes, slopes), axis=0)) * scale
        goals, required = steep[~self.required], steep[self.required]
        if not (np.any(goals > 0.0) and np.any(required > 0.0)):
            return replace(self, extremes=extremes)
        typical = np.sqrt(np.mean(goals**2)) / np.sqrt(np.mean(required[required > 0.0] ** 2))
        scale = np.where(self.required, self.scale * np.clip(typical, 1.0, 1e6), self.scale)
        return replace(self, scale=scale, extremes=extremes)

    def worst(self, sides: FloatArray) -> FloatArray:
        """(V,) the largest `excess`; inf where there are no sides."""
        found = np.max(self.excess(sides), axis=1, initial=0.0)
        return np.where(np.isfinite(sides).all(axis=1), found, np.inf)


def _allowed(aim: LoweredAim, tiny: float) -> float:
    given = aim.timed_claim.claim.tolerance
    if given is not None:
        return float(given)
    return tiny if aim.sign == 0.0 else 0.0


@dataclass(slots=True, eq=False)
class Lagrangian:
    """The augmented Lagrangian of V fits (Nocedal & Wright, Numerical Optimization, 17.4) as a sum of squares: rows of
    goals, and for each requirement sqrt(mu) (c + multiplier/mu), of inequalities only what is above 0.

    ``multipliers`` (V, S), ``penalty`` mu; ``goals`` False: requirements only.
    """

    merit: Merit
    multipliers: FloatArray
    penalty: float
    goals: bool = True

    def rows(self, found: Evaluation, chosen: BoolArray | slice = slice(None)) -> tuple[FloatArray, FloatArray | None]:
        """(V, S) the rows, and their slopes (V, S, C); nan where there are none."""
        merit, sides = self.merit, found.sides
        shifted = sides + np.where(merit.required, merit.shift + self.multipliers[chosen] / self.penalty, 0.0)
        active = merit.equal | (shifted > 0.0)
        goals = np.where(merit.goals, merit.scale, 0.0) if self.goals else 0.0
        weight = np.where(merit.required, np.sqrt(self.penalty) * merit.scale, goals)
        rows = np.where(active, weight * shifted, np.where(np.isfinite(shifted), 0.0, np.nan))
        weights = np.where(active, weight, 0.0)
        for each in merit.extremes if self.goals else ():
            rows[:, each.sides], weights[:, each.sides] = each.rows(sides)
        return rows, None if found.slopes is None else weights[..., None] * found.slopes

    def updated(self, sides: FloatArray, penalty: float) -> Lagrangian:
        """With better multipliers, after what was found for the last ones."""
        merit = self.merit
        found = self.multipliers + self.penalty * (sides + merit.shift)
        found = np.where(merit.required, np.where(merit.equal, found, np.maximum(found, 0.0)), 0.0)
        found = np.where(np.isfinite(found), found, self.multipliers)
        return Lagrangian(merit, found, penalty, self.goals)
