"""The paper's error metrics, section 3.4.2."""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.geometry.so3 import angle_between_rad
from ghest_rt.messages.results import GhEstimate, Status, TruthSample


@dataclass(frozen=True, slots=True)
class SampleError:
    """The error of one estimate.

    Attributes:
        orientation_rad: Norm of the exponential map of Rot_arm^m0 (estimated Rot_arm^m0)^-1, 3.4.2 (2) a-c.
        position_m: Distance between true and estimated arm position in the m0 frame, 3.4.2 (2).
        m0_m: Distance between true and estimated position of marker m0 in E, 3.4.2 (1).
        m1_m: The same of marker m1.
    """

    orientation_rad: float
    position_m: float
    m0_m: float
    m1_m: float


def sample_error(estimate: GhEstimate, truth: TruthSample) -> SampleError | None:
    """Return the error of an estimate, or None if it has no angles."""
    if estimate.m0_from_arm is None or estimate.e_from_m0 is None or estimate.e_from_m1 is None:
        return None
    return SampleError(
        orientation_rad=angle_between_rad(truth.m0_from_arm[:3, :3], estimate.m0_from_arm[:3, :3]),
        position_m=float(np.linalg.norm(truth.m0_from_arm[:3, 3] - estimate.m0_from_arm[:3, 3])),
        m0_m=float(np.linalg.norm(truth.e_from_m0[:3, 3] - estimate.e_from_m0[:3, 3])),
        m1_m=float(np.linalg.norm(truth.e_from_m1[:3, 3] - estimate.e_from_m1[:3, 3])),
    )


class ErrorAccumulator:
    """Root mean squares over a movement, in constant memory."""

    def __init__(self) -> None:
        self.samples = 0
        self.valid = 0
        self.judged = 0
        self._sums = np.zeros(4)

    def add(self, estimate: GhEstimate, truth: TruthSample | None) -> SampleError | None:
        """Count an estimate, and judge it where there is truth; return its error, if any."""
        self.samples += 1
        self.valid += estimate.status is Status.VALID
        error = None if truth is None else sample_error(estimate, truth)
        if error is not None:
            self.judged += 1
            self._sums += np.square((error.orientation_rad, error.position_m, error.m0_m, error.m1_m))
        return error

    @property
    def valid_fraction(self) -> float:
        """Share of all samples whose status is `valid`; 0 if there are none."""
        return self.valid / self.samples if self.samples else 0.0

    def rms(self) -> SampleError:
        """Root mean square of each error over the samples judged; NaN if there are none."""
        if not self.judged:
            return SampleError(math.nan, math.nan, math.nan, math.nan)
        return SampleError(*(float(v) for v in np.sqrt(self._sums / self.judged)))
