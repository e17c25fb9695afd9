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

TINY = 1e-300
"""Smaller than any number of a scene: keeps a quotient finite where what it is relative to is zero."""
PROPORTIONAL = 1e-14
"""Of the largest coefficient: two quadratic forms that differ by less are multiples of one another, so that their
difference is a line. A hundred roundings: coefficients are products of a few numbers of the script."""
ROUND = 4e-15
"""Of a conic's mean curvature: what differs by less is a circle but for rounding (twenty roundings)."""
MODERATE = 1e-75
"""Least size of a constant that code multiplies with others beforehand (its inverse: the largest): four of them neither
underflow nor overflow."""
ROUNDED_FAR = 5e-8
"""Of how far a scene lies from the origin: what its numbers are rounded by, as large as if it were a term (of which a
redundant equation may be off by 1e-8).
"""
CANCELLED = 1e-13
"""Of a row's largest coefficient: what is left of coefficients that cancel."""
UNWEIGHTED = 1e-9
"""Of the largest weight: that of unknowns that move no anchor, so that they too stay where nothing drives them."""
DEFINITE = 1e-12
"""Of its own weight: what an unknown's weight gets besides, so that M is positive definite where two unknowns move the
same anchors. It is the relative error of a least velocity."""
DEPENDENT_TURNS = 1e-9
"""Of a row's largest coefficient: what is left of it where it follows from others."""
ROUNDING = 2.2e-16
"""Of a number: what a float64 may be off by, the distance from 1 to the next one."""

# --- the scene and its timeline -------------------------------------------------------------------

SAME_MODULE = 1e-9
"""Of a gear's module: how much another may differ and their teeth still fit. Far above the rounding of a computed
module (1e-16), far below any difference that is meant.
"""
NEAREST_TOOTH = 1e-6
"""Of a tooth: so near to the middle between two gaps, the lower one is taken, so that rounding does not choose."""

# --- analysis: what is free, what is wrong, what is told ------------------------------------------

AS_DRAWN = 1e-6
"""Of the scene's size: a drawing this near to a solution counts as drawn in it."""
SAME_INSTANT = 1e-12
"""Time units: instants that differ by rounding only."""
CLAIM_MET = 1e-9
"""Of the scene's size (its largest extent, in pixels), for a claim without ``.within``."""
CLAIM_NEARLY_MET = 1e-3
"""Of the scene's size: for a larger error, no tolerance is suggested."""
NEXT_ROUND = 1e-9
"""By which share a number is made larger before it is rounded up in a message, so that the bound really holds."""
UNCERTAIN_AT_FOLD = 1e-8
"""Where two solutions meet, rounding separates them by its own square root: no condition is reported as worse than the
inverse of that.
"""
LIGHT_WEIGHTS = (0.1, 1e-2, 1e-3, 1e-4)
"""Weights, one after the other, of a constraint that is satisfied only as far as the others allow (with the last weight
alone, the valley would be too narrow).
"""
EQUALLY_CHEAP = 1e-6
"""Of the least cost: fits that cost no more than that are the same; the first one is taken."""
UNCERTAIN_STATE = 1e-9
"""Of its largest value: an error of an integrated state that is told."""
ONE_SOLUTION = 1e-5
"""Of the scene's size (or a direction of length 1): solutions this near to each other are one solution found several
times.

Newton's method finds a double root to about 1e-8 and a triple one to about 1e-5.
"""
SOLUTIONS_PARTED = 1e-6
"""The same for two solutions that begin together: if they are this far apart shortly afterwards, they part."""
STEADY_AMOUNT = 1e-4
"""By which fraction the amount of such a contradiction may vary."""
SAME_LENGTH = 1e-9
"""Of a length: a change to it that is smaller is none."""
LOOKS_SAME = 1e-6
"""Of the scene's size (angles: of a radian, colours: of the full range): poses that look the same."""
AT_ONE_PLACE = 1e-6
"""Of the scene's size: anchors at one place."""
MOVED_AWAY = 1e-3
"""Of the scene's size: how far it has moved."""
SEEN_APART = 1e-6
"""Of the scene's size (or of a direction): smaller differences are not reported."""
STANDS_STILL = 1e-9
"""Of a value (and 1): a value that changes by less over a path is constant."""
CLEARLY_FARTHER = 1e-9
"""By which share a suggestion must separate two solutions better than the one before, so that ties go to the first."""
LEAST_JUMP = 1e-6
"""Of the scene's size, or in radians: less is never a jump."""
TURNED_DEG = 1e-6
"""Degrees: a smaller turn is rounding."""
STRETCHED = 1e-12
"""Of a length: what a best fit stretches by less, it leaves as it is."""
AT_FRAME = 1e-9
"""Of the time between frames: an instant this near to a frame is at it."""
LEAST_ROUNDED = 1e-9
"""The smallest length that is rounded for a message; only keeps a logarithm finite."""
AT_INFINITY = 1e-6
"""Of a frame: what is nearer than that to infinity is there."""
AWAY_FOR = 1e-6
"""Of a step: what is away for no longer comes back from infinity at once."""
JUDGED_BESIDE = 1e-6
"""Of a path: where a constraint is judged that has no value at an instant."""
WISH_REACHED = 1e-3
"""Of the scene's size: how far from its goal a wish may be and count as reached."""
WISH_STANDS_STILL = 1e-3
"""Of the speed with which an unhindered wish is followed: slower than that, it comes no nearer."""
WISH_ASIDE = 1e-3
"""Of the scene's size: how far a pose is pushed to see whether it is stuck or blocked."""
STRESSED = 1e-6
"""Of the largest: from here, a row takes part in a dependence among rows."""
MOVE_ALIKE = 1e-6
"""Of the fastest: velocities that differ by less are the same."""
SEEN_MOVING = 1e-7
"""Of the fastest: velocities seen by differences of poses are known to 1e-9 or so; smaller ones than this are none."""
NO_VELOCITY = 1e-9
"""Of the scene's size: where nothing moves more than that, there is no velocity to be told."""
STEP_OF_DIFFERENCE = 1e-6
"""Of a path's length (or of the scene's size): how far apart the poses are whose difference shows a velocity."""
SHORTEST_PULL = 1e-6
"""Of a whole step: a pull that would have to be shorter than that to get nearer has come to its end."""
SEEMS_ZERO = 1e-6
"""Of the largest velocity beside it: what a report calls zero, so that a slide along x is not one along (1, 1e-9)."""
ZERO_PIVOT = 1e-7
"""Of the largest entry: no pivot when the motions of a freedom are written with as many zeros as can be."""
ZERO_ENTRY = 1e-9
"""Of the largest entry of its row (or degrees): what elimination leaves of a zero."""
RANK_TOLERANCE = 1e-5
"""Of the largest singular value, rows scaled to unit gradients."""
NEARBY_SOLVED = 1e-13
"""Relative residual below which a nearby pose is a solution."""
RANK_SHIFT = 1e-12
"""Of the square of a row's length, which is one: far below the square of what still counts for rank."""
LISTED_AHEAD = 1e-6
"""Time units: solutions that begin together at an instant are told apart this far behind it."""
SAME_POSE = 1e-6
"""Of the scene's size: poses that differ by less are one."""
NEARLY_MEETS = 1e-3
"""Of how well a block is conditioned (1: perfectly): where it is worse, another solution is near."""
ARRIVED = 1e-9
"""Of the scene's size: at a smaller distance, it has arrived."""
DRAG_STANDS_STILL = 1e-3
"""Of the distance to the hand (at most the scene's size): what comes nearer at a lower rate stands still."""
DRAG_ASIDE = 1e-3
"""Of the scene's size: how far a pose is pushed to see whether it is stuck or held back, as with a wish."""
SHORT_NUMBER = 1e-15
"""Of a number: a shorter text that differs by less is written for it."""
INVARIANT = 1e-8
"""Of the scene's size: the accuracy of free motion, which is integrated; everything else is accurate to 1e-13."""

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

