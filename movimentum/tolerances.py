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

LEAST_DIVISOR = 1e-300
"""What is divided by is at least this: the quotient of two zeros is zero then, and nothing else changes."""
SAME_BOTH_WAYS = 1e-9
"""Of a measure's size, and of time: what a variant may differ by that is solved together with others and alone."""
CLAIM_WITHIN = 1e-9
"""Of the scene's size: the tolerance of a claim without ``.within``."""
JUMPED = 1e-7
"""Of the scene's size: what is farther from where it was at a step has jumped, or nearly."""
SAME_DIRECTION = 1e-13
"""What the cosine of a turn between two segments may be less than one: 5e-7 radians."""
BEYOND_VIOLATION, LEAST_BEYOND = 1e-9, 1e-15
"""Of a segment, and in time units: how far behind a violation another solution is looked for at first."""
LOOK_AHEAD = 1e-4
"""Of a segment (in time units, of one without length): how far ahead what meets at a beginning is told apart."""
STRICTLY_BEYOND = 1e-3
"""Of what an inequality may be off by: what just meets a strict one has to be beyond it by as much, shortly after."""
CLOSE_COSTS, COST_FLOOR = 1e-7, 1e-3
"""Costs of two beginnings that are nearer, relative to themselves and this floor, are a close call."""
SINGULAR_AT_FIRST = 1e-7
"""A determinant (rows and unknowns of size one) below which a block's solution is left to be found by itself."""
CLEAR_MARGIN = 1e-6
"""A margin below which two solutions are too near to one another for a sign to be certain."""
NEAR_A_BIND = 1e-4
"""Of the scene's size: an inequality that is nearer to equality where a variant binds may have been violated before,"""
EQUAL_AT_BIND = 1e-5
"""unless it comes to equality there: as near to it as that share of how it falls, which is 1e-12 in time."""
FOLD_MET, FOLD_STEP_DONE = 1e-11, 1e-14
"""Relative residual and last step of points on a path that is followed to its fold, and the step after which another
one is rounding."""
SHORTEST_FOLD_STEP, FIRST_FOLD_STEP = 1e-6, 1e-3
"""In units of the unknowns' scale (and of the segment's length): where steps towards a fold are given up, and the least
that the first one is."""
SURE_CORRECTION = 1e-5
"""In the same units: a correction that leads to no other path, however short the step."""
LEAST_BEND = 1e-3
"""The least curvature of a path at its fold: how fast time turns back."""
TURNED_BACK = 1e-9
"""The tangent's component of time at a fold: the error in time is of the size of its square."""
TIME_DIFFERENCE = 1e-6
"""Of the segment's length: half the width of differences by time, whose error is of the size of its square."""
MARGIN_BESIDE_FOLD, SLACK_BESIDE_FOLD = 1e-3, 1e-4
"""What the margins of other blocks, and inequalities (of the scene's size), keep on the last part of the way to a
fold."""
SINGULAR_AT_FOLD = 1e-12
"""A determinant (rows and unknowns of size one) of a path's tangent that cannot be told."""
NEARLY_ONE_CIRCLE = 1e-3
"""Of its largest value: a squared distance of a dyad's two centres, below which they may meet between instants."""
HOLDS_WITHIN = 1e-9
"""Of the scene's size: what an equation may be off by in a frame of a variant that is solved with others."""
BEFORE_FOLD = 1e-9
"""Of a segment: how far a fold may be before the last instant at which a loop was solved, by rounding."""
SAME_FORMULA, SAME_ZERO = 1e-7, 1e-9
"""What formulas of a pattern and of a variant by itself may differ by, of their values; and where these are zero."""
NEARLY_REAL = 1e-4
"""An imaginary part between that of a real root and this: two real solutions have just met, or are about to."""
SAME_ROOT = 1e-6
"""In units of the unknowns' scale: solutions of a loop that are nearer are one."""

# --- pictures and files ---------------------------------------------------------------------------

# --- linkage files and formulas from elsewhere ----------------------------------------------------

# --- front ends -----------------------------------------------------------------------------------

CONDITION_MET = 1e-9
"""Of the scene's size: how near two sides must be for an equality in `run until`, as in a claim without `.within`."""
