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
NEAREST_TOOTH = 1e-6
"""Of a tooth: so near to the middle between two gaps, the lower one is taken, so that rounding does not choose."""

# --- analysis: what is free, what is wrong, what is told ------------------------------------------

# --- variants and fits ----------------------------------------------------------------------------

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
TOUCHING = 1e-12
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
