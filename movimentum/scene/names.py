"""Names of symbols in the script's own words, for messages."""

from __future__ import annotations

from collections.abc import Hashable

from movimentum.scene.leaves import Bearing, ContactPlace, Cord, Stop, StoredValue, Wheel
from movimentum.scene.model import (
    AnchorCoordinate,
    AnchorRef,
    Anonymous,
    GearPair,
    Scene,
    ThingAngle,
    ThingProperty,
    VariableComponent,
)
from movimentum.syntax.printer import float_text

_AXES = "xyz"


def anchor_name(scene: Scene, anchor: AnchorRef) -> str:
    """``Rod.A``."""
    thing = scene.things[anchor.thing]
    return f"{thing.name}.{thing.anchors[anchor.anchor].name}"


def symbol_name(scene: Scene, payload: Hashable) -> str:
    """The script's name for the payload of a symbol: ``Rod.A.x``, ``Wheel.angle``, ``v.y``, ``x``, ``_``.

    A payload that does not belong to the scene is shown as Python shows it.
    """
    match payload:
        case AnchorCoordinate():
            return f"{anchor_name(scene, AnchorRef(payload.thing, payload.anchor))}.{_AXES[payload.axis]}"
        case ThingAngle():
            thing = scene.things[payload.thing]
            taken = any(anchor.name == "angle" for anchor in thing.anchors)
            return f"{thing.name}.{'a' if taken else 'angle'}"
        case ThingProperty():
            return f"{scene.things[payload.thing].name}.{payload.name}"
        case GearPair():
            pair = f"({scene.things[payload.first].name}, {scene.things[payload.second].name})"
            return (f".belt{pair}" + ".crossed" * payload.crossed) if payload.belt else f".mesh{pair}"
        case ContactPlace():
            return "(place of contact)"
        case Bearing():
            match payload.about:
                case (Cord() as cord, int() as stop):
                    return f"the turn of {symbol_name(scene, cord)} at {_stop_name(scene, cord.stops[stop])}"
                case ContactPlace():
                    return "(the rounds of a contact)"
                case (AnchorRef() as start, AnchorRef() as end):
                    return f".a([1, 0], {anchor_name(scene, end)} - {anchor_name(scene, start)})"
        case Cord(stops, grips):
            return f".cord({', '.join(_stop_name(scene, stop) for stop in stops)})" + ".grips" * grips
        case StoredValue(time=time):
            return f"(a value kept from t = {float_text(float(time))})"
        case VariableComponent():
            return payload.name if payload.axis is None else f"{payload.name}.{_AXES[payload.axis]}"
        case Anonymous():
            return "_" if payload.axis is None else f"_.{_AXES[payload.axis]}"
        case _:
            return str(payload)


def _stop_name(scene: Scene, stop: Stop) -> str:
    match stop:
        case Wheel(thing, side):
            return "-" * (side < 0) + scene.things[thing].name
        case AnchorRef():
            return anchor_name(scene, stop)
        case (x, y):
            return f"[{float_text(x.value or 0.0)}, {float_text(y.value or 0.0)}]"
