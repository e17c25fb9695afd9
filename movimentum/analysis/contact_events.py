"""Contact events over a whole motion: contacts that begin, end, move elsewhere, or jam."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.pushing.tracks import EventKind, PushTrack
from movimentum.tolerances import CONTACT_FLICKERS

Pair = tuple[int, tuple[int, int] | None]
"""The number of the constraint, and the things."""


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """Something that happens at ``time``: see `PushEvent`."""

    time: float
    kind: EventKind
    push: int
    things: tuple[int, int] | None

    @property
    def pair(self) -> Pair:
        """Whose contact it is."""
        return self.push, self.things


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
                    contact = ContactEvent(start + float(event.tau), event.kind, event.push, event.things)
                    if event.kind is EventKind.BEGINS:
                        now[contact.pair] = None
                        if contact.pair in touching and event.tau <= piece.begin:
                            del touching[contact.pair]
                            continue
                    elif event.kind is EventKind.ENDS:
                        now.pop(contact.pair, None)
                    found.append(contact)
        found += [ContactEvent(start, EventKind.ENDS, *pair) for pair in touching if pair not in now]
        touching = dict.fromkeys(now, 0.0)
    order = list(EventKind)
    found = _without_undone(found)
    return sorted(found, key=lambda event: (event.time, order.index(event.kind), event.push))


def _without_undone(events: list[ContactEvent]) -> list[ContactEvent]:
    """``events`` without those that are undone at once."""
    ends = (EventKind.BEGINS, EventKind.ENDS)
    kept: list[ContactEvent] = []
    last: dict[Pair, int] = {}
    gone: set[int] = set()
    for event in sorted(events, key=lambda event: event.time):
        place = last.get(event.pair)
        if event.kind in ends and place is not None and place not in gone:
            before = kept[place]
            if before.kind is not event.kind and event.time - before.time <= CONTACT_FLICKERS:
                gone.add(place)
                del last[event.pair]
                continue
        if event.kind in ends:
            last[event.pair] = len(kept)
        kept.append(event)
    return [event for place, event in enumerate(kept) if place not in gone]


@dataclass(frozen=True, slots=True)
class Contact:
    """A contact event at ``time``: the ``event`` is "begins", "ends", "changes" (it goes on
    at another place of the same outlines), "jams" or "undecided" (two corners meet, and may go on past either side of
    each other). ``things``: the names of the two whose outlines touch; nothing for another inequality. ``statement``:
    that which pushes. `Motion.contacts` lists them.

    >>> import movimentum as mv
    >>> text = "A : .disc(5) C=[0,0]; B : .disc(5) C=[30,0]; @0 A.C=[10*.t,0]; B.C=[x,0]; .gap(A, B) >= 0 .pushes; @4"
    >>> [(each.event, each.things, round(each.time, 9)) for each in mv.loads(text).solve().contacts]
    [('begins', ('A', 'B'), 2.0)]
    """

    time: float
    event: str
    things: tuple[str, ...]
    statement: str

    @property
    def words(self) -> str:
        """What happens: "A and B touch", or "begins to hold" of another inequality."""
        return " ".join([" and ".join(self.things), _WORDS[self.event, bool(self.things)]]).strip()


_WORDS = {
    ("begins", True): "touch",
    ("ends", True): "part",
    ("changes", True): "go on at another place",
    ("jams", True): "jam",
    ("begins", False): "begins to hold",
    ("ends", False): "lets go",
    ("changes", False): "goes on",
    ("jams", False): "jams",
    ("undecided", True): "meet at their tips, and may go on past either side",
}


def contacts(motion: PathMotion) -> list[Contact]:
    """All of them, in order of time."""
    scene = motion.timeline.scene
    spans = {item.number: item.span for item in scene.constraints()}

    def said(number: int) -> str:
        span = spans.get(number)
        return "" if span is None else " ".join(scene.source.slice(span).split())

    return [
        Contact(
            event.time,
            str(event.kind),
            () if event.things is None else tuple(scene.things[t].name for t in event.things),
            said(event.push),
        )
        for event in contact_events(motion)
    ]
