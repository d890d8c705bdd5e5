"""What a belief foretells of a marker's pose, and how that depends on the error state; section 3 of docs/fused-estimator.md."""

from typing import NamedTuple

import numpy as np

from ghest_rt.estimation.fused.belief import ACROMION, ARM, GH, GH_IN_MARKER, SIZE, Belief
from ghest_rt.geometry.so3 import Array, log_so3, skew

_ROTATION = (ACROMION, ARM)


class Innovation(NamedTuple):
    """A measurement compared with what was foretold.

    Attributes:
        residual: (6,) rotation error rad, position error m: measured against foretold, left perturbation, E axes. What of the
            position does not follow from the rotation is exact, however large that is.
        H: (6, 24) its dependence on the error state.
        bend_m2: Variance of the position by the product of two errors, which H leaves out: without it, the noise of the
            rotation would pass for movement, which tells where the GH centre is.
        without_rotation: (3, 6) takes from the position's residual what follows from that of the rotation.
    """

    residual: Array
    H: Array
    bend_m2: float
    without_rotation: Array


def innovation_of(belief: Belief, marker: int, e_from_marker: Array) -> Innovation:
    """Compare a measured pose with the belief: R as believed, p = p_gh - R gh_in_marker.

    Args:
        belief: At the capture time.
        marker: 0 for m0, 1 for m1.
        e_from_marker: (4, 4) as measured, equation (7).
    """
    R, in_marker, turn = belief.e_from_marker[marker], belief.gh_in_marker[marker], _ROTATION[marker]
    across = skew(R.dot(in_marker))
    H = _PLAIN[marker].copy()
    H[3:, turn] = across
    H[3:, GH_IN_MARKER[marker]] = -R
    measured = e_from_marker[:3, :3]
    residual = np.empty(6)
    residual[:3] = turned = log_so3(measured.dot(R.T))
    # The GH centre by the measured rotation, and what the believed one makes of that to first order.
    residual[3:] = e_from_marker[:3, 3] - belief.p_gh + measured.dot(in_marker) + across.dot(turned)
    variance = belief.P.diagonal().tolist()
    bend = sum(variance[turn]) * sum(variance[GH_IN_MARKER[marker]]) / 3.0
    without_rotation = _ONLY_PLACE.copy()
    without_rotation[:, :3] = across.T
    return Innovation(residual, H, bend, without_rotation)


def _plain(marker: int) -> Array:
    """Return the (6, 24) part of H that never changes."""
    H = np.zeros((6, SIZE))
    H[:3, _ROTATION[marker]] = H[3:, GH] = np.eye(3)
    return H


_PLAIN = (_plain(0), _plain(1))
_ONLY_PLACE = np.eye(3, 6, 3)
