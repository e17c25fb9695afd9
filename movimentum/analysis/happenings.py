"""What touches when: contacts that begin, end, go on elsewhere, or let nothing move, in the script's words."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.pushing.told import contact_events


@dataclass(frozen=True, slots=True)
class Contact:
    """Something that happens at ``time`` between what pushes: the ``event`` is "begins", "ends", "changes" (it goes on
    at another place of the same outlines) or "jams". ``things``: the names of the two whose outlines touch; nothing for
    another inequality. ``statement``: that which pushes. `Motion.contacts` lists them.

    >>> import movimentum as mv
    >>> text = "A : .disc(5) C=[0,0]; B : .disc(5) C=[30,0]; @0 A.C=[10*.t,0]; B.C=[x,0]; .gap(A, B) >= 0 .pushes; @4"
    >>> [(each.event, each.things, round(each.time, 9)) for each in mv.loads(text).solve().contacts]
    [('begins', ('A', 'B'), 2.0)]
    """

    time: float
    event: str
    things: tuple[str, ...]
    statement: str


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
            str(event.happening),
            () if event.things is None else tuple(scene.things[t].name for t in event.things),
            said(event.push),
        )
        for event in contact_events(motion)
    ]