FRAME_VALUE = 2e-13
"""Of 1 and the largest value: what a statement that replaces a list of values may be off at a frame. A list that this
program wrote is read back exactly, and thousands of pieces become one.
"""
SIMPLE_RATE = 1e-12
"""Of a rate of frames: how far the simple fraction that is taken for it may be off; the rounding of a decimal."""
FASTEST_RATE = 1e6
"""Frames in a time unit, at most; and at least 1 in so many units. Outside, the number was not meant as a rate."""
NONZERO = 1e-300
"""A least divisor: what is divided by it is 0 then, or unimportant."""
STATED_ANGLE_DEG = 1e-9
"""Between an angle as stated and that of the coordinates: within it they are taken as equal. Coordinates of 1,000 have
angles to 1e-13.
"""
NOISE = 1e-15
"""Of the largest coordinate: a smaller one is the rounding of a sum that is zero."""
NOISE_DEG = 1e-12
"""What rounding of coordinates in the arctangents of two directions may add up to, in degrees."""
NEARLY_EQUAL_LENGTHS = 1e-4
"""Of a length: two that differ by less were equal before their coordinates were rounded (to 4 digits or more)."""
SAME_LENGTHS = 1e-12
"""Of a length: what those differ by that were computed and not rounded; they keep their mean."""
REPAIRED = 1e-12
"""Of the longest rod: what a repaired linkage may be off, a few roundings; more means that it contradicts itself."""
REPAIR_RANK = 1e-5
"""Of the largest singular value: rows of a linkage with rounded coordinates that are nearer to each other are one."""
CIRCLES_TOUCHING = 1e-12
"""Of the lengths: the gap up to which two circles, or a circle and a line, count as touching."""
CONSTANT = 1e-13
"""Of the scene's size: what a constant place or distance may vary by over the frames, a few roundings."""
STRAIGHT = 1e-12
"""Of the scene's size: what the points of a path may be off a line that counts as straight."""
SHORT_LINE = 1e-3
"""Of the scene's size (or of an arm): shorter lines give a direction with too few digits."""
TURNED_OVER = 1e-9
"""Of the scene's size (squared, for areas): the height of a triangle that is flat, not turned over; rounding of flat
triangles of good poses is 1e-12.
"""

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
