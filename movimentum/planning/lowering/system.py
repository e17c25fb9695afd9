"""A segment's constraints as equations and selectors over numbered unknowns.

This is the first half of planning: anchors become linear forms in poses, vector constraints become scalar
rows, lengths and angles become polynomials where that is equivalent, and only what active constraints mention gets
unknowns at all. Every equation keeps the number of its constraint (or of the rigid thing it belongs to).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from movimentum.cancellation import look
from movimentum.expressions import (
    ONE,
    ZERO,
    Expr,
    add,
    call,
    mul,
    neg,
    sub,
    symbol,
)
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.body_frames import DRAWN, FrameCache, body_frames, scene_shift
from movimentum.planning.lowering.builder import Forms, SystemBuilder, can_be_seen_turning
from movimentum.planning.lowering.calculus import affine
from movimentum.planning.lowering.equations import Equation, Form, Inequality, System
from movimentum.planning.lowering.unknowns import (
    PoseCos,
    PoseSin,
    PoseX,
    PoseY,
    Rate,
    symbol_numbers,
    unknown_number,
)
from movimentum.records import replace
from movimentum.scene.model import Constraint, Scene, ThingAngle
from movimentum.timeline.model import Segment


def build_system(
    scene: Scene, segment: Segment, known: FrameCache, *, rolling: bool = False, forms: Forms | None = None
) -> System:
    """Lower a segment's active constraints; rigid equations and the bookkeeping of angles follow in `with_rigidity`.

    ``rolling``: directions between gears' centres may say where the centres are (one rolls on the other). ``known`` are
    the frames that other segments of the scene have needed, ``forms`` what knows polynomials from before.
    """
    builder = SystemBuilder(
        scene, segment, body_frames(scene, segment, known), scene_shift(scene), rolling=rolling, forms=forms
    )
    builder.number_poses()
    for constraint in segment.active:
        look()
        builder.constrain(constraint)
    return _finished(builder)


def _finished(builder: SystemBuilder) -> System:
    return System(
        scene=builder.scene,
        segment=builder.segment,
        unknowns=tuple(builder.unknowns),
        equations=tuple(builder.equations),
        selectors=tuple(builder.selectors),
        wishes=tuple(builder.wishes),
        frames=builder.frames,
        number_of=dict(builder.number_of),
        shift=builder.shift,
        pushes=tuple(builder.pushes),
        pulls=tuple(builder.pulls),
    )


def _reopened(system: System) -> SystemBuilder:
    builder = SystemBuilder(system.scene, system.segment, system.frames, system.shift)
    builder.unknowns = list(system.unknowns)
    builder.number_of = dict(system.number_of)
    builder.equations = list(system.equations)
    builder.selectors = list(system.selectors)
    builder.wishes = list(system.wishes)
    builder.pushes = list(system.pushes)
    builder.pulls = list(system.pulls)
    return builder


def lowered_expressions(system: System, expressions: Iterable[Expr]) -> list[Expr]:
    """Expressions of the scene in the unknowns of ``system``; ValueError for one that mentions anything else."""
    builder = _reopened(system)
    found = [builder.lower(expression) for expression in expressions]
    if len(builder.unknowns) > len(system.unknowns):
        raise ValueError(builder.unknowns[len(system.unknowns)].name)
    return found


def lowered_inequality(system: System, constraint: Constraint) -> Inequality | None:
    """An inequality in the unknowns of ``system``; None where it needs others, or equations of its own."""
    builder = _reopened(system)
    builder.constrain(constraint)
    if len(builder.unknowns) > len(system.unknowns) or len(builder.equations) > len(system.equations):
        return None
    return builder.selectors[-1]


def with_rigidity(system: System, driven: frozenset[int]) -> System:
    """``system`` with each directed thing's rigid equation and the tie between its angle and its direction.

    Things in ``driven`` get their direction from their angle (c = cos, s = sin); the others have c^2 + s^2 = 1 and
    their angle follows the direction continuously. Directed are the things of which a constraint turns an anchor about
    its frame's origin, and those which could be seen turning about it.
    """
    builder = _reopened(system)
    for t in system.mentioned():
        look()
        thing = system.scene.things[t]
        c, s = system.number_of.get(PoseCos(t)), system.number_of.get(PoseSin(t))
        angle = system.number_of.get(ThingAngle(t))
        builder.pose(t, PoseX)
        builder.pose(t, PoseY)
        if c is None and s is None and not can_be_seen_turning(thing):
            continue
        cosine, sine = builder.pose(t, PoseCos), builder.pose(t, PoseSin)
        if angle is not None and t in driven:
            for direction, op in ((cosine, "cosd"), (sine, "sind")):
                target = unknown_number(direction.payload)
                builder.equations.append(
                    Equation(
                        number=len(builder.equations),
                        residual=sub(direction, call(op, symbol(angle))),
                        unknowns=frozenset({target, angle}),
                        targets=(target, angle),
                        thing=t,
                    )
                )
            continue
        turn_cosine, turn_sine = builder.frames.get(t, DRAWN).turn_of(cosine, sine)
        norm = sub(add(mul(cosine, cosine), mul(sine, sine)), ONE)
        c, s = unknown_number(cosine.payload), unknown_number(sine.payload)
        builder.add_equation(norm, {(c, c): ONE, (s, s): ONE, (): neg(ONE)}, None, t)
        angle = builder.unknown(ThingAngle(t), f"{thing.name}.angle")
        builder.equations.append(
            Equation(
                number=len(builder.equations),
                residual=sub(symbol(angle), call("atan2d", turn_sine, turn_cosine)),
                unknowns=frozenset({angle, *symbol_numbers(cosine, sine)}),
                targets=(angle,),
                thing=t,
                form=Form.WINDING,
            )
        )
    return _finished(builder)


def with_velocities(system: System, rates: Collection[int], reads: Collection[int]) -> System:
    """``system`` with ``rates`` given by the law of the free motion that they are rates of; ``reads`` are the unknowns
    that this motion depends on.
    """
    builder = _reopened(system)
    for rate in sorted(rates):
        of, _ = system.differentiated(rate)
        builder.equations.append(
            Equation(
                number=len(builder.equations),
                residual=sub(symbol(rate), Expr("derivative", (symbol(of),))),
                unknowns=frozenset({*rates, *reads}),
                targets=tuple(sorted(rates)),
                thing=system.unknowns[of].thing,
                form=Form.VELOCITY,
            )
        )
    return _finished(builder)


def with_rates(system: System, equations: Sequence[int], unknowns: Sequence[int]) -> System:
    """``system`` with the time derivatives of the given equations, which determine ``unknowns``, added (linear in the
    rates).
    """
    builder = _reopened(system)
    for number in equations:
        equation = system.equations[number]
        if equation.form is Form.INTEGRAL:
            continue
        derived = builder.total_derivative(_differentiable(equation, unknowns))
        builder.add_equation(derived, poly.from_expression(derived), equation.constraint, equation.thing)
        last = builder.equations[-1]
        rates = tuple(n for n in last.targets if isinstance(builder.unknowns[n].payload, Rate))
        builder.equations[-1] = replace(last, targets=rates)
    return _finished(builder)


def _differentiable(equation: Equation, unknowns: Sequence[int]) -> Expr:
    """The residual whose derivative tells the rate of ``unknowns``. One that is stated to be a length is not squared:
    where the length is zero, the derivative of its square says nothing.
    """
    stated = equation.stated
    if stated is None or len(unknowns) != 1:
        return equation.residual
    value = affine(stated, unknowns[0])
    return equation.residual if value is None or value[0].value is None or value[0] == ZERO else stated
