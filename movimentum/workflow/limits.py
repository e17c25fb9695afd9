"""The limits beyond which a script is refused; options of the command line raise most of them."""

from __future__ import annotations

MAX_FRAMES = 1_000_000
MAX_PIXELS = 64_000_000
MAX_NESTING = 100
LARGEST_NESTING = 300
"""More than that, `MAX_NESTING` cannot be raised to."""
MAX_DIGITS = 1000
MAX_OPERATIONS = 20_000
MAX_SCRIPT_BYTES = 16 * 1024 * 1024
