"""Every tolerance of the package, named by the quantity it bounds.

Each one states what it protects, what it is relative to, and how it was found. No other module defines tolerances. Two
places that need the same bound share its name; two bounds that only happen to be equal have two names. "Of the scene's
size: …" means relative to the scene's size, and so on.
"""

# --- equations: when one holds, when a matrix loses rank ------------------------------------------

TABLE_END = 1e-9
"""Of the arguments of a table: how far beyond its ends it still counts as defined. Far above what rounding makes of an
angle or a time that ends just there, far below a row.
"""
AT_REST = 1e-9
"""Of a pole's coordinates: what is less, compared with their rates in a time unit, is rounding: nothing moves."""

LEAST_DIVISOR = 1e-300
"""What is divided by (or has its logarithm taken) is at least this: smaller than any number of a scene, so that the
quotient of two zeros is zero and nothing else changes.
"""
NEWTON_STEP_DONE = 1e-14
"""In units of the unknowns' scale: a step of Newton's method that is no larger is rounding, and the last one."""
NEWTON_LAST_STEP = 1e-8
"""In the same units: after a step that is no larger no other is needed, for it would be its square."""
QUADRATIC_CONVERGENCE = 1e-3
"""Of the step before: one that is so much shorter tells that each is about the square of the last."""
NEWTON_STALLED = 1e-9
"""In units of the unknowns' scale: steps below this that no longer halve end Newton's method, where digits are lost."""
NEWTON_SOLVED = 1e-9
"""Residual of a solution, each row relative to its gradient over unknowns of their own size."""
START_EXACT = 1e-14
"""Relative residual of a start that Newton's method cannot make better."""
SAME_ROOT = 1e-6
"""In units of the unknowns' scale: solutions of a loop that are nearer are one."""
RANK_OF_ROWS = 1e-8
"""Of the largest singular value, rows and unknowns scaled to size one: a smaller one counts as zero."""
RANK_FOR_FREEDOM = 1e-7
"""The same where the freedom of a block at a pose is counted."""
LEFT_OF_RANDOM_MOTION = 1e-4
"""Of a random motion: more of it is left by the equations of a large block that has freedom."""
RANK_LOST_AT_POSE = 1e-6
"""Smallest singular value of rows of unit length, of the largest, where the rank is lost."""
POSE_BESIDE_MET, POSE_BESIDE_NEARLY_MET = 1e-12, 1e-9
"""Residual, of rows scaled alike, at which a pose beside one that lost its rank solves them; and the residual at which
it does if the last step (in units of the unknowns' scale) is below the first."""
INEQUALITY_MET = 1e-9
"""Of the scene's size: an inequality that is violated by less than that is just met."""
INEQUALITY_BLURRED = 1e-6
"""The same where two solutions meet: there rounding of a discriminant, by its root, hides whether it holds, and what
comes shortly after decides."""
FRAME_SOLVED = 1e-7
"""Of the scene's size: what a frame's constraints as stated may be off by. Far above what rounding makes of a
well-posed frame (1e-14), far below what can be seen.
"""
ROUNDING_OF_ROWS = 1e-15
"""Of each number of a row: what a solver, and the evaluation of the row, make of it by rounding."""
DISCRIMINANT_ZERO = 4e-12
"""How far below zero a relative discriminant may come by rounding; nearer to zero than this, two solutions meet."""
ROUNDING_OF_DISCRIMINANT = 2e-14
"""What rounding makes of a relative discriminant of zero: where a solution ends, it passes that, not the tolerance."""
END_LOCATED = 1e-15
"""Of an instant: how closely the end of a quadratic's solution is found, a few roundings."""
CIRCLES_ONE = 1e-13
"""Of its unit: a squared distance of two centres below which the circles count as one."""
CIRCLES_ALWAYS_ONE, CIRCLES_ONE_BUT_FOR_SPIKES = 1e-20, 1e-14
"""Of its unit: a squared distance of two centres that is never more says that the circles are one all the time; or
half of the time not more than the first, and never than the second, where digits are lost at single instants.
"""
DISCRIMINANT_UNSURE = 1e-8
"""Of its unit: a squared distance of two centres below which discriminants are not to be trusted."""
CENTRES_MAY_MEET = 1e-5
"""Of its unit: a squared distance of two centres below which they may meet between two nodes."""
UNCHANGED_BY_A_TURN = 1e-9
"""Of the scene's size (or of a full turn, if that is more): a change of a residual by a full turn that is none."""
TURNED_BACK_ROUNDING = 1e-12
"""Relative residual that a pose may gain, besides ten times what it had, when full turns are taken from its angles."""
REDUNDANT_AT_START = 1e-8
"""Of a redundant equation's terms: one that is off by more contradicts, where a path begins."""
REDUNDANT_LATER = 1e-7
"""The same along a path, whose poses are less accurate: one that is off by more does not hold any longer."""

CUBIC_FITS = 1e-4
"""Of an expression's size: what the cubic between two times may be off by in the middle, for nothing to be hidden."""
NO_INFLUENCE = 1e-9
"""Of a value's change for a change of what a statement says: less is none."""
DIFFERENCED_RATE = 1e-6
"""Of the film: half the time between the values whose difference is a rate that no equations tell."""
JUMP_ACROSS = 1e-3
"""Of the change over an interval: a value that is farther from zero where it changes its sign jumps over it."""
VALUE_TOUCHED = 1e-11
"""Of an expression's size (at least the scene's): a value that comes nearer is touched."""

