"""Genuine positions of a mechanism: only these poses of its tower may refute a claim."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from movimentum.expressions import Expr, walk
from movimentum.planning.lowering.equations import Form
from movimentum.proving import balls
from movimentum.proving.angles import CLOCK
from movimentum.proving.balls import NoBall
from movimentum.proving.chain import Chain
from movimentum.proving.points import TowerPoint, arithmetic
from movimentum.proving.rings import Polynomial
from movimentum.proving.tower import FreeParameter, NotAlgebraic, Unit
from movimentum.tolerances import FILM_POSE


def genuine(chain: Chain, *polynomials: Polynomial) -> bool:
    """Whether polynomials have only values that the mechanism can have, wherever parameters are moved to: not where
    they are made of one that it finds, such as the angle of a direction.
    """
    if chain.opaque:
        return False
    ring, lost = chain.tower.ring, set[int]()
    for step in chain.tower.steps:
        alone = isinstance(step, Unit | FreeParameter) and _found(chain, step)
        if alone or any(ring.occurring(part) & lost for part in step.parts):
            lost.update(step.places)
    return not any(ring.occurring(p) & lost for p in polynomials)


def _found(chain: Chain, step: Unit | FreeParameter) -> bool:
    """Whether a parameter is one that the mechanism finds: the number of a direction's angle, or the direction of a
    number.
    """
    source = step.source
    if isinstance(step, Unit):
        return isinstance(source, int) and (source in chain.known or source in chain.of_place.values())
    return isinstance(source, tuple) and source[0] == "turn" and source[1] in chain.lowering.vectors  # pyright: ignore


def holds(chain: Chain, point: TowerPoint) -> bool:
    """Whether a position keeps to the equations as they were stated, but for those that drive: the tower's were
    squared, or multiplied by a length, and have more solutions; some may be lost.
    """
    from movimentum.solver.arithmetic.evaluation import Evaluator

    numbers, plan = arithmetic(), chain.motion.plan

    def leaf(node: Expr) -> Any:
        if node.op == "clock":
            return numbers.array([point.drives.value(CLOCK) - numbers.rationals([node.start])[0]])
        number = node.payload
        if not isinstance(number, int) or number not in chain.known:
            raise NoBall
        found = chain.known[number]
        ball = balls.over(point.at(found.top), point.at(found.bottom))
        return numbers.rationals([Fraction(ball[0], balls.ONE)])

    for block in chain.blocks:
        for e in plan.blocks[block].equations:
            equation = plan.system.equations[e]
            stated = equation.original or equation.residual
            if stated.timed or equation.form is not Form.PLAIN:
                continue
            try:
                (off,) = Evaluator(numbers).values(list(walk(stated)), [stated], leaf)
            except (NoBall, NotAlgebraic):
                continue
            if not abs(float(off[0])) <= FILM_POSE * plan.size:
                return False
    return True
