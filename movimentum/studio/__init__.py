"""The studio: script and motion as two views of one thing. Called in a notebook, it is a live widget.

>>> import movimentum as mv
>>> try:
...     widget = mv.studio(mv.load("scripts/four-bar.mov"))
...     widget.close()
... except mv.UsageError as error:  # anywidget is an extra
...     assert error.diagnostics[0].code == "usage/extra"
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Studio(ModuleType):
    """`movimentum.studio` is this package, and the verb of the same name: one object, whatever was imported before."""

    def __call__(self, script: Any) -> Any:
        """See `Script.studio`."""
        return script.studio()


sys.modules[__name__].__class__ = _Studio