# --- paths: nodes, branches, folds, ends ----------------------------------------------------------

SHORTEST_PATH_STEP = 1e-10
"""Of the interval to be followed: where even a step as short fails, the path ends."""
RATE_DIFFERENCE_ON_PATH = 1e-6
"""Of the mean distance between nodes: half the time between the instants whose difference gives a rate on a path."""
SINGULAR_ON_PATH = 1e-9
"""Smallest singular value, of the largest, below which a Jacobian on a path is singular."""
RANK_FOR_VELOCITY = 1e-11
"""Of the largest singular value: directions of a Jacobian with a smaller one have no part in a path's velocity."""
AWAY_FROM_SINGULAR = 1e-7
"""Smallest singular value, of the largest: nearer to a singular pose a block alone does not tell where a path goes."""
DEPARTED_FROM_SINGULAR = 1e-6
"""Smallest singular value, of the largest: so far from a singular pose that steps can be trusted."""
SINGULAR_FOR_RATES = 1e-13
"""Reciprocal condition number of a Jacobian below which it tells nothing about rates."""
RESTING_ON_PATH = 1e-10
"""Of the unknowns' scale: what a step may be off by even where nothing moves."""
ACCELERATION_SPAN = 1e-3
"""Of a step: over how much of it an acceleration is measured."""
CARRIED_VELOCITY_SPAN = 1e-6
"""Of a piece's length: how far apart the two poses are that carry a velocity on to the next piece."""
SHORT_PIECE = 1e-7
"""Of a segment: a piece that is shorter ends where it begins."""
LEADS_FARTHER = 1e-3
"""Of the rest of a segment: a plan made anew has to lead farther by more than this."""
BEYOND_TABLE = (0.0, 1e-6, 1e-3, 1e-2)
"""Of a step, after a motion has lost its value: where it is looked for what a table was asked beyond its ends."""
WITHOUT_VALUE_AT_ONCE = 1e-12
"""Of a path: where something has no value for no longer than this, as sin(t)/t at zero, the path does not end."""
SIDES_AGREE = 1e-6
"""Of the unknowns' scale: how well must agree what both sides of an instant without a solution extrapolate to."""
CROSSING_BLURRED = 1e-6
"""Of the time in which the motion goes one unit of its scale: so near to a crossing rounding hides on which path a
solution lies."""
NEAREST_DEPARTURE, FARTHEST_DEPARTURE = 1e-5, 0.02
"""Of the interval: how far from a singular pose that a path begins at the next point is looked for."""
DEPARTURES_MIRRORED = 1e-6
"""Of the square of the shortest way from a singular pose: ways no longer than that mirror each other, and which is
taken does not depend on the order of the statements."""
FIRST_JUMP_ACROSS = 1e-6
"""Of the interval: the first jump past a singular point, doubled until one lands."""
LAST_JUMP_PAST_A_KINK = 1e-3
"""Of the interval: the longest jump past a kink of a block's equations."""
KINK_LED_BACK = 1e-3
"""Of such a jump: how near to the kink the path beyond it is followed back. Where it stands still there, as on a cusp,
it goes with the power 2/3 of the time: a hundredth of what it moves in the jump is left."""
KINK_MET = 0.05
"""Of what a path moves in such a jump: how near to the kink's place it comes back."""
LANDING_PLACE_ROUNDING = 1e-12
"""Of the unknowns' scale: what a landing past a singular point may be off by however little moves."""
LANDING_RATE_ROUNDING = 1e-12
"""The same of its velocity, per unit of time."""
FOLD_CLOSED = 1e-12
"""Relative residual at which a pose still counts as one at the very end of a path."""
FOLD_BEYOND_PATH = 1e-5
"""Of the interval: how far from the last step of a path its end, a fold, may be."""
FOLD_DIFFERENCE = 1e-5
"""Of the unknowns' scale: half the width of differences of the Jacobian at a fold."""
FOLD_POSE_DONE, FOLD_TIME_DONE = 1e-12, 1e-15
"""In units of the unknowns' scale, and of the interval: steps towards a fold below these are rounding."""
FOLD_DIRECTION_MET = 1e-9
"""What the Jacobian at a fold, rows and unknowns of size one, may make of the direction that it loses."""
RATE_DIFFERENCE_AT_FOLD = 1e-8
"""Of a path's length: half the time between the instants whose difference gives a rate where a branch begins."""
BRANCH_MET = 1e-11
"""Relative residual of a solution beside a singular pose; a smaller excess of the bordered equations has no sign."""
BRANCH_SETTLED, BRANCH_SETTLED_AFAR = 1e-3, 1e-6
"""Of `BRANCH_MET`, and of the distance from the singular pose: a last step below their sum has settled."""
SECOND_RANK_LOST = 1e-6
"""Of the largest singular value: where the second smallest is less too, more than one rank is lost at a pose."""
BRANCH_IDENTIFIED_BEFORE, BRANCH_IDENTIFIED_AFTER = 1e-6, 1e-9
"""Of the interval: how long before its end a path's pose tells which branch it is on, and how long after its beginning
that can be determined where the two meet."""
CLEAR_OF_FOLD, BARELY_REGULAR = 1e-5, 1e-7
"""Of the largest singular value: a pose with a smaller one is as good as at a fold; from one with less than the second
a path cannot be followed."""
FIRST_RESUMPTION = 1e-10
"""Of the interval: the first time after a path's end that is tried, then twice as far, then node by node."""
SMALL_LOOP_CORRECTION = 1e-4
"""In units of the unknowns' scale: a correction of a loop's prediction that is always sure, for nothing else is so near
where the Jacobian is sound."""
DIVISOR_VANISHES = 1e-9
"""Of what it is at the nodes beside: a divisor that comes so near to zero, without a change of sign, is zero."""
NEAREST_GROWTH_AT_POLE, FARTHEST_GROWTH_AT_POLE = 1e-7, 1e-3
"""Of the way to the next nodes: from where to where the growth beside a pole is looked at."""
NEAREST_NODE_AT_POLE = 1e-9
"""Of the way to the next nodes: the nearest of the nodes beside a pole, between which nothing changes by more than
about 2."""
NEAREST_LOOK_AT_POLE = 1e-13
"""Of the way to the next nodes: the nearest place to a pole where is looked at how far something is."""
LEAST_POLE_WIDTH = 8 * 2.2e-16
"""Of the time, eight roundings: how wide a pole is at least, to both sides. Nearer, its time is not known."""
ROUNDING_OF_DENSE_TANGENT, ROUNDING_OF_SPARSE_TANGENT = 2e-16, 1e-14
"""Of the largest unknown: residuals of a free block below these cannot be made smaller by steps from a singular value
decomposition, and from a sparse factorisation."""
CORRECTION_AT_ROUNDING = 1e-14
"""Of the largest unknown: a residual of a free block that need not be looked into if it shrinks no more."""
CORRECTION_STALLED = 1e-8
"""Of the largest unknown: a residual below this that a fresh linearisation does not halve ends the steps."""
WISH_DIRECTION_LOST, WISH_DIRECTION_FOUND = 1e-5, 1e-4
"""Of the strongest direction of some wishes: where another is not followed at all (rounding would choose the way), and
from where it is. In between it comes to be.
"""
WISH_ROUNDING = 1e-12
"""Of the wishes that cannot be followed: less in another direction is taken for none."""
ROW_RELAXED = 1e-10
"""The square of the relative singular value at which rows begin to be taken for redundant."""
SOFT_ROW_RELAXED = 1e-5
"""The same for a row that is to be met after all others only."""
VELOCITY_REFINED = 1e-12
"""Relative to what was wanted: a velocity's rows that are met better need no refinement."""
FREE_MOTION_STEP, LARGE_FREE_MOTION_STEP = 1e-10, 1e-9
"""Error of a step of a free motion, in units of the unknowns' scale; that of large blocks, whose steps take long."""
COARSEST_FREE_MOTION_STEP = 1e-5
"""In the same units: the error of steps where accuracy is given up, at most."""
FIRST_FREE_MOTION_STEP = 1e-3
"""Of the distance between two nodes: the first step of a free motion."""
FREE_MOTION_AT_NODE = 1e-12
"""Of the whole way: a step of a free motion that ends nearer to a node than that ends at it."""
VELOCITY_STEPS = (2.5e-2, 2.5e-4, 2.5e-6)
"""Of the mean distance between two nodes, between which little turns: the distance between two instants whose poses
tell a free velocity. The first choice that shows no kink is taken, or else the best: shorter ones have more rounding,
longer ones more kinks."""
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

