"""Movimentum: animate mechanisms by stating what is connected to what.

From Python, a script passes through the stages like this::

    import movimentum as mv

    source = mv.SourceText("crank.mov", text)
    scene = mv.build(mv.parse(source), source, mv.image_size)
    motion = mv.solve_timeline(mv.arrange(scene))
    report = mv.examine(motion)  # diagnostics, a report for each step
    poses = motion.poses(0, motion.timeline.frame_count)

Names are imported when they are first used, so ``import movimentum`` costs nothing.
"""

from __future__ import annotations

TYPE_CHECKING = False  # `typing` would be the first import of every command, when Ctrl-C is not handled yet
if TYPE_CHECKING:
    from movimentum.analysis.examine import Examination as Examination
    from movimentum.analysis.examine import examine as examine
    from movimentum.diagnostics import Diagnostic as Diagnostic
    from movimentum.diagnostics import Severity as Severity
    from movimentum.errors import MovimentumError as MovimentumError
    from movimentum.errors import NoSolutionError as NoSolutionError
    from movimentum.errors import ScriptError as ScriptError
    from movimentum.errors import UsageError as UsageError
    from movimentum.rendering.images import image_size as image_size
    from movimentum.scene.build import build as build
    from movimentum.scene.model import Scene as Scene
    from movimentum.solver.motion import Motion as Motion
    from movimentum.solver.poses import Poses as Poses
    from movimentum.solver.solver import solve as solve_timeline  # noqa: F401  # pyright: ignore[reportUnusedImport]
    from movimentum.source import SourceText as SourceText
    from movimentum.syntax.parser import parse as parse
    from movimentum.timeline.arrange import arrange as arrange
    from movimentum.timeline.model import Timeline as Timeline

__version__ = "0.1.0"

_HOME = {
    "Diagnostic": "movimentum.diagnostics",
    "Examination": "movimentum.analysis.examine",
    "Motion": "movimentum.solver.motion",
    "MovimentumError": "movimentum.errors",
    "NoSolutionError": "movimentum.errors",
    "Poses": "movimentum.solver.poses",
    "Scene": "movimentum.scene.model",
    "ScriptError": "movimentum.errors",
    "Severity": "movimentum.diagnostics",
    "SourceText": "movimentum.source",
    "Timeline": "movimentum.timeline.model",
    "UsageError": "movimentum.errors",
    "arrange": "movimentum.timeline.arrange",
    "build": "movimentum.scene.build",
    "examine": "movimentum.analysis.examine",
    "image_size": "movimentum.rendering.images",
    "parse": "movimentum.syntax.parser",
    "solve_timeline": "movimentum.solver.solver:solve",
}

__all__ = ["__version__", *_HOME]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module, _, inside = home.partition(":")
    return getattr(import_module(module), inside or name)


def __dir__() -> list[str]:
    return sorted(__all__)
