"""Relative sensitivity, equation (11), from errors at a few amounts."""

import numpy as np
from numpy.typing import ArrayLike

from ghest_rt.geometry.so3 import Array


def eq11_relative_sensitivity(q: ArrayLike, F: ArrayLike) -> Array:
    """Return S = (dF/F) / (dq/q) = d ln F / d ln q, equation (11), at every amount.

    F is a root mean square error. Its square is, as far as the estimate moves in proportion to the marker, a polynomial of
    second degree in q: F² = a + b q + c q². So F² is what is differentiated, by differences of second order on the three
    nearest amounts, one-sided at both ends: exact for such a polynomial on any spacing, where differences of F itself are not
    (near q = 0 F bends like a hyperbola). With it, S = q (F²)' / (2 F²).

    The limit at q = 0: S = 0 wherever F(0) > 0, since (F²)' is finite there: a percentage of no translation is none. Then S
    rises to 1 as c q² outgrows the error a that is there without any translation, F ~ sqrt(c) q. Only where F(0) = 0 is S = 1
    from the start; 1 is returned then.

    Args:
        q: (n,) amounts, ascending, at least three.
        F: (n,) errors at these amounts, not negative.

    Returns:
        (n,) relative sensitivities, dimensionless; NaN where F is not known.
    """
    q, F = np.asarray(q, dtype=np.float64), np.asarray(F, dtype=np.float64)
    squared = F * F
    slope = np.gradient(squared, q, edge_order=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        S = q * slope / (2.0 * squared)
    return np.asarray(np.where((q == 0.0) & (F == 0.0), 1.0, S))