FIRST_POSE_MEETS = 1e-9
"""Of the unknowns' sizes, and of the scene's for rows that are not linear: what the pose to begin with may be off
by."""
TURN_COEFFICIENT_ZERO = 1e-12
"""What elimination leaves of a zero among the coefficients of equations about angles, which are about one."""
TURN_COEFFICIENT_WHOLE = 1e-12
"""How near to a whole number a coefficient of an angle is one."""
DEPENDENT_LINEAR_ROW = 1e-9
"""Of a linear row's unit length: what is left of one that depends on others."""
FIT_ROW_MET = 1e-9
"""Residual of a row of unit gradient over unknowns of size one, where a fit meets it."""
FIT_MET = 1e-24
"""Sum of squared residuals at which a fit ends, and a difference of such sums that is none."""
FITS_AS_GOOD = 1e-6
"""Of the least sum of squares: fits that are larger by no more are as good, and the first of them is taken."""
FIT_STEP_DONE, FIT_FALL_DONE = 1e-11, 1e-13
"""In units of the unknowns' scale, and of the sum of squares: a step, and its gain, that end a fit of a start."""
FIRST_DAMPING_OF_A_START, LEAST_DAMPING_OF_A_START = 1e-3, 1e-14
"""Where the damping of such a fit begins, rows and unknowns of size one, and what it does not fall below."""
PULLS_IN_FIT = 1e-5
"""Of the largest residual of a best fit: a row that pulls less has no part in the contradiction."""
SAME_FIT_END = 1e-3
"""Of a residual: fits whose residuals differ by less ended at the same place."""
ROW_IN_CERTIFICATE = 1e-7
"""Of the largest multiplier: rows with more are those that add up to a contradiction."""
CANDIDATES_APART = 1e-6
"""Of an unknown's size: a difference of two beginnings that can be seen."""
TURNS_ALIKE = 1e-6
"""Of the squared turn: two paths that turn as far as each other."""
SAME_VALUE = 1e-7
"""Of its size: two values of an unknown that differ by no more are the same solution."""
SPELLING_WEIGHT = 1e-9
"""What settles which of several spellings of one pose is taken: the smaller angles, without full turns, and variables.
Far below any difference of poses that decides, far above what rounding leaves of one.
"""
SAME_AS_FIRST_POSE = 1e-5
"""In units of the unknowns' scale: a solution nearer than that to the pose to begin from is that pose."""
FIRST_SOLUTION_NEAR = 1e-3
"""In units of the unknowns' scale: a solution nearer than that to the pose carried over is the only start needed."""
MOBILE_SOLUTION_MET = 1e-6
"""Relative residual of a singular solution, to which Newton's method comes slowly, that may be able to move."""
MOBILE_SOLUTION_NEAR = 1e-2
"""In units of the unknowns' scale: how far such a solution may be away, with an error that is its square."""
LOOP_CLOSED = 1e-6
"""Of the sizes of a row's terms: what a pose that satisfies the row may be off by, where drawn loops are compared."""
PART_FITS = 1e-6
"""Of the scene's size: what a part may be off by where it is laid, to count as fitting."""
PLACEMENT_DIFFERENCE = 1e-4
"""Radians, and of the scene's size: the step of differences by the place of a part."""
PLACEMENT_STEP_DONE = 1e-13
"""In the same units: a step that ends the search for the place of a part, a few hundred roundings."""
RANK_FOR_PLACEMENT = 1e-7
"""Of the largest singular value: what a part's rows determine no better is left as it is."""
SHORTEST_LEADING_STEP = 1e-3
"""Of the way: where so short a step fails, there is no solution further on."""
LEADING_DIFFERENCE = 1e-6
"""Of the way: half the width of differences along it."""
STRAIGHT_DRIVE = 1e-6
"""Of its length: how far from a straight line what goes along it may be."""
WEAK_WISH_AT_FIRST = 1e-3
"""Of the strongest direction of wishes: how weak another may be where a path begins and still be followed exactly.
Steps are limited there anyway."""
REAL_ROOT = 1e-7
"""In units of the unknowns' scale: the imaginary part of a solution by continuation that counts as real."""
PREDICTOR_OFF, PREDICTOR_AIM = 1e-2, 1e-4
"""Of a complex path's size: how far the predictor may be off, and how far it well may."""
NEGLIGIBLE_COEFFICIENT = 1e-14
"""A coefficient of a polynomial equation that is left out when its degree is counted: rounding."""
HOMOTOPY_DIFFERENCE = 1e-5
"""Of a complex path [0, 1]: half the width of differences by its parameter."""
HOMOTOPY_STEP_MET, HOMOTOPY_STEP_DONE = 1e-8, 1e-12
"""Of a complex path's size: the last step of Newton's method for a point of the path; one that need not shrink."""
HOMOTOPY_STEP_AT_INFINITY, SHORTEST_HOMOTOPY_STEP = 1e-9, 1e-12
"""Of a complex path [0, 1]: a large path with steps as short as the first ends at infinity; any path with steps as
short as the second cannot be followed."""
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
LEAST_POSE_SETTLED = 1e-10
"""Of the size of unknowns: where a last step is longer, a variant's pose is looked for by itself."""
FREE_STARTS_CLOSE = 2e-9
"""Of the squares, rounded to nine digits, of what is off in two poses: no difference."""
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

