"""The trade between time and accuracy, over the gallery and some extremes.

It writes tables into docs/understanding/accuracy-and-speed.md and draws docs/pictures/trade.svg.

    python benchmarks/trade.py [--out FOLDER] [--long N]

Every tier of `--accuracy` on every script: start-up, time per frame, the largest residual of the script's own
equations, the largest position error against 50 digits; and every way to draw, against a supersampled truth.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median

from measure import ROOT
from tables import write

from movimentum.encoding.plot import Panel, Point, write_plot
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read
from movimentum.workflow.tradeoff import TradeReport, trade

TIERS = ("draft", "standard", "high", "exact")


def extremes(frames: int) -> Iterator[tuple[str, str]]:
    """Scripts by name that are hard for one tier or another."""
    for missed in ("1e-6", "1e-9", "1e-12"):
        yield (
            f"dead centre missed by {missed}",
            f"""
            .config(10, 120, 120); Rod : .bar A = [0,0] B = A + [50,0];
            @0 Rod.A = [0,0]; Rod.B = [x, 50 - {missed} - 20*.t*.t]; x > 0; @1
            """,
        )
    yield (
        "parallelogram through its change points",
        """
        .config(10, 300, 200);
        A : .bar O = [100,100] P = O + [30,0];  C : .bar P = [130,100] Q = P + [80,0];
        B : .bar O = [180,100] Q = O + [30,0];
        @0 A.O = [100,100]; B.O = [180,100]; A.angle = 90*.t - 45; C.P = A.P; C.Q = B.Q; @4
        """,
    )
    yield (
        "lines 1e-7 degrees apart",
        """
        .config(4, 100, 100);
        R : .bar A = [0,0] B = A + [100,0];  S : .bar A = [0,1] B = A + [100,0];  Dot : .disc(3) C = [10,10];
        @0 R.A = [0,0]; R.angle = 0.1 + .t; S.A = [0,1]; S.angle = 0.1 + .t + 0.0000001;
           Dot.C = R.A + u*(R.B - R.A); Dot.C = S.A + w*(S.B - S.A); @1
        """,
    )
    yield (
        "four-bar 1e6 from the origin",
        four_bar(50, "1000000"),
    )
    yield f"four-bar, {frames:,} frames", four_bar(frames // 4, "0")
    yield "20 four-bars in a chain", chain(20)


def four_bar(fps: int, away: str) -> str:
    """A crank-rocker whose crank turns once in 4 time units."""
    return f"""
    .config({fps}, 400, 300);
    Crank   : .bar O = [100,100] P = O + [30,0];   Coupler : .bar P = [130,100] Q = P + [90,0];
    Rocker  : .bar C = [200,100] Q = C + [70,0];
    @0  Crank.O = [{away} + 100,100];  Rocker.C = [{away} + 200,100];  Crank.angle = 90*.t;
        Coupler.P = Crank.P;  Coupler.Q = Rocker.Q;  Coupler.Q.y > 100;
    @4
    """


def chain(length: int) -> str:
    """Four-bars one behind the other: each rocker's direction drives the next crank."""
    rows = [".config(12, 400, 300);"]
    facts: list[str] = []
    for k in range(length):
        x = 100 + 150 * k
        rows.append(
            f"Crank{k} : .bar O = [{x},100] P = O + [30,0]; Coupler{k} : .bar P = [{x + 30},100] Q = P + [90,0];"
            f" Rocker{k} : .bar C = [{x + 100},100] Q = C + [70,0];"
        )
        drive = "90*.t" if k == 0 else f"Rocker{k - 1}.angle * 2"
        facts.append(
            f"Crank{k}.O = [{x},100]; Rocker{k}.C = [{x + 100},100]; Crank{k}.angle = {drive};"
            f" Coupler{k}.P = Crank{k}.P; Coupler{k}.Q = Rocker{k}.Q; Coupler{k}.Q.y > 100;"
        )
    return "\n".join([*rows, "@0", *facts, "@4"])


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    parser.add_argument("--long", type=int, default=20_000, help="frames of the long film")
    options = parser.parse_args()
    reports: list[tuple[str, bool, TradeReport]] = []
    for path in sorted((ROOT / "scripts").glob("*.mov")):
        reports.append((path.stem, True, measured(read(str(path)))))
        print(path.stem, flush=True)
    for name, text in extremes(options.long):
        reports.append((name, False, measured(SourceText("extreme.mov", text))))
        print(name, flush=True)
    write(options.out / "understanding" / "accuracy-and-speed.md", page(reports).strip(), "trade")
    write_plot(panels(reports), options.out / "pictures" / "trade.svg", ".svg")


def measured(source: SourceText) -> TradeReport:
    """The trade on one script."""
    return trade(source, None, Choices(), lambda done, total: None)[0]


