"""What a page is told about a script: things and statements with their places, claims, diagnostics, what determines a
position, and the motion as films for the page's painter.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.advice import Advised
from movimentum.analysis.diagnose.claims import broken_claims
from movimentum.cancellation import look
from movimentum.diagnostics import Diagnostic, to_json
from movimentum.drawing.model import SymbolMark, TextMark
from movimentum.drawing.picture_options import PictureOptions
from movimentum.expressions import Expr, symbols
from movimentum.records import replace
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.prepare import prepare_drawing
from movimentum.rendering.stream import concatenate
from movimentum.scene.leaves import Bearing, Cord
from movimentum.scene.model import (
    AnchorCoordinate,
    AnchorRef,
    Ending,
    GearPair,
    Relation,
    Scene,
    ThingAngle,
    ThingProperty,
)
from movimentum.source import FarSpan, SourceText, Span, UnfoldedText
from movimentum.vector.film import Film, make_film
from movimentum.vector.page import FilmData, film_data
from movimentum.workflow.frames import PoseChunks
from movimentum.workflow.inspector import Inspector

if TYPE_CHECKING:
    from movimentum.scene.model import Claim, Constraint, Thing
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses
    from movimentum.timeline.model import Timeline


def scene_data(timeline: Timeline, frames: int | None = None, motion: PathMotion | None = None) -> dict[str, Any]:
    """Things, statements, steps and constants of a scene, with their places in the script; ``frames``: how many of the
    film are sent (None: `frames_shown`), of ``most`` that will be. With a ``motion`` also what pushes when.
    """
    scene = timeline.scene
    return {
        "start": float(timeline.start),
        "end": float(timeline.end),
        "fps": float(timeline.fps),
        "frames": frames_shown(timeline) if frames is None else frames,
        "most": frames_shown(timeline),
        "all": timeline.frame_count,
        "loops": timeline.loops,
        "sized": scene.config.size is not None,
        "steps": [float(step.time) for step in scene.steps],
        "contacts": [] if motion is None else _contacts(motion),
        "things": [_thing(thing, scene.source) for thing in scene.things],
        "statements": [
            {"span": place, "things": sorted(about(item)), **_pinned(item)}
            for step in scene.steps
            for item in (*step.statements, *step.claims)
            if not isinstance(item, Ending) and (place := placed(scene.source, item.span)) is not None
        ],
        "constants": [
            {
                "name": item.name,
                "value": float(item.value[0].value),
                "least": item.least,
                "most": item.most,
                "unit": item.unit,
                "span": placed(scene.source, item.expression),
            }
            for item in scene.constants
            if len(item.value) == 1 and item.least is not None and item.most is not None
        ],
    }  # fmt: skip


def _contacts(motion: PathMotion) -> list[dict[str, Any]]:
    from movimentum.analysis.contact_events import contacts

    return [
        {
            "time": each.time,
            "event": each.event,
            "words": each.words if each.things else f"{each.statement} {each.words}",
        }
        for each in contacts(motion)
    ]


def _thing(thing: Thing, source: SourceText) -> dict[str, Any]:
    return {
        "name": thing.name,
        "shape": thing.kind.word,
        "span": placed(source, thing.span),
        "uses": _uses(source, thing.span),
        "body": thing.is_body,
        "hidden": thing.hidden,
        "radius": thing.radius,
        "width": thing.look.outline,
        "through": [[ref.thing, ref.anchor] for ref in thing.through if isinstance(ref, AnchorRef)],
        "anchors": {anchor.name: list(anchor.local) for anchor in thing.anchors},
    }


def _uses(source: SourceText, span: Span) -> list[list[int]]:
    """Where the copies and loops are stated that a span of the unfolded text is for."""
    if not isinstance(source, UnfoldedText):
        return []
    return [[place.start, place.end] for _, place in source.uses(span) if not isinstance(place, FarSpan)]


def about(item: Any) -> set[int]:
    """The numbers of the things that a statement or claim mentions."""
    return _things_of(*item.left, *item.right)


def _things_of(*sides: Expr) -> set[int]:
    found: set[int] = set()
    for payload in symbols(*sides):
        match payload:
            case AnchorCoordinate() | ThingAngle() | ThingProperty():
                found.add(payload.thing)
            case GearPair():
                found |= {payload.first, payload.second}
            case Cord():
                found |= {stop.thing for stop in payload.stops if not isinstance(stop, tuple)}
            case Bearing():
                found |= _things_of(payload.sine, payload.cosine)
            case _:
                pass
    return found


def _pinned(item: Constraint | Claim) -> dict[str, list[float] | None]:
    """An anchor and the place that the script pins it to, or pulls it to (a wish), if those are two numbers."""
    anchor, pin, wish = getattr(item, "anchor", None), None, None
    if anchor is not None and len(item.right) == 2:
        x, y = (side.value for side in item.right)
        place = None if x is None or y is None else [anchor.thing, anchor.anchor, float(x), float(y)]
        pin = place if item.relation is Relation.EQUAL else None
        wish = place if item.relation is Relation.WISH else None
    return {"pin": pin, "wish": wish}


def placed(source: SourceText, span: Span) -> list[int] | None:
    """Where a span is in the script; None if it is in another file."""
    real = getattr(source, "real", None)
    found = real(span) if real is not None else span
    return None if isinstance(found, FarSpan) else [found.start, found.end]


def diagnostics_data(found: Sequence[Diagnostic], source: SourceText) -> list[dict[str, Any]]:
    """Diagnostics as ``check --format json`` prints them, with offsets (``from``, ``to``) beside lines and columns;
    without helps for a command line.
    """
    data = to_json(found, source)
    for item, diagnostic in zip(data, found, strict=True):
        span = diagnostic.span
        item["helps"] = [text for text in item["helps"] if not (isinstance(text, Advised) and text.has_settings)]
        here = span is not None and not isinstance(span, FarSpan)
        item["from"], item["to"] = (span.start, span.end) if here and span is not None else (None, None)
        tried = [fix for fix in diagnostic.fixes if fix.tried]
        for fix, each in zip(item.get("fixes", ()), tried, strict=True):
            for place, edit in zip(fix["edits"], each.edits, strict=True):
                place["from"], place["to"] = edit.span.start, edit.span.end
    return data


def claims_data(motion: PathMotion, proofs: Mapping[int, str] | None = None) -> list[dict[str, Any]]:
    """The claims of a motion as `movimentum.studio.messages.ClaimsChecked` has them. ``proofs``: the verdicts of
    `movimentum prove`, by number.
    """
    timeline = motion.timeline
    broken = {found.claim.number: found for found in broken_claims(motion)}
    claims = {held.claim.number: held.claim for held in timeline.claims}
    signs = {Relation.BELOW: "<", Relation.ABOVE: ">"}
    data: list[dict[str, Any]] = []
    for number, claim in sorted(claims.items()):
        sign = signs.get(claim.relation, "")
        sign += "" if sign and claim.strict else "="
        left, right = claim.side_texts
        item: dict[str, Any] = {
            "span": placed(timeline.scene.source, claim.span),
            "words": f"{left} {sign} {right}{_known(proofs, number, number not in broken)}",
            "things": sorted(about(claim)),
            "holds": number not in broken,
            "proof": (proofs or {}).get(number, ""),
        }
        if number in broken:
            found = broken[number]
            worst = found.worst if np.isfinite(found.worst) else None
            item |= {"time": found.time, "frame": found.frame, "worst": worst, "at": found.worst_time}
            item["failing"] = [list(run) for run in found.failing]
        data.append(item)
    return data


def _known(proofs: Mapping[int, str] | None, number: int, holds: bool) -> str:
    """The text of a claim's badge after its words, once a proof has been searched for."""
    if proofs is None or not holds:
        return ""
    found = proofs.get(number, "")
    return f" ({found})" if found.startswith("proved") else " (holds in this film)"