INTEGRAL_AIM, COARSEST_INTEGRAL_AIM = 1e-13, 1e-5
"""What the two halves of an interval may differ by from the whole, relative to the largest; and at most, where what is
integrated is known less well."""
INTEGRAND_ROUGH = 1e-12
"""Of an integral: what may be missed at the ends of intervals, across variants."""
INTEGRAND_JUMP = 1e-3
"""Of the change over an interval: what is left of it in no time at all is a jump."""
INTEGRAND_END = 1e-9
"""Of an interval: how far from its ends the integrand is looked at, so that it is this side of a jump there."""
STATE_STEP = 1e-12
"""What the polynomial's slope may be off by between the points of a step, times the step, of a state's size: see
decision 32."""
ROUNDING_OF_RATES = 1e-14
"""Of each number of a state's rate: what rounding makes of it, and of the polynomial through some of them (which may
be ten times as much). A state in balance has a rate that is nothing else.
"""
LEAST_STATE_ERROR = 1e-12
"""Of `STATE_STEP`: the least error from which the next step's length is computed."""
SMALL_STATE = 1e-3
"""Of the largest state: a state that is smaller (a spring that the motion has not reached) counts as this large."""
SMALL_STATE_ERROR = 1e-6
"""Of the largest state: the error of smaller ones is reported relative to this."""
SHORTEST_STATE_STEP = 1e-12
"""Of the interval: where a step as short as this fails, its slope at the beginning is taken for all of it."""
SWITCHES_AT_ONCE = 1e-6
"""Of the interval: where a dozen of the shortest steps lie within this part of it, something switches to and fro, and
there is no solution."""
STATES_AT_END = 1e-14
"""Of the interval: a step that ends nearer to its end than that ends at it."""
COLLOCATION_MET = 1e-15
"""Of the states' sizes: a change of a step's points that is smaller is rounding."""
COLLOCATION_NEARLY_MET = 1e-12
"""The same of the change before the last one."""
COLLOCATION_LAST_CHANGE = 1e-8
"""The same of a change by Newton's method: the next one would be its square."""
COLLOCATION_SETTLED = 1e-14
"""The same where each change is a fraction of the one before."""
CORE_BEND = 1e-5
"""Of its scale: by how much the core may differ from its polynomial between two points before it counts as another
branch."""
RUNAWAY_TIME = 1e-3
"""Of the interval: a state that grows a hundredfold in so short a time runs away."""

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

# --- outlines: curves, corners, contact -----------------------------------------------------------

