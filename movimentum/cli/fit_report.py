"""What ``movimentum fit`` prints: the same result for people and for programs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from movimentum.diagnostics import to_json
from movimentum.fitting.summary import AimOutcome, aim_outcomes, cost_of, notes, unmet
from movimentum.scene.model import Purpose
from movimentum.text import counted, number, time_text

if TYPE_CHECKING:
    from movimentum.fitting.fit import Fitted


def as_text(found: Fitted) -> str:
    """What is printed: constants before and after, what each goal misses by, each requirement."""
    job = found.problem.job
    lines: list[str] = []
    if found.problem.reason is not None:
        lines.append(f"(variants were solved one by one: {found.problem.reason})")
    width = max(map(len, job.names))
    for name, before, after in zip(job.names, found.before.tolist(), found.after.tolist(), strict=True):
        lines.append(f"{name:<{width}} = {number(after, 10)}   (was {number(before, 10)})")
    before, after = (aim_outcomes(found, motion) for motion in (found.first, found.last))
    for purpose, title in ((Purpose.GOAL, "goals"), (Purpose.REQUIREMENT, "requirements")):
        own = [(a, b) for a, b in zip(before, after, strict=True) if a.claim.purpose is purpose]
        if own:
            lines.append(f"{title}:")
        for was, now in own:
            told = _off(now, purpose is Purpose.GOAL)
            moved = was.rms is not None or was.value is not None
            earlier = f"   (before: {_off(was, purpose is Purpose.GOAL)})" if moved else ""
            lines.append(f"  line {now.line}: {now.told}: {told}{earlier}")
    if len(found.others):
        lines.append(f"{counted(len(found.others), 'other solution')}, equally good:")
        rows = ([f"{n} = {number(v, 8)}" for n, v in zip(job.names, r, strict=True)] for r in found.others.tolist())
        lines += ["  " + ", ".join(row) for row in rows]
    return "\n".join(lines) + "\n"


def _off(outcome: AimOutcome, goal: bool) -> str:

    if outcome.value is not None:
        return number(outcome.value)
    if outcome.worst is None or outcome.rms is None:
        return "it does not move"
    when = "" if outcome.time is None else f" at t = {time_text(outcome.time)}"
    if goal:
        if outcome.time is None:
            return f"off by {number(max(outcome.rms, 0.0))}"
        return (
            f"off by {number(outcome.rms)} (root of the mean square), {number(max(outcome.worst, 0.0))} at most{when}"
        )
    if outcome.worst <= 0.0:
        return f"holds, with {number(-outcome.worst)} to spare{when}"
    return f"off by {number(outcome.worst)}{when}"


def as_json(found: Fitted) -> str:
    """One JSON object: ``constants``, ``goals``, ``requirements``, ``cost``, ``met``, ``others``."""
    job = found.problem.job
    scene = found.problem.lowered.timeline.scene
    pairs = list(zip(aim_outcomes(found, found.first), aim_outcomes(found, found.last), strict=True))

    def told(purpose: Purpose) -> list[dict[str, Any]]:
        return [
            {
                "text": now.told,
                "line": now.line,
                "rms": now.rms,
                "worst": now.worst,
                "time": now.time,
                "rms_before": was.rms,
                "worst_before": was.worst,
                "value": now.value,
                "value_before": was.value,
            }
            for was, now in pairs
            if now.claim.purpose is purpose
        ]

    rows = zip(job.names, found.before.tolist(), found.after.tolist(), job.intervals.tolist(), strict=True)
    told_all = {
        "met": found.met,
        "constants": [
            {"name": name, "before": before, "after": after, "least": low, "most": high}
            for name, before, after, (low, high) in rows
        ],
        "cost": cost_of(found, found.last),
        "cost_before": cost_of(found, found.first),
        "goals": told(Purpose.GOAL),
        "requirements": told(Purpose.REQUIREMENT),
        "others": [dict(zip(job.names, row, strict=True)) for row in found.others.tolist()],
        "seed": job.seed,
        "diagnostics": to_json([*unmet(found), *notes(found)], scene.source),
    }
    return json.dumps(told_all, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
