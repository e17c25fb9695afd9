"""`movimentum run`: a film or pictures."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from movimentum.cli.common import (
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
    FiniteRange,
    anchor,
    carried_out,
    far_frames,
    files,
    gathered,
    names_of_constants,
    number,
    output_file,
    words_of,
)
from movimentum.console import DONE, INTERRUPTED, NO_SOLUTION, Console
from movimentum.errors import MovimentumError
from movimentum.text import counted
from movimentum.workflow.choices import MAX_PIXELS, Choices, Outcome, Picture
from movimentum.workflow.places import PLACES

if TYPE_CHECKING:
    from movimentum.solver.solver_cache import SolverCache
    from movimentum.source import SourceText


@click.command(
    epilog="""\b
Examples:
  movimentum run crank.mov                         crank.gif, beside the script
  movimentum run crank.mov -o crank.mp4            a video (pip install 'movimentum[video]')
  movimentum run crank.mov -o crank.html           a page that plays it, without a network
  movimentum run crank.mov -o crank.html --live R,L    constants become sliders
  movimentum run crank.mov --at 2.5                crank.png, a still at time 2.5
  movimentum run crank.mov -o 'frames/%04d.png'    numbered pictures
  movimentum run crank.mov --trace Rod.B --show names,free
  movimentum run crank.mov --for slides            what slides play, and why
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
    "with %d in the name), .apng, .webp, .svg (a still with --at), .pdf (a page for each frame, one with --at), .html "
    "(a page with a player); .mp4 and .webm with the video extra.",
)
@FPS
@FRAMES
@click.option("--at", type=number, metavar="T", help="A still at time T, which may lie between frames.")
@click.option(
    "--for",
    "place",
    type=click.Choice(list(PLACES)),
    help="Choose a format, size, rate and length that this place accepts, and say why. Other options still count.",
)
@click.option(
    "--scale",
    type=FiniteRange(min=0, min_open=True),
    metavar="S",
    help="Enlarge the picture S times.",
)
@click.option(
    "--trace",
    "traces",
    type=anchor,
    multiple=True,
    metavar="THING.ANCHOR",
    help="Draw the path of an anchor, from the beginning to the moment of the frame (repeatable).",
)
@click.option(
    "--show",
    type=words_of("names", "free", "anchors", "grid", "axes"),
    default="",
    metavar="names,free,anchors,grid,axes",
    help="Draw over the picture: the names of things, what can still move, anchors; under it: a grid, axes.",
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
@click.option(
    "--text",
    type=click.Choice(["outlines", "live"]),
    help="How texts are written in an SVG or a PDF: as outlines, which look the same everywhere, or as text. Text in an"
    " SVG takes the fonts of the document around it [default: outlines; in a PDF, live].",
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
@click.option(
    "--live",
    type=names_of_constants,
    metavar="R,L",
    help="A page (-o x.html) in which these constants are sliders and the drive is a handle.",
)
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
@gathered(choices=Choices, picture=Picture)
def run(
    console: Console,
    *,
    choices: Choices,
    picture: Picture,
    script: str,
    output: str | None,
    place: str | None,
    dask: str | None,
    live: tuple[str, ...] | None,
    watch: bool,
    open_it: bool,
) -> int:
    """Render SCRIPT as a film or as pictures."""
    if picture.at is not None and picture.frames is not None:
        raise click.UsageError("--at is one picture and --frames is a range: give only one of the two.")
    if live is not None and (refused := _not_live(picture, place, dask)):
        raise click.UsageError(f"--live makes one page of the whole film: it does not go with {refused}.")
    target = output_file(script, output, ".html" if live is not None else ".gif" if picture.at is None else ".png")
    by_place = place is not None and (output is None or not target.suffix)
    named = target.with_suffix("") if output is None and by_place else target

    def once(known: SolverCache | None = None) -> int:
        nonlocal target

        def work(source: SourceText) -> Outcome:
            if live is not None:
                from movimentum.workflow.living import living_page

                with console.working("making a living figure"):
                    return living_page(source, target, live, choices, picture)
            with far_frames(dask, console) as far, console.progress("rendering") as progress:
                if place is not None:
                    from movimentum.workflow.publish import publish

                    return publish(
                        place, source, named, choices, picture, progress, None, known, far, by_place=by_place
                    )
                from movimentum.workflow.animate import animate

                return animate(source, target, choices, picture, progress, known=known, elsewhere=far)

        outcome = carried_out(console, script, work)
        target = outcome.target or target
        console.say(f"{target}: {counted(outcome.frames, 'frame')}{_weight(target)}")
        return outcome.exit_code

    if not watch:
        if (code := once()) in (DONE, NO_SOLUTION) and open_it and target.exists():
            click.launch(str(target))
        return code
    if script == "-":
        raise click.UsageError("--watch needs a script in a file.")
    return _watch(console, script, once, target, open_it)


def _not_live(picture: Picture, place: str | None, dask: str | None) -> str | None:
    """An option that a living figure has no use for."""
    given = {"--at": picture.at, "--frames": picture.frames, "--for": place, "--dask": dask}
    return next((option for option, value in given.items() if value is not None), None)


def _weight(target: Path) -> str:
    return f", {target.stat().st_size / 1000:,.0f} kB" if target.is_file() else ""


def _watch(console: Console, script: str, once: Callable[[SolverCache], int], target: Path, open_it: bool) -> int:
    """Call ``once``, which writes ``target``, whenever the script or its pictures change, until Ctrl-C; returns that
    exit code. It is given what it has solved before. ``open_it``: the file is opened when it first exists.
    """
    from movimentum.solver.solver_cache import SolverCache
    from movimentum.workflow.read import mentioned_files, read

    waiting, written, known = open_it, False, SolverCache()

    def again() -> Iterable[Path]:
        nonlocal waiting, written
        try:
            code = once(known)
            written |= code in (DONE, NO_SOLUTION)
            # Opened once: most viewers follow the file, and a new window for every change would be a nuisance.
            if waiting and code == DONE:
                click.launch(str(target))
                waiting = False
        except MovimentumError as error:
            console.fail(error)
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


PERIOD_S = 0.25


def watch(
    files: Iterable[Path], action: Callable[[], Iterable[Path]], *, sleep: Callable[[float], None] = time.sleep
) -> None:
    """Call ``action``, then again after every change of ``files`` or of the files that it returned; never returns.

    Files are checked four times a second by modification time and size. This works on every file system (including
    network drives) and costs nothing for the few files of a script. A file that disappears counts as a change, because
    editors save by replacing. ``action`` handles its own errors.
    """
    watched = set(files)
    while True:
        # The state before the work: an edit made while it was going on starts it again.
        states = {path: _state(path) for path in watched}
        watched.update(action())
        states.update({path: _state(path) for path in watched - states.keys()})
        while all(_state(path) == state for path, state in states.items()):
            sleep(PERIOD_S)


def _state(path: Path) -> tuple[int, int] | None:
    """Modification time (ns) and size, None for a file that is not there."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