FLATTENED = 0.01
"""World pixels between a curve and the straight pieces that are drawn for it: half of what may be seen."""
OUTLINE_CLOSES = 1e-9
"""Of an outline's size: ends that are so near are one point; far above rounding, far below what can be drawn."""
OUTLINE_CORNER = 1e-7
"""Radians: a direction that jumps by less is no corner; a direction is known to about 1e-9 beside a cusp."""

OUTLINE_SAMPLED = 1e-3
"""Of an outline's size: between straight pieces that are within it, the nearest place is looked for."""
BESIDE_AN_END = 1e-6
"""Of a piece of an outline: how far beside its end its direction is measured, where it stands still at the end."""
CUSP_SLOW, CUSP_STANDS = 0.1, 1e-9
"""Of its fastest: where a curve's parameter moves it more slowly it is looked whether it stands still, and so slowly
it does.
"""
SHORTEST_PIECE = 1e-9
"""Of the range of a parameter: pieces between two kinks that are shorter are none."""
KINK_AS_SAID = 1e-12
"""Of its size: a kink that bisection finds so near to a short binary number is there."""

CUT_EXACT = 1e-9
"""Of the size of what is cut: how far a profile's curve may be from exact points half-way between two of its own."""
CUT_ALONG = 1e-6
"""Of the size of what is cut: ends of pieces of a profile that are so near meet; they are known to `CUT_EXACT`."""
CUT_RESTS = 1e-11
"""Of the fastest motion (or of a point's own speed): what is slower is rounding."""
CUT_MATCHED = 0.03
"""Of the size of what is cut: a point of the envelope that moves by more between two instants is another one."""
CUT_BESIDE = 1e-4
"""Of the size of what is cut: how far beside a profile it is asked whether the tool comes there. More than a polygon
that stands for the tool is off (2e-5), less than can be seen."""
CUT_LINKED = 0.02
"""Of the size of what is cut: pieces of a profile whose ends are farther apart do not belong together."""
CUT_CROSSED = 0.01
"""Of the size of what is cut: a piece of a profile that was not cut off must be so much nearer to go on from one
that was."""
CUT_SMOOTH = 1e-6
"""Radians: where pieces of a profile meet at a smaller angle, there is no corner."""
CUT_AS_NEAR = 1e-9
"""The scene's units: pieces of a profile that are nearer to its end by less are as near; the longest goes on."""
CUT_CROSSES = 1e-6
"""Of a straight piece's length: how far beyond its ends two pieces of a profile still cross."""
CUT_WOULD_DO = 0.9995
"""Of the radius at which a profile begins to cross itself: so large a roller is said to fit, in four digits."""
CUT_CURVED = 1e-9
"""Of a tool's size: a profile that bends the wrong way by less does so by rounding."""
CUT_TURNS = 0.3
"""Radians: a profile that turns farther from one of its points to the next is not told by its curvature there."""
CUT_STRAIGHT = 1e-9
"""Of a sine: a corner of a tool's outline that turns by less is on a straight line."""

OVERLAP_REPORTED = 1e-6
"""Of the scene's size: outlines that touch at one place and overlap by less at another are said to touch at both."""
GAP_TOUCHES = 1e-9
"""Of the scene's size: things that overlap by no more touch; equations hold to about 1e-13 of it. Also of the time: two
overlaps that follow each other after no more than this are one."""
GAP_CLOSED = 1e-13
"""Of the scene's size: a distance that is less is 0 where its root is looked for; poses are known to as much."""
TRACK_FOLLOWS = 1e-12
"""Of the scene's size: how far a polynomial through poses may be from another pose, if it tells all poses between."""
TRACK_NOISE = 1e-7
"""Of the scene's size: poses that are off a polynomial by less, and no less in half its interval, are not known better;
integrated ones are known to about 1e-8.
"""
GAP_FLAT = 1e-12
"""Of the scene's size: a depth that changes by no more around its greatest value is known."""
ROUGH_FLAT = 1e-4
"""Of a depth of outlines that are not convex, which is reported to four digits: the same."""
INSTANT_ROUNDS = 1e-14
"""Of the time: two instants between which there is hardly another float."""
EDGES_CROSS = 1e-3
"""Of the smaller outline's size: how deep edges count as that cross while no corner is in the other outline; enough to
tell it from touching. Roots do not depend on it.
"""
EDGES_MEET = 1e-9
"""Of the size of outlines that become one: points that are so near are one, and edges lie on each other; above the
rounding of crossings (1e-13), below what can be meant.
"""
EDGES_CROSS_AT = 1e-4
"""Radians: edges that meet at less touch, and do not cross: they are within `EDGES_MEET` for about its square root."""
EDGE_IS_ARC = 1e-13
"""Of an edge's size: an edge that is nowhere farther from an arc is one, by rounding."""
STAYS_PINNED = 1e-9
"""Of the scene's coordinates: anchors that are never farther apart share a pin."""
LINE_TURNS_BACK = 1e-6
"""Degrees: a line whose direction turns back by so nearly half a turn goes round its end, on the outside."""
FACETS_TOUCH = 1e-10
"""Of an outline's size: polygons that overlap by no more touch; what parts them is found to about 1e-13."""
PLACES_MEET = 1e-9
"""Of an outline's size, and of directions: what the rows of a contact may be off where Newton's method has found it."""
STRIDE_NOT_LEFT = 1e-3
"""Of a stride of what pushes: less than that before the end of a phase is not left for a stride of its own."""
PAST_AN_END = 1e-9
"""Of an open outline: how far beyond its end a place of contact is still at the end, where rounding may put it."""
AT_OUTLINE_END = 1e-6
"""Of an open outline: a motion that ends so near to its end has come to it; times of events are known to about 1e-9."""
PLACED_ELSEWHERE = 1e-6
"""Of outlines' sizes: a solution whose place of contact is farther away than the nearest one by more touches somewhere
else. Places that are as near are found to about 1e-9."""
PLACE_ROUNDS = 1e-10
"""Of the same range: steps of Newton's method that are less, and do not become less, are rounding."""
SLOWEST_PACE = 0.05
"""Of a curve's mean pace: where it is slower somewhere it may have a cusp, and lengths are found for shorter pieces. A
cusp between two of 720 places has a pace of some 0.005 of the mean at the nearer one; an ellipse is as slow if it is
twenty times as long as wide."""
EVEN_PACE = 1e-13
"""Of a curve's length: a parameter that is a length but for so little is one, but for rounding."""
CUSP_PACE = 1e-7
"""Of the same pace: a curve that is slower stands still there, and its direction turns round. The least of a speed that
is found to rounding is some 1e-8 of the mean; one that is not 0 and so small is a bend of 1e-14 of the curve."""
PLACE_FOUND = 1e-15
"""Of the range of an outline's parameter: a place that moves by no more is found; that is a float's last digit."""

