"""Names from other programs as names of a script."""

from __future__ import annotations

import re
from collections.abc import Callable


def script_name(word: str, prefix: str, taken: Callable[[str], object]) -> str:
    """A name that the language allows, as near to ``word`` as possible: it begins with a letter (otherwise with
    ``prefix``), and is lengthened by ``_`` until it is not ``taken``.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", word)
    name = name if re.match(r"[A-Za-z]", name) else f"{prefix}{name}"
    while taken(name):
        name += "_"
    return name
