"""The one linear system of section 1.2: a square Jacobian, its transpose, or J_td."""

from __future__ import annotations

import numpy as np

from fivebar_bringup.studies.closed_chain.chain import Vector


def solve(matrix: Vector, right: Vector) -> Vector:
    """Return matrix^-1 right for a square matrix (n, n) and a vector (n,) or a matrix (n, m).

    Raises:
        numpy.linalg.LinAlgError: the matrix is singular to the last bit.
    """
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
