"""What touches when, over a whole motion."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.pushing.tracks import Happening, PushTrack
from movimentum.tolerances import CONTACT_FLICKERS

Pair = tuple[int, tuple[int, int] | None]
"""The number of the constraint, and the things."""


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """Something that happens at ``time``: see `Event`."""

    time: float
    happening: Happening
    push: int
    things: tuple[int, int] | None

    @property
    def pair(self) -> Pair:
        """Whose contact it is."""
        return self.push, self.things


def push_tracks(motion: PathMotion) -> Iterator[tuple[float, Piece, PushTrack]]:
    """The tracks of all blocks that are pushed, with their pieces and when their segments start."""
    for segment_motion in motion.segments:
        start = float(segment_motion.segment.start)
        for piece in segment_motion.pieces:
            if isinstance(piece, Piece):
                for track in piece.tracks:
                    if isinstance(track, PushTrack):
                        yield start, piece, track


def contact_events(motion: PathMotion) -> list[ContactEvent]:
    """All that begins and ends, in order of time. What goes on from one step to the next neither ends nor begins; what
    a step ends, does.
    """
    found: list[ContactEvent] = []
    touching: dict[Pair, float] = {}
    for segment_motion in motion.segments:
        start = float(segment_motion.segment.start)
        if found and segment_motion.segment.end == segment_motion.segment.start:
            continue  # the end of it all
        now: dict[Pair, None] = {}
        for piece in segment_motion.pieces:
            if not isinstance(piece, Piece):
                continue
            for track in piece.tracks:
                if not isinstance(track, PushTrack):
                    continue
                for event in track.events:
                    if event.tau > piece.end:
                        continue
                    told = ContactEvent(start + event.tau, event.happening, event.push, event.things)
                    if event.happening is Happening.BEGINS:
                        now[told.pair] = None
                        if told.pair in touching and event.tau <= piece.begin:
                            del touching[told.pair]
                            continue
                    elif event.happening is Happening.ENDS:
                        now.pop(told.pair, None)
                    found.append(told)
        found += [ContactEvent(start, Happening.ENDS, *pair) for pair in touching if pair not in now]
        touching = dict.fromkeys(now, 0.0)
    order = list(Happening)
    found = _without_flicker(found)
    return sorted(found, key=lambda event: (event.time, order.index(event.happening), event.push))


def _without_flicker(events: list[ContactEvent]) -> list[ContactEvent]:
    """``events`` without those that are undone at once."""
    ends = (Happening.BEGINS, Happening.ENDS)
    kept: list[ContactEvent] = []
    last: dict[Pair, int] = {}
    gone: set[int] = set()
    for event in sorted(events, key=lambda event: event.time):
        place = last.get(event.pair)
        if event.happening in ends and place is not None and place not in gone:
            before = kept[place]
            if before.happening is not event.happening and event.time - before.time <= CONTACT_FLICKERS:
                gone.add(place)
                del last[event.pair]
                continue
        if event.happening in ends:
            last[event.pair] = len(kept)
        kept.append(event)
    return [event for place, event in enumerate(kept) if place not in gone]
