"""Linear algebra of a block's rows: scaled before any decision, and damped where a direction loses its strength."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.records import dataclass
from movimentum.solver.basis.effort import charge
from movimentum.tolerances import LEAST_DIVISOR, RANK_OF_ROWS, WISH_DIRECTION_FOUND, WISH_DIRECTION_LOST, WISH_ROUNDING


@dataclass(frozen=True, slots=True)
class Damping:
    """How `damped` bounds what it finds. ``weak``: of the strongest direction, how much weaker another may be and still
    be followed exactly; ``near``: wanted in a weak direction, more than this is damped the more; ``far``: wanted and
    not to be had, it counts for no more than this. Of several systems, ``near`` and ``far`` are (…, 1).
    """

    weak: float = 0.2
    near: float | FloatArray = np.inf
    far: float | FloatArray = np.inf


SLIGHT = 0.5
"""Of what an error's own gradient promises, for the speed of the fastest anchor: how much less than that a direction
may bring and still count as strong.
"""


def toward(rows: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
    """The least-squares solution of rows @ step = want, `damped`: as far as the rows let it, bounded where they do
    not.
    """
    if not np.isfinite(rows).all() or not np.isfinite(want).all():
        return np.zeros(int(rows.shape[1]), dtype=np.float64)
    reach = np.asarray(rows @ rows.T, dtype=np.float64)
    return np.asarray(rows.T @ damped(reach, want, damping), dtype=np.float64)


def damped(
    reach: FloatArray,
    want: FloatArray,
    damping: Damping,
    moves: FloatArray | None = None,
    slopes: FloatArray | None = None,
) -> FloatArray:
    """The y (p,) with ``reach`` y = ``want`` for a symmetric matrix (p, p), damped in its weak directions; or (…, p)
    for several.

    Directions that are strong are followed exactly. Where a direction loses its strength (an arm that comes to be
    stretched) damping sets in smoothly, so that speeds stay bounded (Nakamura & Hanafusa 1986, J. Dyn. Syst. Meas.
    Control 108; Maciejewski & Klein 1988, J. Robotic Syst. 5), the more of it the more is wanted there. What cannot be
    followed counts for only so much in the other directions: an arm would point ever more stiffly at a place ever
    farther out of its reach. The result depends on no basis.

    How strong a direction is, is measured against the strongest; and where ``moves`` (n, p) are given, what each error
    would move, and ``slopes`` (p, n), the errors' gradients in what moves anchors, both in units of what moves these by
    one, against how fast anything moves for it: one wish alone has no other direction to be weaker than.

    What is wanted in a lost direction shows in the others, by as much as rounding turns these. That is left out: it
    would grow where a straight chain is pushed along its line, or a bar turned away from its wish, and choose a side.
    """
    if not want.shape[-1]:
        return want
    squares, directions = np.linalg.eigh(reach)
    across = np.swapaxes(directions, -1, -2)
    largest = np.maximum(squares[..., -1:], 0.0)
    squares = np.maximum(squares, 0.0)
    part = squares / np.maximum(largest, LEAST_DIVISOR)
    if moves is not None and slopes is not None:
        promised = np.linalg.norm(across @ slopes, axis=-1) * np.max(np.abs(moves @ directions), axis=-2)
        part = np.minimum(part, np.square(squares / (SLIGHT * np.maximum(promised, LEAST_DIVISOR))))
    wanted = (across @ want[..., None])[..., 0]
    edge = damping.weak**2
    added = np.hypot(edge, wanted / damping.near) * np.maximum(1.0 - part / edge, 0.0) ** 2
    known = np.clip((np.sqrt(part) - WISH_DIRECTION_LOST) / (WISH_DIRECTION_FOUND - WISH_DIRECTION_LOST), 0.0, 1.0)
    gains = known**2 * (3.0 - 2.0 * known) * part / np.maximum(part + added, LEAST_DIVISOR)
    left = np.square(wanted * (1.0 - gains))
    elsewhere = np.sqrt(np.maximum(np.sum(left, axis=-1, keepdims=True) - left, 0.0))
    told = np.abs(wanted) > WISH_ROUNDING * elsewhere
    followed = gains * np.where(told, wanted, 0.0) * np.minimum(1.0, damping.far / np.maximum(elsewhere, LEAST_DIVISOR))
    found = (directions @ (followed / np.maximum(squares, LEAST_DIVISOR))[..., None])[..., 0]
    return np.where(largest > 0.0, found, 0.0)


def scaled(jacobian: FloatArray, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The Jacobian with unknowns in units of ``scale`` (n,) or (F, n) and rows of unit length, and those rows' lengths
    (F, m).

    Counted as one linearization (see `solver.basis.effort`).
    """
    charge()
    wide = jacobian * scale[..., None, :]
    lengths = np.sqrt(np.einsum("fmn,fmn->fm", wide, wide))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    return wide / lengths[..., None], lengths


def relative_error(residual: FloatArray, jacobian: FloatArray, scale: FloatArray) -> FloatArray:
    """(F,) largest residual, each row in units of its own gradient over unknowns of size ``scale``."""
    if residual.shape[1] == 0:
        return np.zeros(len(residual))
    wide = np.abs(jacobian) * scale[..., None, :]
    return np.max(np.abs(residual) / np.maximum(wide.max(axis=2, initial=0.0), LEAST_DIVISOR), axis=1)


def null_space(matrix: FloatArray, tolerance: float = RANK_OF_ROWS) -> tuple[int, FloatArray, FloatArray]:
    """Rank, the null space (n, n - rank) and the pseudo-inverse (n, m) of one scaled matrix (m, n)."""
    m, n = matrix.shape
    if m == 0:
        return 0, np.eye(n), np.zeros((n, 0))
    left, singular, right = np.linalg.svd(np.nan_to_num(matrix, posinf=0.0, neginf=0.0))
    rank = int(np.sum(singular > tolerance * max(singular[0], LEAST_DIVISOR))) if len(singular) else 0
    inverse = (right[:rank].T / singular[:rank]) @ left[:, :rank].T
    return rank, right[rank:].T, inverse
