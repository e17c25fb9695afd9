"""Every tolerance of the package, named by the quantity it bounds.

Each says what it protects, what it is relative to, and how it was found. Nothing else holds one: where two places need
the same bound they share the name, and where two bounds only happen to be equal they have two.
"""

# --- equations: when one holds, when a matrix loses rank ------------------------------------------

# --- paths: nodes, branches, folds, ends ----------------------------------------------------------

NEARLY_SINGULAR_FOR_RATES = 1e-3
"""Reciprocal condition number below which a limit from beside the instant may be the better answer."""
ROUNDING_OF_POSES = 4e-16
"""Of poses, relative to their size: rates by the equations are off by that over the condition's power."""
LIMITS_AGREE = 1e-6
"""How well the two sides of a limit must agree, relative to the rates near by."""
SLOW_RATE = 1e-3
"""Of the fastest unknown: what is slower agrees with itself if it does on this scale."""
DERIVATIVES_ALIKE = 1e-8
"""Of the largest derivative: by how much that of fourth order may be another; that of sixth order is far better."""
ROUNDING_OF_INPUTS = 1e-13
"""Of the scene's size: the rounding in what is read."""
RESTORED = 1e-10
"""Relative residual with which a free motion is brought back onto its equations, step by step."""

# --- beginnings: which pose a path starts from ----------------------------------------------------

PROJECTED = 1e-8
"""Relative residual with which a pose that was projected onto its equations satisfies them."""
CURVATURE_OF_CONSTRAINTS = 1e-5
"""Of the unknowns' scale: the width of differences of the Jacobian."""
WEIGHT_OF_MOTION_BESIDE_TURNS = 1e-6
"""How much the anchors' motion weighs beside turns, where these are to be least."""
LEAST_POSE_DENSE = 1e-13
"""Of the size of unknowns: a step toward the least pose that ends it, where steps come from a singular value
decomposition.
"""
LEAST_POSE_SPARSE = 1e-12
"""Of the size of unknowns: the same for sparse saddle point systems, whose rounding is larger."""
REGULAR = 1e-14
"""Of a trace: what is added to a semidefinite matrix so that rounding does not make it indefinite."""
INDIFFERENT_TO_WISHES = 1e-6
"""Of the largest slope of wishes: a direction that changes them by less is left for the least pose."""
EQUATION_MET_BY_A_START = 1e-12
"""Relative residual of a solution: just beyond its reach a mechanism has poses that are nearly one."""
EQUATION_NEARLY_MET_BY_A_START = 1e-10
"""The same, where equations that follow from each other may be rounded differently."""
ROUNDING_OF_A_START = 1e-15
"""Relative residual, and of the scene's size: what Newton's method could not make better."""

# --- integrals and differential equations ---------------------------------------------------------

# --- more digits: polishing, refinement, what a tier may be off -----------------------------------

SAME_SOLUTION_POLISHED = 1e-5
"""How far, in units of its size, a solution may be moved: farther is another solution, not the same one better."""
RANK_FOR_DEFLATION = 1e-4
"""Of the largest singular value of a scaled Jacobian: one that is smaller is lost at a double root, where a float is
right to half its digits only.
"""
RANK_OF_REDUNDANT_ROWS = 1e-9
"""Of the largest singular value: what more equations than unknowns agree to in float64 is below it."""
RANK_OF_SQUARE = 1e-12
"""Of the largest singular value of a square Jacobian that is singular in float64: its rounding is below it."""

# --- planning: formulas, structure ----------------------------------------------------------------

# --- the scene and its timeline -------------------------------------------------------------------

SAME_MODULE = 1e-9
"""Of a gear's module: how much another may differ and their teeth still fit. Far above the rounding of a computed
module (1e-16), far below any difference that is meant.
"""

# --- analysis: what is free, what is wrong, what is told ------------------------------------------

# --- variants and fits ----------------------------------------------------------------------------

