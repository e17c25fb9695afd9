"""The trade between time and accuracy as a table, as JSON, and as a plot; with the conclusions."""

from __future__ import annotations

import json
from collections.abc import Sequence
from fractions import Fraction
from pathlib import PurePath

from movimentum.advice import Advised, Choose
from movimentum.encoding.plot import Panel, Point
from movimentum.terminal import visible
from movimentum.text import listed
from movimentum.tolerances import LEAST_DIVISOR, LEAST_PLOTTED
from movimentum.tradeoff.tiers import PictureTrade, SolverTrade

Rates = Sequence[tuple[Fraction, float]]

LITTLE = 0.1
"""A tier that saves less than this fraction of the time for a picture gains nothing."""
INVISIBLE = 0.02
"""Pixels: an error below it changes no colour of an anti-aliased edge by more than a few of 255 levels."""


def _time(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def trade_text(script: str, solver: SolverTrade, pictures: PictureTrade, rates: Rates) -> str:
    """Tables in plain text, and sentences."""
    frames = f"{solver.frames:,} frame{'' if solver.frames == 1 else 's'}"
    parts = [
        f"{visible(script)}: {frames}, compared at {solver.samples} of them with {solver.digits} digits\n\n",
        _table(
            ["accuracy", "start", "per frame", "residual", "position error"],
            [
                [
                    tier.name,
                    _time(tier.start),
                    _time(tier.frame),
                    f"{tier.residual:.1e}",
                    _truth(solver) if tier.name == "exact" else f"{tier.error:.1e} px",
                ]
                for tier in solver.tiers
            ],
        ),
        f"\n{pictures.size[0]} x {pictures.size[1]} pixels, compared with {pictures.supersampling} x supersampling\n\n",
        _table(
            ["picture", "per frame", "rms error of 255"],
            [[cost.name, _time(cost.frame), f"{cost.error:.2f}"] for cost in pictures.costs],
        ),
        "\n",
        _table(
            ["frames per time unit", "drawn in", "farthest step"],
            [[f"{float(fps):g}", _time(float(fps) * _drawing(pictures)), f"{step:.3g} px"] for fps, step in rates],
        ),
        "\n",
        *(f"{sentence}\n" for sentence in lessons(solver, pictures)),
    ]
    return "".join(parts)


def _truth(solver: SolverTrade) -> str:
    return "the reference" if solver.rough else "the truth"


def _drawing(pictures: PictureTrade) -> float:
    return next(cost.frame for cost in pictures.costs if cost.name == "quality standard")


def lessons(solver: SolverTrade, pictures: PictureTrade) -> list[str]:
    """What the numbers say about the choice of a tier."""
    tiers = {tier.name: tier for tier in solver.tiers}
    draft, standard, high, exact = (tiers[name] for name in ("draft", "standard", "high", "exact"))
    count, drawing = solver.frames, _drawing(pictures)
    found: list[str] = []
    truth = "`exact`" if solver.rough else "the truth"
    if solver.rough:
        off = f"off by {solver.integration:.1e} px" if solver.integration else "about 12 digits"
        found.append(
            f"No tier adds digits to {listed(list(solver.rough))}: all take it from the path ({off}). Position errors"
            " come on top of that."
        )
    saved = (standard.start - draft.start) + count * (standard.frame - draft.frame)
    whole = standard.start + count * (standard.frame + drawing)
    if draft.claim is None:
        found.append(
            "`draft` is the same as `standard` here: it gains only where loops are solved frame by frame, in thousands"
            " of frames."
        )
    elif saved < LITTLE * whole:
        found.append(f"`draft` gains little here: it saves {_time(saved)} of {_time(whole)}, with drawing.")
    else:
        found.append(f"`draft` saves {_time(saved)} of {_time(whole)} and is off by {draft.error:.1e} px.")
    if draft.claim is not None and draft.error > INVISIBLE:
        found.append(f"In a picture `draft` can be seen: {draft.error:.2g} px.")
    integrated = solver.integration or 0.0
    times = high.frame / max(standard.frame, LEAST_DIVISOR)
    if integrated > standard.error:
        found.append("`high` and `exact` gain nothing here.")
    elif standard.error < INVISIBLE:
        found.append(
            f"For pictures `high` and `exact` gain nothing: `standard` is within {standard.error:.1e} px of {truth}."
        )
    else:
        found.append(f"`standard` is off by {standard.error:.1e} px where the mechanism is singular: use `high`.")
    if integrated <= standard.error:
        found.append(
            f"For tables `high` brings {standard.error:.0e} px down to {high.error:.0e} px for {times:.3g} times the"
            f" time per frame, `exact` takes {exact.frame / max(standard.frame, LEAST_DIVISOR):.3g} times."
        )
    costs = {cost.name: cost for cost in pictures.costs}
    plain, fine = costs["quality standard"], costs["quality high"]
    if fine.error >= 0.9 * plain.error:
        found.append(
            Advised("`", Choose.QUALITY.to("high"), "` gains nothing here: it is as far from the truth as `standard`.")
        )
    if costs["quality draft"].frame >= 0.9 * plain.frame:
        found.append(Advised("`", Choose.QUALITY.to("draft"), "` gains nothing here: it is no faster."))
    return found


def trade_json(script: str, solver: SolverTrade, pictures: PictureTrade, rates: Rates) -> str:
    """One object; times in seconds, lengths in pixels."""
    return json.dumps(
        {
            "script": script,
            "solver": {
                "frames": solver.frames,
                "samples": solver.samples,
                "size": solver.size,
                "digits": solver.digits,
                "rough": list(solver.rough),
                **({} if solver.integration is None else {"integration": solver.integration}),
                "tiers": [
                    {
                        "accuracy": tier.name,
                        "start": tier.start,
                        "frame": tier.frame,
                        "residual": tier.residual,
                        "error": tier.error,
                        **({} if tier.claim is None else {"claim": tier.claim}),
                    }
                    for tier in solver.tiers
                ],
            },
            "pictures": {
                "size": list(pictures.size),
                "frames": pictures.frames,
                "supersampling": pictures.supersampling,
                "costs": [{"picture": c.name, "frame": c.frame, "rms": c.error} for c in pictures.costs],
            },
            "rates": [{"fps": float(fps), "step": step} for fps, step in rates],
            "lessons": lessons(solver, pictures),
        },
        indent=1,
        ensure_ascii=False,
        allow_nan=False,
    )


def panels(script: str, solver: SolverTrade, pictures: PictureTrade) -> list[Panel]:
    """Two diagrams: of solving and of drawing, time per frame against error."""
    least = LEAST_PLOTTED
    tiers = tuple(
        Point(
            f"{tier.name} ({_truth(solver)})" if tier.name == "exact" else tier.name,
            1e3 * tier.frame,
            max(tier.error, least),
            group,
        )
        for group, tier in enumerate(solver.tiers)
    )
    drawn = tuple(Point(cost.name, 1e3 * cost.frame, cost.error, group) for group, cost in enumerate(pictures.costs))
    name = PurePath(script).name
    return [
        Panel(f"{name}: solving", "milliseconds per frame", "position error, pixels", tiers),
        Panel(f"{name}: drawing", "milliseconds per frame", "rms error of 255", drawn),
    ]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns aligned: the first aligned left, numbers aligned right."""
    every = [list(head), *map(list, rows)]
    widths = [max(len(row[k]) for row in every) for k in range(len(head))]
    lines = [
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in every
    ]
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "".join(line.rstrip() + "\n" for line in lines)
