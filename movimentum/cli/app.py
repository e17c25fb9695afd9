"""The command line: options, and nothing else. What the commands do is in `pipeline`, what they say in `console`."""

from __future__ import annotations

import atexit
import gc
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import nullcontext, suppress
from fractions import Fraction
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import click
from click.core import ParameterSource

from movimentum import __version__, budget
from movimentum.console import (
    DONE,
    INTERRUPTED,
    NO_SOLUTION,
    USAGE,
    Console,
    ReaderGone,
    answer,
    answer_json,
    guarded,
    wants_color,
)
from movimentum.errors import MovimentumError
from movimentum.output.files import refuse_overwriting
from movimentum.parameters import FrameRange, FrameRangeType, PairType, RationalType, TraceType, WordsType
from movimentum.pipeline import MAX_DIGITS, MAX_FRAMES, MAX_NESTING, MAX_OPERATIONS, MAX_PIXELS, Choices, Picture
from movimentum.signals import ignore_interrupts
from movimentum.terminal import typed

if TYPE_CHECKING:
    from movimentum.pipeline import Outcome
    from movimentum.source import SourceText

F = TypeVar("F", bound=Callable[..., Any])

EXIT_CODES = """\b
Exit codes:
  0   done (there may be warnings)
  1   the script is at fault
  2   wrong usage, or the output cannot be written
  3   the scene has no solution at some time
  70  a bug in Movimentum
  130 interrupted"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and end the process with its exit code.

    Planning makes hundreds of thousands of small objects and hardly a cycle; the collector's walks over them would take
    half the time of a large scene. Linear algebra has one thread, unless the surroundings say otherwise: matrices are
    small, and on busy processors threads wait for each other longer than they work.
    """
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    gc.freeze()
    gc.set_threshold(200_000, 50, 100)
    given = sys.argv[1:] if arguments is None else arguments
    if "--debug" not in given and not sys.warnoptions:
        warnings.simplefilter("ignore")  # of libraries: ours are diagnostics
    code = run_command_line(given, watched=True)
    ignore_interrupts()
    if code == INTERRUPTED:  # had Ctrl-C hit inside an `exec`, Python would now end by the signal, and not with 130
        os._exit(code)
    if "--debug" in given:  # profilers and the like want an ordinary end
        sys.exit(code)
    _end(code)


def _end(code: int) -> NoReturn:
    """End the process without taking it apart: forgetting every object one by one takes a fifth of a small command."""
    atexit._run_exitfuncs()  # what libraries have asked for  # pyright: ignore[reportPrivateUsage]
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # pyright: ignore[reportUnnecessaryComparison]
            with suppress(OSError, ValueError):
                stream.flush()
    os._exit(code)


def run_command_line(arguments: Sequence[str], *, watched: bool = False) -> int:
    """Run one command; returns its exit code, and raises nothing.

    ``watched``: this process is the command's alone, so what it holds is held to ``--max-memory``.
    """
    console = Console(
        quiet="--quiet" in arguments or "-q" in arguments,
        verbose="--verbose" in arguments or "-v" in arguments,
        debug="--debug" in arguments,
    )

    def work() -> int:
        with budget.watched(console) if watched else nullcontext():
            return _dispatch(list(arguments), console)

    return guarded(work, console)


def _dispatch(arguments: list[str], console: Console) -> int:
    try:
        code = commands.main(arguments, prog_name="movimentum", standalone_mode=False, obj=console)
    except click.Abort:
        raise KeyboardInterrupt from None
    except click.ClickException as error:
        told = StringIO()
        error.show(file=told)
        console.write(told.getvalue())
        return USAGE
    return code if isinstance(code, int) else 0


