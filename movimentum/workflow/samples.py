"""Scripts that come with the program: one of each kind to start from, and the gallery. Copying them never overwrites
anything.
"""

from __future__ import annotations

import re
import stat
import textwrap
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path

from movimentum.advice import Choose
from movimentum.errors import UsageError, usage_error
from movimentum.output.files import made_folder, unwritable, whole_file
from movimentum.records import dataclass
from movimentum.terminal import typed
from movimentum.workflow.read import mentioned_files, read

_PACKAGE = Path(__file__).resolve().parent.parent
_STARTERS = _PACKAGE / "workflow" / "starters"
_LONGEST_TITLE = 90


@dataclass(frozen=True, slots=True)
class Sample:
    """A script of ours: its name, what it is in a line, and its file."""

    name: str
    title: str
    path: Path


def starters() -> tuple[Sample, ...]:
    """The kinds of `movimentum new`."""
    return tuple(_sample(path) for path in sorted(_STARTERS.glob("*.mov")))


def gallery() -> tuple[Path, ...]:
    """The scripts of the gallery: in a wheel they are in the package, in a checkout beside it."""
    for folder in (_PACKAGE / "gallery", _PACKAGE.parent / "scripts"):
        found = tuple(sorted(folder.glob("*.mov")))
        if found:
            return found
    return ()


def examples() -> tuple[Sample, ...]:
    """The scripts of the gallery, and those of its folders (``fits/digger``)."""
    scripts = gallery()
    if not scripts:
        return ()
    home = scripts[0].parent
    return tuple(_sample(path, home) for path in (*scripts, *sorted(home.glob("*/*.mov"))))


def named(name: str, samples: Iterable[Sample], what: str, listing: str) -> Sample:
    """The sample called ``name``, in any case; `UsageError` with the nearest one if there is none."""
    from movimentum.syntax.suggest import nearest

    found = {sample.name: sample for sample in samples}
    wanted = name.lower().removesuffix(".mov")
    if wanted in found:
        return found[wanted]
    near = nearest(re.sub(r"[\s_]+", "-", wanted), list(found))
    helps = (f"did you mean `{near}`?",) if near else (f"`{listing}` lists them",)
    raise usage_error("usage/kind", f"there is no {what} called {name!r}", *helps)


def write_starter(sample: Sample, target: Path) -> None:
    """Write a script to start from; `UsageError` if there is anything at ``target``."""
    if _taken(target):
        free = next(path for k in range(2, 10**6) if not _taken(path := target.with_name(f"{target.stem}-{k}.mov")))
        raise _exists(f"{target} exists already, and is not overwritten", Choose.OUTPUT.to(typed(free)))
    with whole_file(target) as part:
        part.write_bytes(sample.path.read_bytes())


def copy_examples(samples: Iterable[Sample], folder: Path) -> tuple[list[Path], int]:
    """Copy scripts with the files that they use into ``folder``; what is there with the same content stays.

    Returns the scripts in ``folder``, and how many files were written. `UsageError`, before anything is written, if
    there are other files of these names.
    """
    home = gallery()[0].parent
    chosen = list(samples)
    files = dict.fromkeys(path for sample in chosen for path in (sample.path, *_used_by(sample.path)))
    targets = {path: folder / path.relative_to(home) for path in files}
    wanted = {path: target for path, target in targets.items() if not _same(path, target)}
    if taken := [target for target in wanted.values() if _taken(target)]:
        more = f" and {len(taken) - 1} more of these names" if len(taken) > 1 else ""
        free = next(
            path for k in range(2, 10**6) if not _taken(path := folder.with_name(f"{folder.name or 'new'}-{k}"))
        )
        message = f"{taken[0]}{more} would be overwritten: its content differs"
        raise _exists(message, f"movimentum examples {typed(free)}")
    try:
        for path, target in wanted.items():
            with ExitStack() as stack:
                stack.enter_context(made_folder(target.parent))
                stack.enter_context(whole_file(target)).write_bytes(path.read_bytes())
    except NotADirectoryError as problem:
        raise unwritable(folder, "a part of its path is a file") from problem
    return [targets[sample.path] for sample in chosen], len(wanted)


def _sample(path: Path, home: Path | None = None) -> Sample:
    name = path.relative_to(home or path.parent).with_suffix("").as_posix()
    return Sample(name, _title(path.read_text(encoding="utf-8")), path)


def _title(text: str) -> str:
    """The first sentence of the comment at the beginning of a script."""
    comment = re.match(r"(?://[^\n]*\n)+", text)
    if comment is None:
        return ""
    words = " ".join(comment[0].replace("//", " ").split())
    return textwrap.shorten(
        re.split(r"(?<=\w)[.:] (?=[A-Z]|movimentum)|\.$", words)[0], _LONGEST_TITLE, placeholder=" …"
    )


def _used_by(path: Path) -> Iterator[Path]:
    """The pictures, drawings and other files beside a script that it names."""
    linkage = path.parent / "linkages" / f"{path.stem.removesuffix('-linkage')}.txt"
    for found in (linkage, *mentioned_files(read(str(path)))):
        if found.is_file():
            yield found


def _same(path: Path, target: Path) -> bool:
    try:
        return target.is_file() and target.read_bytes() == path.read_bytes()
    except OSError:
        return False


def _taken(path: Path) -> bool:
    """Whether there is anything at this place, even a link that leads nowhere; a device takes what it gets."""
    try:
        return not stat.S_ISCHR(path.lstat().st_mode)
    except (OSError, ValueError):
        return False


def _exists(message: str, help_: str) -> UsageError:
    return usage_error("output/exists", message, help_)
