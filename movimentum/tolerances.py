"""Every tolerance of the package, named by the quantity it bounds.

Each says what it protects, what it is relative to, and how it was found. Nothing else holds one: where two places need
the same bound they share the name, and where two bounds only happen to be equal they have two.
"""

# --- equations: when one holds, when a matrix loses rank ------------------------------------------

# --- paths: nodes, branches, folds, ends ----------------------------------------------------------

# --- beginnings: which pose a path starts from ----------------------------------------------------

# --- integrals and differential equations ---------------------------------------------------------

# --- more digits: polishing, refinement, what a tier may be off -----------------------------------

# --- planning: formulas, structure ----------------------------------------------------------------

# --- the scene and its timeline -------------------------------------------------------------------

SAME_MODULE = 1e-9
"""Of a gear's module: how much another may differ and their teeth still fit. Far above the rounding of a computed
module (1e-16), far below any difference that is meant.
"""

# --- analysis: what is free, what is wrong, what is told ------------------------------------------

# --- variants and fits ----------------------------------------------------------------------------

# --- pictures and files ---------------------------------------------------------------------------

# --- linkage files and formulas from elsewhere ----------------------------------------------------

# --- front ends -----------------------------------------------------------------------------------

CONDITION_MET = 1e-9
"""Of the scene's size: how near two sides must be for an equality in `run until`, as in a claim without `.within`."""

DISPLACED = 1e-6
"""Of the scene's size: a thing that a drag moved less than this is not listed. The drag stops within a billionth."""

DRAGGED_ALONG = 1e-9
"""Of the scene's size: what a drag has moved less than this stays where the film has it, so that parts that are not
connected never stir; rounding of a solved pose is a thousandth of it.
"""

SHOWN_ZERO = 1e-12
"""Relative to the largest entry of a row, whose length is 1: smaller entries of a matrix, and singular values, are
rounding and shown as 0.
"""

SHORTEST_ROD = 1e-6
"""Pixels: a rod that is drawn from a point to the same point has no length; places are written with three decimals."""

ANGLE_WRITTEN = 1e-6
"""Degrees: a smaller angle is left out of a statement, where it would be written as 0 with three decimals."""

SHORTEST_DECIMAL = 1e-4
"""Smaller numbers have an exponent in messages, as Python writes them."""

THREAD_SWITCH_S = 0.001
"""Seconds: how often Python lets the studio's messages go before the solver; its own 5 ms are felt while dragging."""