GOAL_MET = 1e-9
"""Of the scene's size: goals that are missed by less are met. Fits of goals that can be met end at 1e-12 or below."""
REQUIREMENT_NEARLY_MET = 1e-4
"""Of the scene's size: what a requirement may be off by before a candidate is refined."""
LEAST_OFF_FACTOR = 1.0 + 1e-4
"""Times the least that a requirement must be off: so much it may be, if goals gain by it."""
SOLVERS_AGREE = 1e-6
"""Of the scene's size: how well the two solvers agree on a variant that is believed."""
COSTS_ALIKE = 1e-4
"""Of a cost: parts of a search whose best costs are no farther apart came to the same."""
GOAL_IN_REACH = 1e-3
"""Of the scene's size: if goals that may all be met are missed by less, the search goes on."""
TINY = 1e-300
"""Keeps a quotient finite whose divisor may be 0: below anything that is measured, above what overflows."""
REQUIREMENT_EQUAL = 1e-9
"""Of the scene's size: what a required equation may be off by, as a claim."""
SAME_AFTER_A_PERIOD = 1e-9
"""Of the scene's size: what differs by no more is the same."""
SLOPE_OF_AN_IDLE_CONSTANT = 1e-12
"""In sizes of the scene, for the whole of a constant's interval: what changes by no more does not depend on it."""
RANK_OF_SLOPES = 1e-6
"""Of the largest singular value: one that is smaller belongs to a direction in which nothing changes."""
REQUIREMENT_ACTIVE = 1e-6
"""Of the scene's size: a requirement with no more to spare decides."""
GOAL_LEFT_OVER = 1e-7
"""Of the scene's size: goals that are missed by more are not met, so that curvature decides and not slopes."""
CURVATURE_STEP = 1e-4
"""Of the intervals of constants: the step of differences of slopes that give the curvature of a fit."""
NO_CURVATURE = 1e-8
"""Of the largest curvature of a fit: what is less is rounding of the differences that give it."""
SLOPE_STEP = 1e-6
"""Of a constant's interval: how far apart the variants are of which slopes are differences."""
SLOPES_AGREE = 1e-4
"""Of the largest slope: what those by the equations and by differences may differ."""
SINGULAR_FOR_SLOPES = 1e-18
"""A determinant (rows and columns of size one) below which a block's slopes are nan."""
GAIN_WORTH_A_NOTE = 1e-4
"""Of what the goals miss: a wider range that gains less is not worth a note's help."""
AT_AN_END = 1e-6
"""Of its interval: a constant that is nearer to an end stands there."""
SAME_POINT = 1e-5
"""Of the intervals: points that are nearer to each other than that are one."""
ROUNDED_UP = 1e-9
"""Of a tolerance that is proposed: what it is raised by before its last digit is rounded up, so that it holds."""
ORDER_LINEAR = 1e-12
"""What an order of times may differ from a plain difference at trial values of about 1: some roundings."""
PROGRAM_SETTLED = 1e-12
"""Of SciPy's SLSQP: a change of the cost, in its own units, that ends a program."""
LEAST_DAMPING = 1e-14
"""Of the largest diagonal element: less would leave a singular matrix singular."""
FIRST_DAMPING = 1e-3
"""Of the largest diagonal element: where damping begins (Madsen, Nielsen & Tingleff 2004, 3.2)."""
LEAST_WEIGHT = 1e-10
"""Of the largest diagonal element: what an unknown weighs at least in damping in proportion."""
GAIN_OF_A_STEP = 1e-3
"""Of the tolerance of steps: a step that gains less of the cost than that ends a fit."""
STEP_TOGETHER = 1e-12
"""Of the intervals: a step that ends a fit of variants that are solved together, at rounding."""
STEP_ONE_BY_ONE = 1e-8
"""Of the intervals: a step that ends a fit of variants that take long to solve."""
FINER = 1e-3
"""Of the tolerance of steps: that of the last fits, of few candidates."""
POLISHED = 1e-15
"""Of SciPy's least squares, for its own criteria: as near as floats come."""
POPULATION_SETTLED = 1e-8
"""Of the mean cost: the spread of a population that evolves no further."""
INSIDE = 1e-12
"""Of the intervals: how far from an end SciPy's least squares must start."""
LEAST_PLOTTED = 1e-17
"""Pixels: an error of 0 is plotted here, on a logarithmic axis."""

# --- pictures and files ---------------------------------------------------------------------------

# --- linkage files and formulas from elsewhere ----------------------------------------------------

# --- front ends -----------------------------------------------------------------------------------

CONDITION_MET = 1e-9
"""Of the scene's size: how near two sides must be for an equality in `run until`, as in a claim without `.within`."""