# --- analysis: what is free, what is wrong, what is reported ------------------------------------------

AS_DRAWN = 1e-6
"""Of the scene's size: a drawing this near to a solution counts as drawn in it."""
SAME_INSTANT = 1e-12
"""Time units: instants that differ by rounding only."""
CLAIM_MET = 1e-9
"""Of the scene's size (its largest extent, in pixels), for a claim without ``.within``."""
NO_DIRECTION = 1e-12
"""Of the longest that a vector is in a film: where it is shorter it is zero but for rounding, and has no direction."""
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
"""Of its largest value: an error of an integrated state that is reported."""
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
"""Of the scene's size: where nothing moves more than that, there is no velocity to be determined."""
STEP_OF_DIFFERENCE = 1e-6
"""Of a path's length (or of the scene's size): how far apart the poses are whose difference shows a velocity."""
SHORTEST_PULL = 1e-6
"""Of a whole step: a pull that would have to be shorter than that to get nearer has come to its end."""
PULLED = 1e-3
"""Of the unknowns' scale: the error of a step of what a hand pulls and inequalities push; the next move mends it."""
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
SLOPE_STEP_OF_FREE_MOTION = 1e-4
"""The same where free motion is integrated: its paths are right to some 1e-8 of the scene, and the next variant may
have other steps. A millionth of an interval would be lost in that."""
SLOPES_AGREE = 1e-4
"""Of the largest slope: what those by the equations and by differences may differ."""
SINGULAR_FOR_SLOPES = 1e-18
"""A determinant (rows and columns of size one) below which a block's slopes are nan."""
GAIN_WORTH_A_NOTE = 1e-4
"""Of what the goals miss: a wider range that gains less is not worth a note's help."""
AT_AN_END = 1e-6
"""Of its interval: a constant that is nearer to an end stands there."""
SAME_PLACE_OF_DRAWING = 1e-6
"""Of a drawing's size: ends of lines that are nearer are one joint. Drawings have some eight digits."""
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
SAME_BOTH_WAYS = 1e-9
"""Of a measure's size, and of time: what a variant may differ by that is solved together with others and alone."""
SAME_BOTH_WAYS_FREE = 1e-8
"""The same where something moves freely: its path is integrated in steps that are off by `FREE_MOTION_STEP` each."""
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
"""A determinant (rows and unknowns of size one) of a path's tangent that cannot be determined."""
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
# --- pictures and files ---------------------------------------------------------------------------

NO_ARROW = 1e-9
"""Pixels: an arrow without a longer last piece, or head, is drawn as a line."""
NO_REACH = 1e-12
"""Pixels: a symbol whose ends are no farther apart lies along x."""
LEAST_ARROW = 1e-9
"""Pixels: an arrow counts as at least so long where it is divided by its length, to place the text beside it."""
SAME_TURN_DEG = 1e-9
"""Degrees: a corner of an outline whose arc ends before it begins by less has no turn, rather than a full one."""
NO_DASH = 1e-6
"""World pixels: a last dash that is shorter is what rounding leaves of a line that is as long as its pattern."""
LEAST_ARC_RADIUS = 1e-9
"""The radius from which an arc's number of straight pieces is computed, at least; only keeps it finite."""
FOLLOWED_FAR_AWAY = 1e-3
"""Of its distance: how closely a path is followed that is far outside the scene."""
UPRIGHT = 1e-6
"""Of 1: a text whose placement is turned or scaled by less is drawn at whole pixels, so its letters stay sharp."""
TURNS_BACK = 1e-9
"""What the cosine of a turn of a line may be above -1 (the turn: half a full one but for 4e-5 radians)."""
LEAST_ROUNDED_RADIUS = 1e-3
"""Pixels: the radius from which an arc's number of straight pieces is computed, at least; nobody sees a smaller one."""
SAME_SCALE = 1e-6
"""Of a scale: a drawing whose scales along x and y differ by less keeps its proportions."""
PART_OF_A_PIXEL = 1e-6
"""Pixels: a drawing's size that is larger than a whole number by less is that number."""
LEAST_CHORD = 1e-9
"""Pixels in which letters are traced: a chord counts as at least so long where distances from it are computed."""
LEAST_WEIGHT_OF_COLORS = 1e-9
"""The weight of a group of colours (roots of counts of pixels), at least, where it is divided by; a group without any
keeps its middle.
"""
ONE_COLOR = 1e-3
"""Squared steps of a colour's 256, times weights: a group of colours with less scatter is not split."""
TICK_AT_END = 1e-9
"""Of the distance between two ticks: one that is outside a plot's range by less is at its end."""
GOLDEN_PLACE = 1e-8
"""Of the scene's size: how far an anchor may be from where it was. A millionth of a pixel in a scene of 100 pixels."""
LEAST_AGREEMENT = 1e-9
"""Pixels: the least bound that is reported on how well the other anchors agree."""
DIFFERING_PIXELS = 1e-5
"""Share of the pixels that may differ from a golden picture by more than rounding, if the renderer is the same."""
FRAME_LEAD_S = 0.001
"""Seconds by which a film is ahead of its frames' times: at the very time of a frame, the frame is shown, and not
by an error of rounding the one before.
"""