class _Commands(click.Group):
    """click ends the process by itself for some exceptions of ours; under another name they come through."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except BrokenPipeError as error:
            raise ReaderGone from error
        except EOFError as error:
            raise RuntimeError("unexpected end of a file") from error


# --- options that several commands share ------------------------------------------------------------


def _together(*decorators: Callable[[Any], Any]) -> Callable[[F], F]:
    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def _keep_memory(context: click.Context, _: click.Parameter, megabytes: int) -> int:
    if isinstance(context.obj, Console) and context.get_parameter_source("max_memory") is not ParameterSource.DEFAULT:
        context.obj.megabytes = megabytes
    return megabytes


SPEECH = _together(
    click.option("-q", "--quiet", is_flag=True, expose_value=False, help="Say nothing but warnings and errors."),
    click.option("-v", "--verbose", is_flag=True, expose_value=False, help="Say notes too (as `check` does anyway)."),
    click.option("--debug", is_flag=True, expose_value=False, help="Show a traceback with every error."),
    click.option(
        "--max-memory",
        type=click.IntRange(min=100),
        default=budget.DEFAULT_MEGABYTES,
        show_default=True,
        metavar="MB",
        expose_value=False,
        callback=_keep_memory,
        help="End with an error when more memory is taken.",
    ),
)
SCRIPT = click.argument("script", metavar="SCRIPT")
FPS = click.option(
    "--fps", type=RationalType(positive=True), metavar="F", help="Frames per time unit, instead of the script's."
)
FRAMES = click.option(
    "--frames",
    type=FrameRangeType(),
    metavar="A:B",
    help="Only frames A to B-1, counted from 0 as Python slices count (A:, :B and -12: work); A alone is one frame.",
)
STRICT = click.option("--strict", is_flag=True, help="Treat warnings as errors (exit code 1).")
MAX_FRAMES_OPTION = click.option(
    "--max-frames",
    type=click.IntRange(min=1),
    default=MAX_FRAMES,
    show_default=True,
    metavar="N",
    help="Refuse scripts that make more frames.",
)
MAX_OPERATIONS_OPTION = click.option(
    "--max-operations",
    type=click.IntRange(min=1),
    default=MAX_OPERATIONS,
    show_default=True,
    metavar="N",
    help="Refuse longer expressions.",
)
MAX_NESTING_OPTION = click.option(
    "--max-nesting",
    type=click.IntRange(1, 300),
    default=MAX_NESTING,
    show_default=True,
    metavar="N",
    help="Refuse expressions with more brackets, signs, powers and functions inside one another.",
)
ACCURACY = click.option(
    "--accuracy",
    type=click.Choice(["draft", "standard", "high", "exact"]),
    default="standard",
    show_default=True,
    help="How exactly the equations are solved: interpolated (what it is off by is told), to a float's precision, to "
    "its last bits, or to as many digits as you like.",
)
ON_FAILURE = click.option(
    "--on-failure",
    type=click.Choice(["stop", "hold", "skip"]),
    default="stop",
    show_default=True,
    help="Where the scene has no solution: write nothing, hold the last good pose, or leave those frames out "
    "(the exit code is 3 in each case).",
)


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  movimentum run scripts/four-bar.mov
  movimentum check my-engine.mov
  movimentum solve my-engine.mov -o poses.csv

\b
Shell completion (bash; zsh and fish alike):
  eval "$(_MOVIMENTUM_COMPLETE=bash_source movimentum)"

"""
    + EXIT_CODES,
)
@click.version_option(__version__, prog_name="movimentum")
@SPEECH
def commands() -> None:
    """Animate mechanisms by stating what is connected to what.

    A script states which points of which parts coincide; Movimentum finds the motion and draws it.
    """


# --- run ----------------------------------------------------------------------------------------------


