"""Rank and null space of a large block's Jacobian, from sparse factorisations.

A singular value decomposition of the whole matrix costs the cube of its size, for a handful of directions. With
S = A'A + shift, S^-1 enlarges what A (almost) takes to zero over everything else by 1 / shift: a few steps of subspace
iteration find just that (Golub & Van Loan, *Matrix Computations*, 8.2.4), and singular values there tell the rank.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.solver.block.sparse import factored
from movimentum.tolerances import LEAST_DIVISOR, RANK_SHIFT

STEPS = 4
PROBES = 16
"""Directions looked at to begin with; twice as many, where all of them turn out to be free."""


class SparseRank:
    """``rank`` of scaled rows (m, n), singular values below ``tolerance`` of the largest left out; ``free``
    (n, n - rank), an orthonormal basis of the null space.

    ``expected``: how many directions are free, if that is known; it saves work. Raises numpy.linalg.LinAlgError where
    the factors cannot be had.
    """

    def __init__(self, rows: FloatArray, tolerance: float, expected: int = 0) -> None:
        from scipy.sparse import csr_matrix

        self._rows: Any = csr_matrix(np.nan_to_num(rows, posinf=0.0, neginf=0.0))
        self._across: Any = self._rows.T.tocsr()
        n = rows.shape[1]
        shifted: Any = (self._across @ self._rows).tocsc()
        shifted.setdiag(shifted.diagonal() + RANK_SHIFT)
        self._factors: Any = factored(shifted, order="MMD_AT_PLUS_A")
        if self._factors is None:
            raise np.linalg.LinAlgError
        largest = self._largest(n)
        count = min(max(PROBES, expected + 8), n)
        while True:
            found, singular = self._weakest(n, count)
            weak = singular <= tolerance * largest
            if not weak.all() or count == n:
                break
            count = min(2 * count, n)
        self.rank = n - int(np.sum(weak))
        self.free: FloatArray = found[:, weak]

    def _largest(self, n: int) -> float:
        """The largest singular value, to a few percent."""
        vector = np.cos(1.0 + 2.399963 * np.arange(n, dtype=np.float64))
        size = 0.0
        for _ in range(30):
            vector = self._across @ (self._rows @ (vector / max(float(np.linalg.norm(vector)), LEAST_DIVISOR)))
            size = float(np.linalg.norm(vector))
        return float(np.sqrt(size))

    def _weakest(self, n: int, count: int) -> tuple[FloatArray, FloatArray]:
        """Orthonormal directions (n, count) that the rows tell least of, and their singular values, ascending."""
        some = np.random.default_rng(5).normal(size=(n, count))
        for _ in range(STEPS):
            some = np.linalg.qr(self._factors.solve(some))[0]
        told = np.zeros((max(self._rows.shape[0], count), count))
        told[: self._rows.shape[0]] = self._rows @ some
        _, singular, turned = np.linalg.svd(told, full_matrices=False)
        return some @ turned[::-1].T, singular[::-1]
