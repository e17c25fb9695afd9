"""The output of a fit: the script with its new values, and pictures of before and after. Also runs the search on a
cluster.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from movimentum.advice import Choose
from movimentum.errors import usage_error
from movimentum.fitting.fit import FitJob, FitProblem, Fitted, Work, make_problem, task_done
from movimentum.fitting.search import Candidates, Task
from movimentum.output.files import whole_file
from movimentum.records import replace
from movimentum.rendering.small_multiples import SheetCell, write_small_multiples
from movimentum.scene.model import Scene
from movimentum.source import Edit, Span, edited
from movimentum.syntax.parser import parse
from movimentum.syntax.printer import float_text
from movimentum.syntax.tree import Definition, Include, Text, all_items
from movimentum.variants.plots import drawn
from movimentum.workflow.clusters import done_by, unpacked


def with_constants(scene: Scene, values: Mapping[str, float], folder: Path | None = None) -> str:
    """The script's text with ``values`` of its constants; layout and comments stay. ``folder``: where it is to stand;
    the files that it names are named from there.

    Raises `UsageError` for a constant of an included file.
    """
    source = scene.source.script
    edits: list[Edit] = []
    for constant in scene.constants:
        if constant.name not in values:
            continue
        if constant.expression.end > len(source.text):
            message = f"`{constant.name}` is a constant of an included file, which is not written"
            raise usage_error("fit/constant", message, Choose.SET.to(f"{constant.name}={values[constant.name]!r}"))
        text = float_text(values[constant.name])
        bracketed = text.startswith("-") and source.text[constant.expression.end :].lstrip().startswith(".")
        edits.append(Edit(constant.expression, f"({text})" if bracketed else text))
    if folder is not None and source.path and not source.path.startswith("<"):
        edits += _elsewhere(scene, Path(source.path).parent, folder)
    return edited(source.text, edits)


def _elsewhere(scene: Scene, home: Path, folder: Path) -> Iterator[Edit]:
    """The names of files as they are from another folder."""
    if home.resolve() == folder.resolve():
        return
    for item, _ in all_items(parse(scene.source.script).items):
        path: Text | None = item.path if isinstance(item, Include) else None
        if isinstance(item, Definition) and item.shape.word == "sprite" and isinstance(item.shape.arguments[0], Text):
            path = item.shape.arguments[0]
        if path is not None and not os.path.isabs(path.text):
            relative = os.path.relpath(home.resolve() / path.text, folder.resolve()).replace(os.sep, "/")
            text = "'" + relative.replace("'", "''") + "'"
            yield Edit(path.span if path.span.end > path.span.start else Span(item.span.start, item.span.start), text)


def write_before_and_after(fitted: Fitted, target: Path) -> None:
    """A picture of the script as it was and as it is now, in the last frame, with all of its traces; what does not move
    has a red frame.
    """
    timeline = fitted.problem.lowered.timeline
    end = timeline.frame_time(timeline.frame_count - 1)
    names, variants = fitted.problem.job.names, fitted.problem.single.variants
    rows = (("before", fitted.before, fitted.first), ("after", fitted.after, fitted.last))
    with tempfile.TemporaryDirectory() as folder, whole_file(target) as part:
        cells: list[SheetCell] = []
        for title, constants, motion in rows:
            values = dict(zip(names, constants.tolist(), strict=True))
            picture = Path(folder) / f"{title}.png"
            shown = picture if drawn(variants, values, picture, end) else None
            cells.append(SheetCell(shown, title, not motion.outcome.moves))
        write_small_multiples(cells, 2, part)


def done_there(job: FitJob, client: Any) -> Work:
    """Does parts of the search on the workers of ``client``, a `distributed.Client`; the result is the same."""

    def work(tasks: list[Task]) -> Iterator[Candidates]:
        whole = replace(job, files=replace(job.files, complete=True))  # the workers need not share our disk
        yield from done_by(client, search_part, whole, ((task,) for task in tasks))

    return work


@lru_cache(maxsize=1)
def _problem(data: bytes) -> FitProblem:
    job: FitJob = unpacked(data)
    return make_problem(job)


def search_part(data: bytes, task: Task) -> Candidates:
    """The result of one part of the search; runs on a worker."""
    return task_done(_problem(data), task)
