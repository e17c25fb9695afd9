"""`movimentum sweep`: a table of variants."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from movimentum.budget import keep_freed_memory
from movimentum.cli.common import DASK, EXIT_CODES, FPS, LIMITS, SCRIPT, SPEECH, files, gathered, output_file
from movimentum.console import Console
from movimentum.errors import UsageError, errors_in
from movimentum.records import dataclass
from movimentum.text import counted
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read

if TYPE_CHECKING:
    from movimentum.scene.model import Scene
    from movimentum.source import SourceText
    from movimentum.variants.sweep import SweepJob, Swept

MAX_VARIANTS = 10_000_000


@dataclass(frozen=True, slots=True)
class _SweepOptions:
    """The values of the options."""

    script: str
    vary: tuple[str, ...]
    sample: str | None
    measure: tuple[str, ...]
    resume: bool
    sheet: str | None
    plot: tuple[str, ...]
    max_variants: int
    dask: str | None


@click.command(
    epilog="""\b
Examples:
  movimentum sweep four-bar.mov --vary L=60:120:13 --measure 'width = .range(Coupler.P.x)'
  movimentum sweep jansen.mov --vary crank=10:20:101 --vary b=38:45:71 \\
      --measure 'stride = .max(Foot.x) - .min(Foot.x)' -o steps.parquet --plot crank,b,stride
  movimentum sweep leg.mov --sample sobol:4096 --measure 'lift = .range(Foot.y)' -o leg.csv
  movimentum sweep four-bar.mov --vary L=60:120:13 --sheet sheet.png

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "--vary",
    multiple=True,
    metavar="NAME=VALUES",
    help="A constant (`.let`) and its values: a:b:n (n values from a to b), a,b,c, or @file.csv (its column of that "
    "name; columns of one file go together). NAME alone takes 11 values of its `.range`. May be repeated: all "
    "combinations are solved.",
)
@click.option(
    "--sample",
    metavar="sobol:N",
    help="N points of a Sobol sequence in the intervals of all constants that have a `.range` (`--vary NAME=a:b` gives "
    "another one).",
)
@click.option(
    "--measure",
    multiple=True,
    metavar="'NAME = EXPR'",
    help="A column: an expression with .min(…), .max(…), .mean(…), .rms(…), .range(…), .first(…), .last(…), "
    ".at(…, T) over all frames, or .margin(K), how far claim number K is from failing. May be repeated.",
)
@click.option(
    "-o",
    "--output",
    default="-",
    metavar="OUT",
    shell_complete=files,
    help="A .csv, .npz or .parquet file [default: CSV on standard output].",
)
@click.option("--resume", is_flag=True, help="Continue an interrupted sweep to the same file.")
@click.option(
    "--sheet",
    metavar="PNG",
    shell_complete=files,
    help="Pictures of the variants side by side (of at most 100 of them).",
)
@click.option(
    "--plot",
    multiple=True,
    metavar="X[,Y],MEASURE",
    help="Draw a measure over one constant (lines) or two (a map), into OUT-MEASURE.png; may be repeated.",
)
@click.option(
    "--max-variants",
    type=click.IntRange(min=1),
    default=MAX_VARIANTS,
    show_default=True,
    metavar="N",
    help="Refuse more variants.",
)
@DASK
@FPS
@LIMITS
@SPEECH
@click.pass_obj
@gathered(choices=Choices, asked=_SweepOptions)
def sweep(console: Console, *, choices: Choices, asked: _SweepOptions, output: str) -> int:
    """Solve many variants of a script, and write a table with one row for each.

    The columns are the varying constants, the measures, the outcome (ok, binds, cannot be assembled, jumps) and the
    time at which it binds or jumps. A variant that fails is a row and does not end the sweep.
    """
    target = None if output == "-" else output_file(asked.script, output, ".csv")
    if target is None and asked.resume:
        raise click.UsageError("--resume needs a file: -o table.csv.")
    source = read(asked.script)
    with errors_in(source), console.working("sweeping"):
        return _swept(console, source, choices, asked, target).exit_code


def _swept(console: Console, source: SourceText, choices: Choices, asked: _SweepOptions, target: Path | None) -> Swept:
    from movimentum.variants.axes import read_grid
    from movimentum.variants.measures import read_measures
    from movimentum.variants.plots import check_sheet, read_plots, write_plots, write_sheet
    from movimentum.variants.sweep import counts_text, prepared
    from movimentum.workflow.stages import understand

    grid = read_grid(asked.vary, asked.sample, understand(source, choices).constants, asked.max_variants)
    job, scene = prepared(source, choices, grid, read_measures(asked.measure, grid.names))
    beside = target or Path("sweep.csv" if asked.script == "-" else asked.script)
    plots = read_plots(asked.plot, grid, job.measures, beside)
    if asked.sheet is not None:
        check_sheet(Path(asked.sheet))
    done = _solved(console, job, scene, asked, target)
    if plots and done.measures is not None:
        write_plots(plots, grid, job.measures, done.measures)
        for plot in plots:
            console.say(f"{plot.target}: {job.measures.names[plot.measure]} over {' and '.join(plot.over)}")
    if asked.sheet is not None:
        with console.progress("drawing") as progress:
            count = write_sheet(job, Path(asked.sheet), progress)
        console.say(f"{asked.sheet}: {counted(count, 'picture')}")
    shown = "" if target is None else f"{target}: "
    console.say(f"{shown}{counted(len(grid), 'variant')}: {counts_text(done.counts)}")
    return done


def _solved(console: Console, job: SweepJob, scene: Scene, asked: _SweepOptions, target: Path | None) -> Swept:
    from movimentum.variants.spool import spool_path
    from movimentum.variants.sweep import sweep_to_file, sweep_to_stream

    keep_freed_memory()
    keep, resume = bool(asked.plot), asked.resume
    if target is not None and not resume and spool_path(target).exists():
        console.write(f"discarding {spool_path(target)} of an interrupted sweep (--resume would continue it)\n")
    with ExitStack() as stack:
        solver = None
        if asked.dask is not None:
            from movimentum.variants.sweep import OnCluster
            from movimentum.workflow.clusters import cluster

            solver = OnCluster(job, stack.enter_context(cluster(asked.dask, console.say)))
        progress = stack.enter_context(console.progress("sweeping"))
        if target is None:
            return sweep_to_stream(job, progress, keep=keep, solver=solver)
        console.left = f"finished variants are kept beside {target}; --resume continues from there"
        try:
            return sweep_to_file(job, scene, target, progress, resume=resume, keep=keep, solver=solver)
        except UsageError as error:
            if error.diagnostics[0].code == "usage/dask":
                error.diagnostics = (error.diagnostics[0].advised("`--resume` continues after the finished variants"),)
            raise