# --- linkage files and formulas from elsewhere ----------------------------------------------------

FRAME_VALUE = 2e-13
"""Of 1 and the largest value: what a statement that replaces a list of values may be off at a frame. A list that this
program wrote is read back exactly, and thousands of pieces become one.
"""
SIMPLE_RATE = 1e-12
"""Of a rate of frames: how far the simple fraction that is taken for it may be off; the rounding of a decimal."""
FASTEST_RATE = 1e6
"""Frames in a time unit, at most; and at least 1 in so many units. Outside, the number was not meant as a rate."""
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


BESIDE_CONSTANT = 1e-4
"""By about which share constants are changed that a proof leaves open: enough for no two of them to be in a simple
ratio, little enough for the mechanism to be put together as before."""

NEARBY_POSITION = 1e-3
"""The smallest share by which drives are changed where other positions of a mechanism are looked at."""

FILM_POSE = 1e-6
"""By how much a pose that is computed exactly may be off the film's pose that it was computed from, of its size."""

CLEAR_OF_ROUNDING = 33
"""A polynomial of a pose of the film is not zero where it is larger than its largest term times 2 to the minus this."""

GUESSED_DIRECTION = 1e-9
"""Degrees by which a constant direction may be off the number that it is then proved to be."""

SHORTEST_STRETCH = 1e-9
"""Between two change points that are nearer than this share of a step there is no motion to prove anything of."""

INDEPENDENT_EQUATIONS = 1e-8
"""Equations scaled to one size determine as many unknowns where the last pivot is at least this share of the first."""

APART_IN_NAME_ONLY = 2e-13
"""By about which share a constant that keeps its name is told apart from all other numbers: nothing else notices."""

ZERO_IN_NAME_ONLY = 1e-11
"""What stands for a constant that keeps its name and is 0."""

POSES_AGREE = 1e-6
"""Of the scene's size: a living figure's poses are those of the solver if they differ by less."""

STEP_HAS_BEGUN = 1e-9
"""Time units: an instant that is so little before a step, or before a thing appears, belongs to it."""

SMALLEST_VIEW, LARGEST_VIEW = 0.001, 1000.0
"""How much smaller and larger a camera or an inset may show things."""

SAME_QUARTER = 1e-9
"""Of a quarter turn: an arc of an SVG that is longer by less is not cut once more."""

SAME_ZOOM = 1e-6
"""Logarithm of the ratio of two zooms between which the camera only moves: a quotient for zooms loses its digits."""

SAME_SCALE_OF_TEXT = 1e-9
"""Of the size of a text: a camera that makes it larger by less shows the text as it is."""

SAME_TICK = 1e-6
"""Of the range of a graph (or of a quarter turn): a tick this close to its end is at its end."""

ONE_VALUE = 1e-9
"""Of its size: a value of a graph that changes less is one value; a tick that is off its step less is on it."""

SHORTEST_TICK = 1e-4
"""Numbers at the ticks of a graph that are smaller have an exponent."""

POLE_AT_INFINITY = 1e-12
"""Of the velocity that two bodies have relative to each other: if they turn less, their pole is at infinity."""
STRAIGHT_ARC = 1e-9
"""Of squared lengths: twice the area of three points of an arc below which it is drawn straight."""

UNWRAPPED_DEG = 1e-7
"""Degrees: a cord that goes round a wheel by less than minus this does not touch it; roundings of two directions are
some 1e-13.
"""

NO_WRAP_DEG = 1e-6
"""Degrees: a cord that touches a wheel in one point goes round it by 0 within this, and not by a whole turn."""
UNWRAPPED_AT = 1e-12
"""Of the time, at least of one time unit: how exactly the instant is found at which a cord leaves a wheel."""
# --- certificates: enclosures with proved bounds --------------------------------------------------

UNIT_ROUNDOFF = 2.0**-53
"""Of a result: what one operation on floats may be off by (IEEE 754, rounding to nearest)."""

RADIUS_UP = 2.0**-48
"""By which share a radius is made larger: thirty roundings, which is more than any of its formulas has."""

LEAST_RADIUS = 1e-300
"""Added to every radius: more than underflow takes away."""

NEAR_END_OF_ANGLE = 1e-9
"""Degrees: a direction so near to 180 may be on either side, where its angle starts again."""

ROOM_IN_TUBE = 1e-12
"""In units of an unknown's scale: what a tube is wider than it need be, far more than an instant's own enclosure is."""

ROOM_AT_INSTANT = 1e-15
"""The same at a single instant."""

FINEST_CELL = 1e-9
"""Of an outline's length: cells in which its nearest point is looked for are not made smaller; at that, a distance is
known to a hundredth of what `check` allows."""

