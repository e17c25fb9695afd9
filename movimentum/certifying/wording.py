"""A certificate as text, as data for programs, and as diagnostics."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from movimentum.advice import Advised, Choose, ScriptCommand
from movimentum.certifying.bounds import Bound, BoundVerdict
from movimentum.certifying.certificate import Break, Certificate
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.scene.model import Relation
from movimentum.source import SourceText
from movimentum.text import counted, number, time_text

OF_RELATION = {Relation.BELOW: ("above", "<="), Relation.ABOVE: ("below", ">=")}


def certificate_diagnostics(found: Certificate) -> Iterator[Diagnostic]:
    """An error for each bound that is broken between frames, a warning for each reason why not all is proved."""
    for bound in found.bounds:
        if bound.verdict is BoundVerdict.FALSE:
            yield _broken(bound)
        elif bound.counts:
            yield _undecided(bound)
    for one in found.refused:
        yield Diagnostic(
            code="certify/no-certificate",
            severity=Severity.WARNING,
            message=f"the film cannot be certified: {one.why}",
            span=one.span,
            notes=("tubes enclose what equations and formulas of time determine",),
        ).advised(Advised(ScriptCommand.CHECK, " without `", Choose.CERTIFY.to(), "` checks it by numbers"))
    for one in found.breaks:
        yield _break(one)
    for jump in found.jumps:
        yield Diagnostic(
            code="certify/jump",
            severity=Severity.WARNING,
            message=f"the film is not one unbroken motion: it jumps by {number(jump.distance, 4)} px at t = "
            f"{time_text(jump.time)}",
            span=jump.span,
            notes=("before and after it is certified",),
        )


def _break(one: Break) -> Diagnostic:
    code = "certify/change-point" if one.change else "certify/broken-off"
    return Diagnostic(
        code=code,
        severity=Severity.WARNING,
        message=f"the certificate breaks off at t = {_moment(one)}: {one.why}",
        span=one.span,
        notes=("what comes before and after is certified separately, but not that the motion continues there as shown",)
        if one.change
        else (),
    )


def _moment(one: Break) -> str:
    """The time, with as many digits as are known."""
    width = one.end - one.begin
    digits = 9 if width <= 0.0 else max(1, math.ceil(-math.log10(width)) - 1)
    middle = 0.5 * (one.begin + one.end)
    return f"{round(middle, digits):g}" if width < 0.1 else f"{time_text(one.begin)} to {time_text(one.end)}"


def _broken(bound: Bound) -> Diagnostic:
    claim = bound.timed_claim.claim
    left, right = claim.side_texts
    word = OF_RELATION.get(claim.relation, ("not", "="))[0]
    return Diagnostic(
        code="certify/broken-claim",
        severity=Severity.ERROR,
        message=f"between frames `{left}` is {word} `{right}`: by {number(-bound.margin, 3)}, at t = "
        f"{time_text(bound.time)}",
        span=claim.span,
        notes=("it holds in every frame, but is proved to be broken between two of them",),
    ).advised("change the bound, or let the claim end earlier")


def _undecided(bound: Bound) -> Diagnostic:
    left, right = bound.timed_claim.claim.side_texts
    return Diagnostic(
        code="certify/undecided-claim",
        severity=Severity.WARNING,
        message=f"it is not proved that `{left}` keeps to `{right}` between frames: {bound.why}",
        span=bound.timed_claim.claim.span,
        notes=(f"its margin is narrowest at about t = {time_text(bound.time)}",),
    )


# --- for people and for programs


def certificate_text(found: Certificate, source: SourceText) -> str:
    """A line for the film, and one for each bound."""
    lines: list[str] = []
    if found.frames:
        which = "every frame is" if found.frames == found.whole else f"{found.frames} of {found.whole} frames are"
        lines.append(
            f"{which} within {number(found.distance, 2)} px of an exact solution (farthest: frame {found.worst}), "
            + ("in one unbroken motion" if not found.breaks and not found.jumps else "in several motions")
            + f": {counted(found.tubes, 'tube')}"
        )
    for bound in found.bounds:
        data = _bound(bound, source)
        lines.append(f"  {data['verdict']}  {data['line']}:{data['column']}  {data['text']}{_margin(bound)}")
    return "".join(f"{line}\n" for line in lines)


def _margin(bound: Bound) -> str:
    if not math.isfinite(bound.margin):
        return f": {bound.why}" if bound.why else ""
    if bound.verdict is BoundVerdict.UNDECIDED and not bound.counts:
        return ": an equality, which is for `movimentum prove`"
    when = f"at t = {bound.time:.6g}"
    if bound.verdict is BoundVerdict.PROVED and bound.margin < 0.0:
        return f", to within {number(-bound.margin, 2)}, {when}"
    return f", margin {number(bound.margin, 3)} {when}"


def as_data(found: Certificate, source: SourceText) -> dict[str, Any]:
    """For JSON; what has no finite value is None."""
    return {
        "complete": found.complete and not any(b.verdict is BoundVerdict.FALSE or b.counts for b in found.bounds),
        "distance": found.distance if found.frames else None,
        "frames": found.whole,
        "certified": found.frames,
        "farthest": found.worst if found.frames else None,
        "tubes": found.tubes,
        "stretches": [{"time": one.begin, "end": one.end, "tubes": one.tubes} for one in found.intervals],
        "breaks": [_place(one, source) for one in found.breaks],
        "refused": [_place(one, source) for one in found.refused],
        "jumps": [{"time": jump.time, "distance": jump.distance} for jump in found.jumps],
        "claims": [_bound(bound, source) for bound in found.bounds],
    }


def _place(one: Break, source: SourceText) -> dict[str, Any]:
    place = None if one.span is None else source.position(one.span.start)
    return {
        "time": one.begin,
        "end": one.end,
        "why": one.why,
        "change_point": one.change,
        "line": None if place is None else place.line,
        "column": None if place is None else place.column,
    }


def _bound(bound: Bound, source: SourceText) -> dict[str, Any]:
    return {
        **source.claim_data(bound.timed_claim.claim.span),
        "verdict": bound.verdict.value,
        "margin": bound.margin if math.isfinite(bound.margin) else None,
        "time": bound.time,
        "why": bound.why,
    }
