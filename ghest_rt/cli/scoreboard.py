"""The error against the truth of a simulated recording, while it is replayed."""

import math
from collections import deque
from collections.abc import Callable

from ghest_rt.messages.published import Event, GhAngles, Health
from ghest_rt.messages.results import GhEstimate, TruthSample
from ghest_rt.studies.metrics import ErrorAccumulator
from ghest_rt.studies.truth import TruthTrack

_WAITING = 600  # samples kept until the truth for their instant has come
_NONE_YET = -(1 << 63)


class Scoreboard:
    """An output of the service that judges every sample for which there is truth (the paper's metrics, 3.4.2)."""

    def __init__(self) -> None:
        self._to_recording_ns: Callable[[int], int] = int
        self._arrived: deque[TruthSample] = deque()
        self._track = TruthTrack()
        self._truth_until_ns = _NONE_YET
        self._waiting: deque[tuple[int, GhEstimate]] = deque(maxlen=_WAITING)
        self._accumulator = ErrorAccumulator()
        self.newest_orientation_deg = math.nan
        self.newest_position_mm = math.nan

    @property
    def judged(self) -> int:
        """Samples compared with the truth so far."""
        return self._accumulator.judged

    @property
    def orientation_rmse_deg(self) -> float:
        """Root mean square orientation error so far, degrees; NaN without truth."""
        return math.degrees(self._accumulator.rms().orientation_rad)

    @property
    def position_rmse_mm(self) -> float:
        """Root mean square error of the arm's position in the m0 frame so far, millimetres; NaN without truth."""
        return self._accumulator.rms().position_m * 1000.0

    def set_time_axis(self, to_recording_ns: Callable[[int], int]) -> None:
        """Say how to get from the service's time to the recording's, in which truth is given; without, they are the same."""
        self._to_recording_ns = to_recording_ns

    def truth(self, sample: object) -> None:
        """Take in what the recording holds besides devices' samples; may be called on another thread."""
        if isinstance(sample, TruthSample):
            self._arrived.append(sample)

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """Judge this sample, and those that waited for their truth."""
        if estimate.gh_from_arm is not None:
            self._waiting.append((self._to_recording_ns(estimate.t_sample_ns), estimate))
        while self._arrived:
            sample = self._arrived.popleft()
            self._track.add(sample)
            self._truth_until_ns = sample.t_ns
        while self._waiting and self._waiting[0][0] <= self._truth_until_ns:
            t_ns, waited = self._waiting.popleft()
            error = self._accumulator.add(waited, self._track.at(t_ns))
            if error is not None:
                self.newest_orientation_deg = math.degrees(error.orientation_rad)
                self.newest_position_mm = error.position_m * 1000.0

    def health(self, message: Health) -> None:
        """Nothing to judge in it."""

    def event(self, message: Event) -> None:
        """Nothing to judge in it."""