@commands.command(
    epilog="""\b
Examples:
  movimentum run crank.mov                         crank.gif, beside the script
  movimentum run crank.mov -o crank.mp4            a film (pip install 'movimentum[video]')
  movimentum run crank.mov --at 2.5                crank.png, a still at time 2.5
  movimentum run crank.mov -o 'frames/%04d.png'    numbered pictures
  movimentum run crank.mov --trace Rod.B --show names,free
  movimentum run crank.mov --watch --open          again at every change

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    help="The file to write: .gif (default, under the script's name), .png or .jpg (a still, or numbered pictures "
    "with %d in the name), .apng, .webp; .mp4 and .webm with the video extra.",
)
@FPS
@FRAMES
@click.option("--at", type=RationalType(), metavar="T", help="A still at time T, between frames too.")
@click.option(
    "--scale",
    type=click.FloatRange(min=0, min_open=True),
    default=1.0,
    metavar="S",
    help="Enlarge the picture S times.",
)
@click.option(
    "--trace",
    "traces",
    type=TraceType(),
    multiple=True,
    metavar="THING.ANCHOR",
    help="Draw the path of an anchor, from the beginning to the frame's moment (repeatable).",
)
@click.option(
    "--show",
    type=WordsType("names", "free", "anchors"),
    default=frozenset[str](),
    help="Draw over the picture: things' names, what can still move, anchors.",
)
@click.option("--background", metavar="COLOR", help="A colour by name or as #rrggbb, instead of the script's.")
@ACCURACY
@click.option(
    "--quality",
    type=click.Choice(["draft", "standard", "high"]),
    default="standard",
    show_default=True,
    help="How finely the picture is drawn (high: every frame is drawn twice as large and averaged).",
)
@click.option(
    "--loop",
    type=click.IntRange(min=0, max=65535),
    default=0,
    show_default=True,
    metavar="N",
    help="Play N times; 0 is for ever.",
)
@click.option("--transparent", is_flag=True, help="No background (GIF, PNG, APNG, WebP, WebM).")
@STRICT
@ON_FAILURE
@click.option(
    "--workers",
    type=click.IntRange(min=1, max=256),
    metavar="N",
    help="Render in N processes [default: as many as pay]. The file is the same, byte for byte.",
)
@click.option("--watch", is_flag=True, help="Render again whenever the script or a sprite changes; Ctrl-C ends it.")
@click.option("--open", "open_it", is_flag=True, help="Show the file when it is done.")
@MAX_FRAMES_OPTION
@MAX_NESTING_OPTION
@MAX_OPERATIONS_OPTION
@click.option(
    "--max-pixels",
    type=click.IntRange(min=1),
    default=MAX_PIXELS,
    show_default=True,
    metavar="N",
    help="Refuse larger pictures.",
)
@SPEECH
@click.pass_obj
def run(
    console: Console,
    *,
    script: str,
    output: str | None,
    fps: Fraction | None,
    frames: FrameRange | None,
    at: Fraction | None,
    scale: Fraction,
    traces: tuple[str, ...],
    show: frozenset[str],
    background: str | None,
    accuracy: str,
    quality: str,
    loop: int,
    transparent: bool,
    strict: bool,
    on_failure: str,
    workers: int | None,
    watch: bool,
    open_it: bool,
    max_frames: int,
    max_nesting: int,
    max_operations: int,
    max_pixels: int,
) -> int:
    """Render SCRIPT as an animation or as pictures."""
    if at is not None and frames is not None:
        raise click.UsageError("--at is one picture and --frames a range of them: give one of the two.")
    target = _output(script, output, ".gif" if at is None else ".png")
    choices = Choices(fps, accuracy, None, on_failure, strict, max_frames, max_nesting, max_operations=max_operations)
    picture = Picture(
        frames=None if frames is None else frames.of,
        at=at,
        scale=float(scale),
        traces=traces,
        show=show,
        background=background,
        quality=quality,
        loop=loop,
        transparent=transparent,
        workers=workers,
        max_pixels=max_pixels,
    )

    def once() -> int:
        from movimentum import pipeline

        def work(source: SourceText) -> Outcome:
            with console.progress("rendering") as progress:
                return pipeline.animate(source, target, choices, picture, progress)

        code, outcome = _made(console, script, work)
        if outcome is not None:
            from movimentum.cli.check_report import counted

            console.say(f"{target}: {counted(outcome.frames, 'frame')}")
        return code

    if not watch:
        code = once()
        if open_it and code in (DONE, NO_SOLUTION) and target.exists():
            click.launch(str(target))
        return code
    if script == "-":
        raise click.UsageError("--watch needs a script in a file.")
    return _watch(console, script, once, target, open_it)


def _watch(console: Console, script: str, once: Callable[[], int], target: Path, open_it: bool) -> int:
    """Call ``once``, which writes ``target``, at every change of the script or its pictures, until Ctrl-C; returns that
    exit code. ``open_it``: the file is opened the first time it exists.
    """
    from movimentum import pipeline
    from movimentum.cli.watch import watch

    waiting, written = open_it, False

    def again() -> Iterable[Path]:
        nonlocal waiting, written
        try:
            code = once()
            written |= code in (DONE, NO_SOLUTION)
            # Opened once: most viewers follow the file by themselves, and a window a change would be a nuisance.
            if waiting and code == DONE:
                click.launch(str(target))
                waiting = False
        except Exception as error:  # a fault of ours must not end the watching either
            console.show_bug(error)
        console.say(f"watching {script}; Ctrl-C ends it")
        try:
            return pipeline.mentioned_files(pipeline.read(script))
        except MovimentumError:
            return ()

    try:
        watch([Path(script)], again)
    except KeyboardInterrupt:
        if not written:
            raise  # nothing was written, and that is said
        console.say(f"\nno longer watching {script}; {target} is as it was written last")
    return INTERRUPTED


# --- check ----------------------------------------------------------------------------------------------


@commands.command(
    epilog="""\b
Examples:
  movimentum check crank.mov
  movimentum check crank.mov --format json | jq .diagnostics
  movimentum check crank.mov --freedom
  movimentum check crank.mov --fps-invariance --reverse

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", "sarif"]),
    default="text",
    show_default=True,
    help="For people, for programs, or for code review tools.",
)
@click.option("--freedom", is_flag=True, help="Tell all connected parts and all free motions, with velocities.")
@click.option("--fps-invariance", is_flag=True, help="Solve at another frame rate too, and compare.")
@click.option("--reverse", is_flag=True, help="Follow the motion from its end back to its beginning too, and compare.")
@FPS
@STRICT
@MAX_FRAMES_OPTION
@MAX_NESTING_OPTION
@MAX_OPERATIONS_OPTION
@SPEECH
@click.pass_obj
def check(
    console: Console,
    *,
    script: str,
    form: str,
    freedom: bool,
    fps_invariance: bool,
    reverse: bool,
    fps: Fraction | None,
    strict: bool,
    max_frames: int,
    max_nesting: int,
    max_operations: int,
) -> int:
    """Say everything that can be said about SCRIPT without rendering it.

    Errors, warnings and notes, and for every step what was left to solve and what is still free.
    """
    from movimentum import pipeline

    with console.working("checking"):
        report, source = pipeline.check(
            script,
            Choices(
                fps=fps, strict=strict, max_frames=max_frames, max_nesting=max_nesting, max_operations=max_operations
            ),
            fps_invariance=fps_invariance,
            reverse=reverse,
        )
    if form == "sarif":
        from movimentum.cli.check_report import check_sarif

        answer_json(check_sarif(report, source))
    elif form == "json":
        from movimentum.cli.check_report import check_json

        answer_json(check_json(report, source, freedom=freedom))
    else:
        from movimentum.cli.check_report import check_text

        answer(check_text(report, source, color=wants_color(sys.stdout), freedom=freedom))
    return report.exit_code