def overlaps_data(motion: PathMotion) -> list[dict[str, Any]]:
    """The overlaps in a motion, in the form of `movimentum.studio.messages.OverlapsFound`."""
    from movimentum.analysis.gaps.overlaps import overlaps

    numbers = {thing.name: thing.number for thing in motion.timeline.scene.things}
    return [
        {
            **found.as_data(),
            "things": [numbers[name] for name in found.things],
            "words": f"{found.things[0]} and {found.things[1]} overlap, {found.depth:.4g} px deep",
        }
        for found in overlaps(motion)
    ]


def why(inspector: Inspector, name: str) -> str:
    """The statements that determine a position, one line each."""
    thing = inspector.thing(name)
    if thing is not None and not thing.anchors:
        return f"`{name}` has no points, so it is nowhere by itself"
    found = inspector.causes(name)
    lines = [
        f"{number}. line {cause.line}: {f'`{cause.text}` is rigid' if cause.rigid else cause.text}"
        for number, cause in enumerate(found.chain, 1)
    ]
    lines += [f"{', '.join(names[:6])}: not determined by that alone; they move least" for _, names in found.free]
    lines += [f"`{each}` stays as drawn: nothing in this step says otherwise" for each in found.drawn]
    return "\n".join(lines) or f"nothing in this step says anything about `{name}`"


