"""Evaluating on a motion: the values of the scene's expressions in given poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, substitute, symbol, symbols
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.scene.model import AnchorCoordinate, Scene, ThingAngle, ThingProperty, VariableComponent
from movimentum.solver.poses import Poses

Reader = Callable[[Poses], list[FloatArray]]
"""From the poses of F moments to one (F,) array for each expression; nan if an expression has no value."""


def reader(scene: Scene, expressions: Sequence[Expr]) -> Reader:
    """Evaluates ``expressions`` of the scene's anchors, angles, properties, variables and clocks (`scene.model`).

    NotImplementedError for one that has to be solved for (an integral, a derivative).
    """
    payloads = sorted(symbols(*expressions), key=repr)
    place = {payload: n for n, payload in enumerate(payloads)}
    memo: dict[Expr, Expr] = {}

    def numbered(node: Expr) -> Expr | None:
        return symbol(place[node.payload]) if node.op == "symbol" else None

    clocks = Clocks()
    function = compiled([substitute(e, numbered, memo) for e in expressions], clocks)
    starts: list[Fraction] = clocks.starts

    def read(poses: Poses) -> list[FloatArray]:
        count = len(poses.times)
        worlds: dict[tuple[int, int], FloatArray] = {}

        def value(payload: object) -> FloatArray:
            match payload:
                case AnchorCoordinate(thing, anchor, axis):
                    if (thing, anchor) not in worlds:
                        local = scene.things[thing].anchors[anchor].local
                        worlds[thing, anchor] = poses.world(thing, local)
                    return worlds[thing, anchor][:, axis]
                case ThingAngle(thing):
                    return poses.angle[thing]
                case ThingProperty(thing, name):
                    found = poses.properties.get((thing, name))
                    return np.full(count, scene.things[thing].undriven(name)) if found is None else found
                case VariableComponent(name, axis):
                    value = poses.variables[name] if axis is None else poses.variables[name][:, axis]
                    return np.where(poses.missing[name], np.nan, value) if name in poses.missing else value
                case _:
                    raise NotImplementedError(payload)

        known = [value(payload) for payload in payloads]
        with np.errstate(all="ignore"):
            found = function(known, [poses.times - float(start) for start in starts])
        return [np.array(np.broadcast_to(v, count), dtype=np.float64) for v in found]

    return read