# --- repl -----------------------------------------------------------------------------------------------


@commands.command(
    epilog="""\b
Examples:
  movimentum repl crank.mov
  movimentum repl crank.mov -c 'at 1.5; show Rod; why Rod.B'
  echo 'solutions' | movimentum repl crank.mov

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-c",
    "commands_",
    metavar="COMMANDS",
    multiple=True,
    help="Run these commands, parted by `;` or by line ends, and end. May be given several times.",
)
@FPS
@MAX_FRAMES_OPTION
@MAX_NESTING_OPTION
@MAX_OPERATIONS_OPTION
@SPEECH
@click.pass_obj
def repl(
    console: Console,
    *,
    script: str,
    commands_: tuple[str, ...],
    fps: Fraction | None,
    max_frames: int,
    max_nesting: int,
    max_operations: int,
) -> int:
    """Debug SCRIPT: look at any moment, ask why things are where they are, try statements out.

    Opens also on scripts with errors and on scenes without a solution. `help` lists the commands.
    """
    from movimentum.repl.session import opened
    from movimentum.repl.shell import interact

    if script == "-" and not commands_:
        raise click.UsageError("a script from standard input leaves none for commands: give them with -c.")
    return interact(
        opened(script, Choices(fps=fps, max_frames=max_frames, max_nesting=max_nesting, max_operations=max_operations)),
        ";".join(commands_) if commands_ else None,
    )


# --- golden ---------------------------------------------------------------------------------------------


@commands.group()
def golden() -> None:
    """Golden frames: record what scripts come to, and compare with it later."""


_SCRIPTS = click.argument("scripts", nargs=-1, required=True, metavar="SCRIPT…")
_TO = click.option(
    "--to",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Keep the golden frames in DIR [default: beside each script].",
)


@golden.command(epilog=EXIT_CODES)
@_SCRIPTS
@_TO
@SPEECH
@click.pass_obj
def record(console: Console, *, scripts: tuple[str, ...], to: Path | None) -> int:
    """Record what each SCRIPT comes to: its poses, and a few frames that cover every step.

    Look at the frames before you keep them: from now on they are what is right.
    """
    from movimentum.golden.record import golden_of
    from movimentum.golden.record import record as write_golden
    from movimentum.pipeline import Outcome

    _named(scripts)
    worst = DONE
    for script in scripts:

        def work(_source: SourceText, script: str = script) -> Outcome:
            place = golden_of(Path(script), to)
            made = write_golden(place)
            console.say(f"{place.folder}: {len(made.rows)} rows, {len(made.pictures)} frames")
            return Outcome(len(made.pictures), made.solution.fault, made.solution.diagnostics)

        worst = max(worst, _made(console, script, work)[0])
    return worst


@golden.command(
    "check",
    epilog="""\b
Examples:
  movimentum golden check scripts/*.mov --to tests/golden
  movimentum golden check crank.mov --update

"""
    + EXIT_CODES,
)
@_SCRIPTS
@_TO
@click.option("--update", is_flag=True, help="Keep what each SCRIPT comes to now, where it differs.")
@SPEECH
@click.pass_obj
def golden_check(console: Console, *, scripts: tuple[str, ...], to: Path | None, update: bool) -> int:
    """Compare what each SCRIPT comes to with what was recorded: first where things are, then how it looks.

    Where they differ, NAME.golden-failed/index.html shows expected, actual and difference side by side.
    """
    from movimentum.golden.check import check as compare
    from movimentum.golden.page import write_report
    from movimentum.golden.record import golden_of
    from movimentum.golden.record import record as write_golden
    from movimentum.pipeline import Outcome

    _named(scripts)
    worst = DONE
    for script in scripts:

        def work(source: SourceText, script: str = script) -> Outcome:
            outcome = compare(golden_of(Path(script), to))
            if outcome.good:
                console.say(f"{script}: as recorded")
                return Outcome(0, DONE, ())
            if update:
                write_golden(outcome.golden)
                console.show(outcome.diagnostics, source)
                console.say(f"{script}: recorded anew")
                return Outcome(0, DONE, ())
            page = write_report(outcome)
            console.show(outcome.diagnostics, source)
            console.say(f"{script}: differs; see {page}")
            return Outcome(0, 1, ())

        worst = max(worst, _made(console, script, work)[0])
    return worst


# --- solve ----------------------------------------------------------------------------------------------


@commands.command(
    epilog="""\b
Examples:
  movimentum solve crank.mov -o poses.csv
  movimentum solve crank.mov -o - | head -3
  movimentum solve crank.mov -o poses.npz --fps 1000
  movimentum solve crank.mov -o poses.csv --accuracy exact --digits 80

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-o", "--output", required=True, metavar="OUT", help="A .csv, .json or .npz file; - is CSV on standard output."
)
@FPS
@FRAMES
@ACCURACY
@click.option(
    "--digits",
    type=click.IntRange(min=1),
    metavar="N",
    help="Digits to compute and write with --accuracy exact [default: 50].",
)
@click.option(
    "--max-digits",
    type=click.IntRange(1, 100_000),
    default=MAX_DIGITS,
    show_default=True,
    metavar="N",
    help="Refuse more digits: three times as many take about nine times as long.",
)
@STRICT
@ON_FAILURE
@MAX_FRAMES_OPTION
@MAX_NESTING_OPTION
@MAX_OPERATIONS_OPTION
@SPEECH
@click.pass_obj
def solve(
    console: Console,
    *,
    script: str,
    output: str,
    fps: Fraction | None,
    frames: FrameRange | None,
    accuracy: str,
    digits: int | None,
    max_digits: int,
    strict: bool,
    on_failure: str,
    max_frames: int,
    max_nesting: int,
    max_operations: int,
) -> int:
    """Write where everything is: a table with one row a frame.

    Columns: frame, time, Thing.Anchor.x and .y of every anchor, Thing.angle of every thing (degrees, counting full
    turns), every named variable. World coordinates in pixels, y up.
    """
    from movimentum import pipeline
    from movimentum.interop.tables import SUFFIXES

    if digits is not None and accuracy != "exact":
        raise click.UsageError("--digits needs --accuracy exact: the other tiers have the digits of a float64.")
    if output != "-" and Path(output).suffix.lower() not in SUFFIXES:
        raise click.UsageError(f"{output}: a table ends in one of {', '.join(SUFFIXES)}, or is - for CSV on stdout.")
    choices = Choices(fps, accuracy, digits, on_failure, strict, max_frames, max_nesting, max_digits, max_operations)
    target = None if output == "-" else _output(script, output, ".csv")

    def work(source: SourceText) -> Outcome:
        with console.progress("solving") as progress:
            return pipeline.tabulate(source, target, choices, None if frames is None else frames.of, progress)

    code, outcome = _made(console, script, work)
    if outcome is not None and target is not None:
        from movimentum.cli.check_report import counted

        console.say(f"{target}: {counted(outcome.frames, 'row')}")
    return code


# --- import and export ----------------------------------------------------------------------------------


@commands.command(
    "import",
    epilog="""\b
Examples:
  movimentum import peaucellier.txt -o peaucellier.mov
  movimentum import tiling.txt --snap -o tiling.mov
  movimentum import jansen.pyslvs --drive 0,1 -o jansen.mov
  movimentum import four-bar-formulas.txt -o four-bar.mov

"""
    + EXIT_CODES,
)
@click.argument("file", metavar="FILE")
@click.option("-o", "--output", required=True, metavar="SCRIPT", help="The script to write; - is standard output.")
@click.option(
    "--snap",
    is_flag=True,
    help="Make nearly equal lengths equal and fixed angles whole, and repair the coordinates (linkage files).",
)
@click.option(
    "--snap-angle",
    type=click.FloatRange(min=0, min_open=True, max=360),
    metavar="A",
    help="Degrees that angles are multiples of, with --snap [default: 36].",
)
@click.option(
    "--drive",
    "drives",
    type=PairType(),
    multiple=True,
    metavar="BASE,DRIVEN",
    help="Turn joint DRIVEN about joint BASE (mechanism expressions; repeatable).",
)
@STRICT
@SPEECH
@click.pass_obj
def import_(
    console: Console,
    *,
    file: str,
    output: str,
    snap: bool,
    snap_angle: float | None,
    drives: tuple[tuple[int, int], ...],
    strict: bool,
) -> int:
    """Turn FILE into a script: a linkage file of the program "linkages", or a mechanism expression or triangular
    formulas of Pyslvs.

    Which of the three it is, is seen by what it says.
    """
    from movimentum import pipeline

    if snap_angle is not None and not snap:
        raise click.UsageError("--snap-angle needs --snap.")
    target = None if output == "-" else _output(file, output, ".mov")
    how = pipeline.Import(snap, 36.0 if snap_angle is None else snap_angle, drives)
    code, outcome = _made(console, file, lambda source: pipeline.imported(source, target, how, strict))
    if outcome is not None and target is not None:
        console.say(f"{target}: written; look at it with `movimentum check {typed(target)}`")
    return code


@commands.command(
    epilog="""\b
Examples:
  movimentum export peaucellier.mov -o peaucellier.txt
  movimentum export four-bar.mov --format pyslvs -o four-bar.pyslvs

"""
    + EXIT_CODES
)
@SCRIPT
@click.option("-o", "--output", required=True, metavar="FILE", help="The file to write; - is standard output.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["linkages", "pyslvs"]),
    default="linkages",
    show_default=True,
    help="A linkage of rods as it is at one moment, or the formulas by which triangles give every joint.",
)
@click.option("--at", type=RationalType(), metavar="T", help="The moment (linkages) [default: the beginning].")
@FPS
@STRICT
@MAX_FRAMES_OPTION
@MAX_NESTING_OPTION
@MAX_OPERATIONS_OPTION
@SPEECH
@click.pass_obj
def export(
    console: Console,
    *,
    script: str,
    output: str,
    form: str,
    at: Fraction | None,
    fps: Fraction | None,
    strict: bool,
    max_frames: int,
    max_nesting: int,
    max_operations: int,
) -> int:
    """Write the scene of SCRIPT in another program's format."""
    from movimentum import pipeline

    if at is not None and form != "linkages":
        raise click.UsageError("--at is for linkages: formulas have a value for every frame.")
    target = None if output == "-" else _output(script, output, ".txt")
    choices = Choices(
        fps=fps, strict=strict, max_frames=max_frames, max_nesting=max_nesting, max_operations=max_operations
    )
    code, outcome = _made(console, script, lambda source: pipeline.exported(source, target, form, at, choices))
    if outcome is not None and target is not None:
        console.say(f"{target}: written")
    return code


# --- trade ----------------------------------------------------------------------------------------------


@commands.command(
    epilog="""\b
Examples:
  movimentum trade crank.mov
  movimentum trade crank.mov -o crank.svg
  movimentum trade crank.mov --format json | jq .solver.tiers

"""
    + EXIT_CODES
)
@SCRIPT
@click.option("-o", "--output", metavar="PLOT", help="A plot of it: a .png or .svg file.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="For people, or for programs.",
)
@FPS
@click.option(
    "--digits",
    type=click.IntRange(min=20, max=1000),
    metavar="N",
    help="Digits of the truth that everything is compared with [default: 50].",
)
@STRICT
@MAX_FRAMES_OPTION
@MAX_NESTING_OPTION
@MAX_OPERATIONS_OPTION
@SPEECH
@click.pass_obj
def trade(
    console: Console,
    *,
    script: str,
    output: str | None,
    form: str,
    fps: Fraction | None,
    digits: int | None,
    strict: bool,
    max_frames: int,
    max_nesting: int,
    max_operations: int,
) -> int:
    """Measure what accuracy costs and what it buys on SCRIPT.

    Every tier of --accuracy and every --quality: time, and the error against a truth of 50 digits, or of many times the
    pixels.
    """
    from movimentum import pipeline

    target: Path | None = None
    if output is not None:
        if Path(output).suffix.lower() not in (".png", ".svg"):
            raise click.UsageError(f"{output}: a plot ends in .png or .svg.")
        target = _output(script, output, ".svg")
    choices = Choices(
        fps=fps,
        digits=digits,
        strict=strict,
        max_frames=max_frames,
        max_nesting=max_nesting,
        max_operations=max_operations,
    )
    reports: list[pipeline.TradeReport] = []

    def work(source: SourceText) -> Outcome:
        with console.progress("measuring") as progress:
            report, outcome = pipeline.trade(source, target, choices, progress)
        reports.append(report)
        return outcome

    code, outcome = _made(console, script, work)
    for report in reports:
        from movimentum.tradeoff.report import trade_json, trade_text

        if form == "json":
            answer_json(trade_json(script, report.solver, report.pictures, report.rates))
        else:
            answer(trade_text(script, report.solver, report.pictures, report.rates))
    if outcome is not None and target is not None:
        console.say(f"{target}: plotted")
    return code


def _named(scripts: Iterable[str]) -> None:
    """Golden frames are kept under their script's name."""
    if "-" in scripts:
        raise click.UsageError("a script from standard input has no name to keep golden frames under: give a file.")


# --- helpers ----------------------------------------------------------------------------------------------


def _output(script: str, output: str | None, suffix: str) -> Path:
    """The file to write: never the script itself (nor its pictures, which are known later)."""
    if output is None:
        if script == "-":
            raise click.UsageError("a script from stdin has no name: say where to write with -o.")
        output = str(Path(script).with_suffix(suffix)) if Path(script).name else script
    target = Path(output)
    refuse_overwriting(target, () if script == "-" else (script,))
    return target


def _made(console: Console, script: str, work: Callable[[SourceText], Outcome]) -> tuple[int, Outcome | None]:
    """The exit code and outcome of ``work`` on the script; what it has to say is shown with the script's lines."""
    from movimentum import pipeline

    source: SourceText | None = None
    try:
        source = pipeline.read(script)
        with console.working("working"):
            outcome = work(source)
    except MovimentumError as error:
        console.trace(error)
        console.show(error.diagnostics, source)
        return error.exit_code, None
    console.show(outcome.diagnostics, source)
    console.note([item for item in outcome.notes if not console.verbose or item not in outcome.diagnostics], source)
    return outcome.exit_code, outcome
