"""Movimentum: animate mechanisms by stating what is connected to what.

    >>> import movimentum as mv
    >>> script = mv.load("scripts/slider-crank.mov")
    >>> motion = script.solve()
    >>> motion
    Motion(slider-crank.mov: 50 frames, 7 things, 0 to 2)
    >>> motion["Rod.B"].shape  # (frames, 2), world pixels, y up
    (50, 2)
    >>> motion.velocity("Rod.B").shape  # exact, not differences
    (50, 2)

The single stages are in `movimentum.stages`. Names are imported when they are first used, so ``import movimentum``
costs nothing.
"""

from __future__ import annotations

TYPE_CHECKING = False  # `typing` would be the first import of every command, when Ctrl-C is not handled yet
if TYPE_CHECKING:
    from movimentum import stages as stages
    from movimentum.analysis.contact_events import Contact as Contact
    from movimentum.analysis.gaps.overlaps import Overlap as Overlap
    from movimentum.api.arguments import Limits as Limits
    from movimentum.api.moments import Moments as Moments
    from movimentum.api.motion import Motion as Motion
    from movimentum.api.results import Fit as Fit
    from movimentum.api.results import Sweep as Sweep
    from movimentum.api.results import Written as Written
    from movimentum.api.script import Script as Script
    from movimentum.api.script import load as load
    from movimentum.api.script import loads as loads
    from movimentum.diagnostics import Diagnostic as Diagnostic
    from movimentum.diagnostics import Severity as Severity
    from movimentum.errors import MovimentumError as MovimentumError
    from movimentum.errors import NoSolutionError as NoSolutionError
    from movimentum.errors import ScriptError as ScriptError
    from movimentum.errors import UnknownNameError as UnknownNameError
    from movimentum.errors import UsageError as UsageError
    from movimentum.settings import Accuracy as Accuracy
    from movimentum.settings import FailurePolicy as FailurePolicy
    from movimentum.studio.widget import studio as studio

    __version__: str

_HOME = {
    "Accuracy": "movimentum.settings",
    "Diagnostic": "movimentum.diagnostics",
    "FailurePolicy": "movimentum.settings",
    "Fit": "movimentum.api.results",
    "Limits": "movimentum.api.arguments",
    "Moments": "movimentum.api.moments",
    "Motion": "movimentum.api.motion",
    "MovimentumError": "movimentum.errors",
    "NoSolutionError": "movimentum.errors",
    "Contact": "movimentum.analysis.contact_events",
    "Overlap": "movimentum.analysis.gaps.overlaps",
    "Script": "movimentum.api.script",
    "ScriptError": "movimentum.errors",
    "Severity": "movimentum.diagnostics",
    "Sweep": "movimentum.api.results",
    "UnknownNameError": "movimentum.errors",
    "UsageError": "movimentum.errors",
    "Written": "movimentum.api.results",
    "load": "movimentum.api.script",
    "loads": "movimentum.api.script",
}

__all__ = ["__version__", "stages", "studio", *_HOME]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in ("stages", "studio"):  # packages; the studio can be called
        return import_module(f"movimentum.{name}")
    if name == "__version__":
        globals()[name] = import_module("movimentum.version").version()
        return globals()[name]
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return sorted(__all__)