JUMP_IN_TUBE = 1e-9
"""Of the scene's size: what a statement may jump by where its cases change. It is the rounding of a kink."""

FRAME_CERTIFIED = 1e-6
"""Of the scene's size: a frame farther from the exact solution is wrong. Poses of standard accuracy are off by 1e-12
of it, near a change point by 1e-8."""

NARROWEST_TUBE = 2.0**-26
"""Of a stretch of the film: where a tube would have to be shorter, it cannot be continued."""

MARGIN_KNOWN = 1e-3
"""Of a bound's margin: how sharply it is reported."""

NEAREST_BOUND = 1e-12
"""Of the scene's size: how near to a bound that must not be reached its largest value is looked for."""

# --- what pushes

PUSH_FEASIBLE = 1e-13
"""The square of how small a push may be against what is wanted of it: below that, nothing satisfies all inequalities.
"""
PUSH_HOLDS = 1e-9
"""Of the largest demand on a push: what is smaller is rounding."""
PUSH_MOVES = 1e-7
"""Of the fastest motion: a contact that opens more slowly than that is closed."""
PUSH_RESTS = 1e-13
"""Of the fastest motion: what is slower than that is rounding."""
PUSH_RESTS_FOR_LONG = 1e-11
"""Of the scene's size: what moves no farther in the whole of a path rests."""
PUSH_RESTS_IN_A_STEP = 1e-12
"""Of the unknowns' scale: what moves no farther in a step rests in it, to the last bit. In the tests' families rounding
moves things by 1e-13, and what moves does so by 1e-6 or more, but for steps that are cut short."""
PUSH_DAMPING = 1e-3
"""Of a wish's own gradient: a direction in which what pushes leaves no more of it is followed the less."""
PUSH_UNSEEN = 1e-9
"""Of a wish's own gradient: what is less of it in the directions that are free is rounding."""
PUSH_CLOSED = 1e-11
"""Of the scene's size: outlines, and values, that are no farther apart touch."""
PUSH_EVENT = 1e-10
"""Of a step: how closely the time of an event is found."""
PUSH_GUESS = 1e-4
"""Of the unknowns' scale: how far what lies between two points of a path may be off where contacts determine it."""
PUSH_OVERLAP = 1e-7
"""Of the scene's size: things that begin with a deeper overlap begin inside each other."""
PUSH_ROUNDING = 1e-16
"""Of the unknowns' scale, and of the largest force: nothing is smaller than that but rounding."""
PUSH_ALIKE = 1e-6
"""Of their length: how far the slopes of two contacts differ at most that push alike."""
PUSH_RESTORED = 1e-15
"""Relative residual: what is nearer to its equations than that is on them, but for rounding."""
PUSH_AFTER_THIS = 1e-12
"""Relative residual after which one more of Newton's steps leaves only rounding, though rows depend on each other."""
PUSH_AFTER_INDEPENDENT = 1e-9
"""The same where rows are clearly independent (`PUSH_INDEPENDENT`)."""
PUSH_NEARLY = 1e-7
"""Relative residual below which the slopes of the step before will do to come back onto the equations."""
PUSH_INDEPENDENT = 1e4
"""What the inverse of the products of rows of unit length may hold at most, if these are clearly independent."""
PUSH_MIXED = 1e-8
"""Of the largest singular value: changes of what was tried in a step that depend on each other."""
PUSH_RANK = 1e-13
"""Of the largest singular value: inequalities that depend on each other."""
PUSH_SLOPE = 1e-11
"""Of the numbers that it is made of: a slope that shows no force is missing."""
PUSH_SETTLED = 1e-14
"""Of the unknowns' scale: the last step apart."""
PUSH_MET = 1e-3
"""Of what is allowed: how closely an event is found where that costs nothing."""
PUSH_BRUSHES = 1e-9
"""Of a step: how closely the time is found at which two knobs are nearest as they pass."""
PUSH_DENSE = 1e-8
"""Of the unknowns' scale: what the last terms of a step's series may be, so that the series stands for the step."""
PUSH_DENSE_PULLED = 1e-2
"""Of the error of a step: the same where steps need not be exact, as under a hand."""
PUSH_DENSE_GAP = 1e-6
"""Of the scene's size: the same of the series of a gap, whose zeros are only first guesses."""
PUSH_DENSE_TIME = 1e-13
"""Of a step: how closely a zero of a series is found."""
PUSH_LOOK = 1e-6
"""Of the time between two nodes, or of a size: how far aside is looked for a speed, or a slope."""
PUSH_SIGNS = 1e-4
"""Of the largest: what the last terms of the series of a sign may be, so that the series tells where it turns."""
PUSH_AT_ONCE = 1e-12
"""Of a path: phases that are shorter lead nowhere."""
CONTACT_FLICKERS = 1e-6
"""Time units: what ends and begins again, or begins and ends, within so little of it goes on, or is nothing."""
OUTLINE_FAN = 1e-8
"""Radians: a direction so far outside a fan still belongs to it."""
BENDS_MET = 1e-14
"""Of two curves' parameters: the last step to the place where they touch."""
PIECE_STRAIGHT, PIECE_ROUND = 1e-10, 1e-9
"""Of a piece's size: how far it may be from a line, and from an arc."""
PIECE_TURNS = 1e-12
"""Radians, and of the largest curvature: what turns less does not turn."""
CORD_ENDS = 1e-9
"""Of the scene's size: a cord's length that grows by less (for a way of that size), or a shorter way, is its end."""
