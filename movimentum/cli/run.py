"""`movimentum run`: an animation or pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import click

from movimentum.cli.options import (
    ACCURACY,
    DASK,
    EXIT_CODES,
    FPS,
    FRAMES,
    LIMITS,
    ON_FAILURE,
    SCRIPT,
    SPEECH,
    STRICT,
    with_choices,
)
from movimentum.cli.parameters import FrameRange, RationalType, TraceType, WordsType, files
from movimentum.cli.work import carried_out, far_frames, output_file
from movimentum.console import DONE, INTERRUPTED, NO_SOLUTION, Console
from movimentum.errors import MovimentumError
from movimentum.text import counted
from movimentum.workflow.choices import MAX_PIXELS, Choices, Outcome, Picture

if TYPE_CHECKING:
    from movimentum.solver.reuse import Known
    from movimentum.source import SourceText


@click.command(
    epilog="""\b
Examples:
  movimentum run crank.mov                         crank.gif, beside the script
  movimentum run crank.mov -o crank.mp4            a video (pip install 'movimentum[video]')
  movimentum run crank.mov -o crank.html           a page that plays it, without a network
  movimentum run crank.mov --at 2.5                crank.png, a still at time 2.5
  movimentum run crank.mov -o 'frames/%04d.png'    numbered pictures
  movimentum run crank.mov --trace Rod.B --show names,free
  movimentum run crank.mov --watch --open          again whenever it changes
  movimentum run crank.mov -o crank.mp4 --dask tcp://scheduler:8786

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    shell_complete=files,
    help="The file to write: .gif (default, under the script's name), .png or .jpg (a still, or numbered pictures "
    "with %d in the name), .apng, .webp, .svg (a still with --at), .html (a page with a player); .mp4 and .webm with "
    "the video extra.",
)
@FPS
@FRAMES
@click.option("--at", type=RationalType(), metavar="T", help="A still at time T, which may lie between frames.")
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
    help="Draw the path of an anchor, from the beginning to the moment of the frame (repeatable).",
)
@click.option(
    "--show",
    type=WordsType("names", "free", "anchors"),
    default=frozenset[str](),
    help="Draw over the picture: the names of things, what can still move, anchors.",
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
@click.option(
    "--transparent",
    is_flag=True,
    help="No background (GIF, PNG, APNG, WebP, SVG, HTML). With --background, the edges of a GIF are blended with it.",
)
@click.option(
    "--lossy",
    type=click.IntRange(min=0, max=64),
    default=0,
    show_default=True,
    metavar="N",
    help="Make a GIF smaller: edges and images may be off by N of 255. Areas of one colour stay as they are.",
)
@STRICT
@ON_FAILURE
@click.option(
    "--workers",
    type=click.IntRange(min=1, max=256),
    metavar="N",
    help="Render in N processes [default: chosen automatically]. The bytes of the file do not depend on it.",
)
@DASK
@click.option("--watch", is_flag=True, help="Render again whenever the script or a sprite changes; Ctrl-C ends it.")
@click.option("--open", "open_it", is_flag=True, help="Show the file when it is done.")
@LIMITS
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
@with_choices
def run(
    console: Console,
    *,
    choices: Choices,
    script: str,
    output: str | None,
    frames: FrameRange | None,
    at: Fraction | None,
    scale: Fraction,
    traces: tuple[str, ...],
    show: frozenset[str],
    background: str | None,
    quality: str,
    loop: int,
    transparent: bool,
    lossy: int,
    workers: int | None,
    dask: str | None,
    watch: bool,
    open_it: bool,
    max_pixels: int,
) -> int:
    """Render SCRIPT as an animation or as pictures."""
    if at is not None and frames is not None:
        raise click.UsageError("--at is one picture and --frames is a range: give only one of the two.")
    target = output_file(script, output, ".gif" if at is None else ".png")
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
        lossy=lossy,
        workers=workers,
        max_pixels=max_pixels,
    )

    def once(known: Known | None = None) -> int:
        def work(source: SourceText) -> Outcome:
            from movimentum.workflow.animate import animate

            with far_frames(dask, console) as far, console.progress("rendering") as progress:
                return animate(source, target, choices, picture, progress, known=known, elsewhere=far)

        code, outcome = carried_out(console, script, work)
        if outcome is not None:
            console.say(f"{target}: {counted(outcome.frames, 'frame')}{_weight(target)}")
        return code

    if not watch:
        if (code := once()) in (DONE, NO_SOLUTION) and open_it and target.exists():
            click.launch(str(target))
        return code
    if script == "-":
        raise click.UsageError("--watch needs a script in a file.")
    return _watch(console, script, once, target, open_it)


def _weight(target: Path) -> str:
    return f", {target.stat().st_size / 1000:,.0f} kB" if target.is_file() else ""


def _watch(console: Console, script: str, once: Callable[[Known], int], target: Path, open_it: bool) -> int:
    """Call ``once``, which writes ``target``, whenever the script or its pictures change, until Ctrl-C; returns that
    exit code. It is given what it has solved before. ``open_it``: the file is opened when it first exists.
    """
    from movimentum.cli.watch import watch
    from movimentum.solver.reuse import Known
    from movimentum.workflow.read import mentioned_files, read

    waiting, written, known = open_it, False, Known()

    def again() -> Iterable[Path]:
        nonlocal waiting, written
        try:
            code = once(known)
            written |= code in (DONE, NO_SOLUTION)
            # Opened once: most viewers follow the file, and a new window for every change would be a nuisance.
            if waiting and code == DONE:
                click.launch(str(target))
                waiting = False
        except Exception as error:  # a bug in Movimentum must not end the watching either
            console.show_bug(error)
        console.say(f"watching {script}; Ctrl-C ends it")
        try:
            return mentioned_files(read(script))
        except MovimentumError:
            return ()

    try:
        watch([Path(script)], again)
    except KeyboardInterrupt:
        if not written:
            raise  # nothing was written, and a message says so
        console.say(f"\nno longer watching {script}; {target} is as it was last written")
    return INTERRUPTED