MOST_EXACT = 100_000
"""Poses whose places are sent with all digits; of more, only what is drawn."""
SOON_FRAMES, SOON_TEXTS, MOST_POSES = 20_000, 1_000, 1_500_000
"""Frames of a film that are shown at once (where every frame has texts of its own, those take a millisecond each), and
poses (things times frames) that are shown at all: some 30 MB.
"""


def whole_film(motion: PathMotion, frames: int | None = None) -> tuple[dict[str, Any], Film]:
    """The film of a motion, as the page's painter takes it; of its first ``frames`` (None: `frames_shown`)."""
    timeline = motion.timeline
    shown = frames_shown(timeline) if frames is None else frames
    chunks: list[Poses] = []
    for some in PoseChunks(motion, range(shown), False, drawn=True):
        look()  # another text gives this up, wherever it is
        chunks.append(some)
    film = _film(timeline.scene, chunks, timeline.fps, PictureOptions(motion=motion))
    return _data(film), film


def moved_marks(film: Film, poses: Poses) -> dict[str, Any] | None:
    """Marks redrawn in every pose, such as springs and texts with numbers, in ``poses`` (F = 1): a film of one frame
    with these marks alone. None if there are none.
    """
    marks = tuple(item for item in film.prepared.things if _is_live(item))
    if not marks:
        return None
    prepared = replace(film.prepared, things=marks, traces=(), overlays=(), paths=(), beside=())
    there = make_film(film.scene, prepared, poses, film.title, film.fps, 0)
    # texts are measured from the pivots that the page knows
    pivots = {body: replace(motion, pivot=film.bodies[body].pivot) for body, motion in there.bodies.items()}
    there = replace(there, bodies=pivots)
    numbers = [number for number, item in enumerate(film.prepared.things) if _is_live(item)]
    return {**film_data(there), "live": _seen(there, numbers)}


def _is_live(item: PreparedMark) -> bool:
    return isinstance(item.mark, SymbolMark) or (isinstance(item.mark, TextMark) and bool(item.mark.pieces))


def _seen(film: Film, numbers: Sequence[int]) -> list[int]:
    """The numbers of those marks that a film's data have, in their order."""
    pairs = zip(numbers, film.prepared.things, strict=True)
    return [number for number, item in pairs if film.paint(item)[0].any()]


def frames_shown(timeline: Timeline) -> int:
    """How many frames of a film the page has in the end."""
    return min(timeline.frame_count, max(1, MOST_POSES // max(1, len(timeline.scene.things))))


def frames_soon(timeline: Timeline, time: Fraction) -> int:
    """How many frames of a film the page has at first, those up to ``time`` among them."""
    looked_at = int(max(Fraction(0), time - timeline.start) * timeline.fps) + 1
    soon = SOON_TEXTS if timeline.scene.shows_numbers else SOON_FRAMES
    return min(frames_shown(timeline), max(soon, looked_at))


def small_film(motion: PathMotion, frames: int) -> dict[str, Any]:
    """The film of a motion in at most so many frames; ``length``: how long it takes, in time units."""
    timeline = motion.timeline
    count = min(frames, timeline.frame_count)
    chosen = [round(k * (timeline.frame_count - 1) / max(1, count - 1)) for k in range(count)]
    chunks = tuple(PoseChunks(motion, tuple(timeline.frame_time(frame) for frame in chosen), False, drawn=True))
    film = film_data(_film(timeline.scene, chunks, timeline.fps, PictureOptions()))
    return {**film, "length": float(timeline.frame_count / timeline.fps)}


def some_pictures(timeline: Timeline, poses: Poses) -> dict[str, Any]:
    """Several poses as the frames of a film."""
    return _data(_film(timeline.scene, (poses,), timeline.fps, PictureOptions()))


def _film(scene: Scene, chunks: Sequence[Poses], fps: Fraction, options: PictureOptions) -> Film:
    look()
    prepared = prepare_drawing(scene, chunks, options)
    look()
    poses = concatenate(list(chunks))
    title = Path(scene.source.path).stem
    return make_film(scene, prepared, poses, title, fps, 0, everything=True)


def _data(film: Film) -> dict[str, Any]:
    found = FilmData(film)
    data = found.all()
    data["live"] = [number for number, item in enumerate(film.prepared.things) if found.seen(item)]
    data["numbers"] = list(film.bodies)
    data["pivots"] = [motion.pivot for motion in film.bodies.values()]
    data["exact"] = ""
    data["solved"] = film.poses.solved.astype(int).tolist()
    if film.poses.origin.size // 2 <= MOST_EXACT:
        places = np.concatenate([film.poses.origin, film.poses.direction], axis=2)  # (N, F, 4)
        data["exact"] = base64.b64encode(np.ascontiguousarray(places, dtype="<f8").tobytes()).decode("ascii")
    return data