PAGE = """\
### Which default is best

**Solving: `standard`.** Over the gallery a frame takes {standard} to solve and {drawing} to draw. So a faster tier
could save at most {share:.1%} of the time that a picture takes. `draft` is the
same in {same} of {count} scripts: it interpolates only loops that are solved frame by frame, in thousands of frames,
where that is at least twice as fast ([0034](decisions/0034-draft.md)).

`standard` is within {standard_error:.0e} px of the truth in the whole gallery, which no picture can show. `high` costs
{high:.0f} times as much per frame and gives every coordinate to the last bit. It is meant for tables. It is *necessary*
near singular positions, where `standard` loses up to half its digits (the extremes below). `exact` costs {exact:.0f}
times as much and is meant for oracles and formulas.

**Drawing: `standard`.** Anti-aliased polygons are within {plain:.2f} of 255 levels (rms, median) of a picture
supersampled 8 times. Sprites of fine detail are within 3 to 9, because they are filtered differently when they are
enlarged. `high` reduces the error to {fine:.2f} for {fine_time:.1f} times the time. `draft` raises it to {jagged:.1f}
and takes {jagged_time:.1f} times the time. The palette of a GIF adds {palette:.2f}. At half the scale, shown at full
size, the error is {half:.1f}.

### Solving

Start-up means compiling and finding the path. Residuals are those of the script's own equations and of rigidity,
evaluated with more digits, relative to the scene's size. An error is the largest distance of any anchor from its place
in 50 digits, in pixels (0: every coordinate is the nearest float). What is only integrated along the path is the same
in all tiers.

{solving}

### Drawing

Each cell has the milliseconds per frame and the rms error of 255 levels.

{pictures}
"""
SOLVING = (
    "script", "frames", "start-up, ms", "per frame, µs: draft", "standard", "high", "exact",
    "residual: draft", "standard", "high", "error, px: draft", "standard", "high",
)  # fmt: skip
DRAWING = ("script", "size", "draft", "standard", "high", "scale 0.5", "scale 2", "GIF palette")


def page(reports: list[tuple[str, bool, TradeReport]]) -> str:
    """What stands between the marks of the page."""
    gallery = [report for _, shown, report in reports if shown]

    def over(tier: str, what: str) -> float:
        return median(getattr(report.solver.tiers[TIERS.index(tier)], what) for report in gallery)

    def worst(tier: str) -> float:
        return max(report.solver.tiers[TIERS.index(tier)].error for report in gallery)

    drawing = median(cost.frame for r in gallery for cost in r.pictures.costs if cost.name == "quality standard")
    return PAGE.format(
        standard=us(over("standard", "frame")),
        drawing=us(drawing),
        share=over("standard", "frame") / drawing,
        same=sum(report.solver.tiers[0].claim is None for report in gallery),
        count=len(gallery),
        standard_error=worst("standard"),
        high=over("high", "frame") / over("standard", "frame"),
        exact=over("exact", "frame") / over("standard", "frame"),
        plain=rms(gallery, "quality standard"),
        fine=rms(gallery, "quality high"),
        fine_time=ratio(gallery, "quality high", "quality standard"),
        jagged=rms(gallery, "quality draft"),
        jagged_time=ratio(gallery, "quality draft", "quality standard"),
        palette=rms(gallery, "palette (GIF)"),
        half=rms(gallery, "scale 0.5"),
        solving=table(SOLVING, 1, [row(name, report) for name, _, report in reports]),
        pictures=table(DRAWING, 2, [picture_row(name, report) for name, shown, report in reports if shown]),
    )


def table(head: tuple[str, ...], left: int, rows: list[str]) -> str:
    """A Markdown table, whose first ``left`` columns hold words."""
    rule = ["---"] * left + ["---:"] * (len(head) - left)
    return "\n".join([f"| {' | '.join(head)} |", f"|{'|'.join(rule)}|", *rows])


def us(seconds: float) -> str:
    """Microseconds or milliseconds."""
    return f"{seconds * 1e6:.3g} µs" if seconds < 1e-3 else f"{seconds * 1e3:.3g} ms"


def rms(reports: list[TradeReport], name: str) -> float:
    """The median error of one way to draw."""
    return median(cost.error for r in reports for cost in r.pictures.costs if cost.name == name)


def ratio(reports: list[TradeReport], name: str, other: str) -> float:
    """How many times as long one way to draw takes as another (median)."""
    costs = [{cost.name: cost.frame for cost in report.pictures.costs} for report in reports]
    return median(cost[name] / cost[other] for cost in costs)


def row(name: str, report: TradeReport) -> str:
    """One script's solving."""
    tiers = report.solver.tiers
    cells = [
        name,
        f"{report.solver.frames:,}",
        f"{tiers[1].start * 1e3:.3g}",
        *(f"{tier.frame * 1e6:.3g}" for tier in tiers),
        *(f"{tier.residual:.0e}" for tier in tiers[:3]),
        *("0" if tier.error == 0.0 else f"{tier.error:.0e}" for tier in tiers[:3]),
    ]
    return f"| {' | '.join(cells)} |"


def picture_row(name: str, report: TradeReport) -> str:
    """One script's drawing."""
    cells = [name, "{} × {}".format(*report.pictures.size)]
    cells += [f"{cost.frame * 1e3:.2g} / {cost.error:.2f}" for cost in report.pictures.costs]
    return f"| {' | '.join(cells)} |"


def panels(reports: list[tuple[str, bool, TradeReport]]) -> list[Panel]:
    """A point for every script in every tier, and for every way to draw; each named once."""
    solving: list[Point] = []
    drawing: list[Point] = []
    for first, (_, shown, report) in enumerate(reports):
        for group, tier in enumerate(report.solver.tiers):
            solving.append(Point("", 1e3 * tier.frame, max(tier.error, 1e-17), group))
        for group, cost in enumerate(report.pictures.costs if shown else ()):
            drawing.append(Point("" if first else cost.name, 1e3 * cost.frame, cost.error, group))
    for group, tier in enumerate(TIERS):
        place = next(k for k, point in enumerate(solving) if point.group == group)
        solving[place] = replace(solving[place], label=tier)
    return [
        Panel("solving", "milliseconds per frame", "position error, pixels", tuple(solving)),
        Panel("drawing", "milliseconds per frame", "rms error of 255", tuple(drawing)),
    ]


if __name__ == "__main__":
    main()
