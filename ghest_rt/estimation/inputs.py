"""What has arrived of each input, and hence why an instant has no angles."""

from collections import Counter

from ghest_drivers.samples import EncoderSample
from ghest_rt.messages.results import MarkerObservation, Reason
from ghest_rt.sync.encoder_track import EncoderRejection, EncoderTrack
from ghest_rt.sync.history import History
from ghest_rt.sync.miss import Miss
from ghest_rt.sync.pose_track import EXACT_NS

_FRAMES_KEPT = 256
# An input that has not shown up this long after the first of them is missing, not starting.
_STARTING_NS = 2_000_000_000
# A frame cannot be taken after it was delivered; this much is left to the error of the clock map.
_FUTURE_NS = 20_000_000

_IMPLAUSIBLE = frozenset(EncoderRejection) - {EncoderRejection.DUPLICATE, EncoderRejection.REPEATED}
NO_FRAMES = {"r0": Reason.R0_NO_FRAMES, "r1": Reason.R1_NO_FRAMES}
NOT_SEEN = {"r0": Reason.M0_NOT_SEEN, "r1": Reason.M1_NOT_SEEN}


class Inputs:
    """The frames and encoder samples of the last seconds.

    Attributes:
        encoders: The encoder samples.
        frames: What became of the marker in each frame, by camera.
        newest_ns: Capture time of the newest sample of each input; absent if never seen.
    """

    def __init__(self, encoders: EncoderTrack, cameras: tuple[str, ...], max_gap_ns: int) -> None:
        self.encoders = encoders
        self.frames: dict[str, History[MarkerObservation]] = {camera: History(_FRAMES_KEPT) for camera in cameras}
        self.newest_ns: dict[str, int] = {}
        self._first_ns: dict[str, int] = {}
        self._max_gap_ns = max_gap_ns
        self._refused: Counter[str] = Counter()

    def add_encoder(self, sample: EncoderSample) -> bool:
        """Take an encoder sample; return False if it is of no use."""
        if self.encoders.add(sample) is not None:
            return False
        self._saw("encoders", sample.t_capture_ns)
        return True

    def add_frame(self, observation: MarkerObservation) -> bool:
        """Take what became of a marker in a frame; return False if it is of no use."""
        if observation.t_capture_ns > observation.t_arrival_ns + _FUTURE_NS:
            self._refused[f"{observation.camera}_from_the_future"] += 1
            return False
        if not self.frames[observation.camera].insert(observation.t_capture_ns, observation):
            self._refused[f"{observation.camera}_duplicate"] += 1
            return False
        self._saw(observation.camera, observation.t_capture_ns)
        return True

    def counts(self) -> dict[str, int]:
        """Return how many samples were refused, by reason."""
        encoders = {f"encoders_{reason}": count for reason, count in self.encoders.rejected.items()}
        return {**encoders, **self._refused}

    def why_no_pose(self, camera: str, t_ns: int, *, needs_encoders: bool) -> Reason:
        """Say why there is no pose of a camera's marker in E at an instant.

        Args:
            camera: The camera.
            t_ns: The instant.
            needs_encoders: Whether the camera's own pose depends on the encoders.
        """
        if needs_encoders:
            reason = self.why_no_joints(t_ns)
            if reason is not None:
                return reason
        frames = self.frames[camera]
        before, after = frames.before(t_ns + EXACT_NS), frames.after(t_ns - EXACT_NS)
        if before is None:
            return self._absent(camera, NO_FRAMES[camera], t_ns)
        if after is None:
            # The next frame is late: because it was lost, or the last one already did not show the marker.
            unseen = before[1].camera_from_marker is None and t_ns - before[0] <= self._max_gap_ns
            return NOT_SEEN[camera] if unseen else NO_FRAMES[camera]
        if after[0] - before[0] > self._max_gap_ns:
            return NO_FRAMES[camera]
        if needs_encoders and before[1].camera_from_marker is not None and after[1].camera_from_marker is not None:
            return Reason.ENCODERS_SILENT
        return NOT_SEEN[camera]

    def why_no_joints(self, t_ns: int) -> Reason | None:
        """Say why the encoders do not cover an instant, or return None if they do."""
        found = self.encoders.at(t_ns, self._max_gap_ns)
        if not isinstance(found, Miss):
            return None
        if self.encoders.last_rejection in _IMPLAUSIBLE:
            return Reason.ENCODERS_IMPLAUSIBLE
        if found in (Miss.EMPTY, Miss.TOO_EARLY):
            return self._absent("encoders", Reason.ENCODERS_SILENT, t_ns)
        return Reason.ENCODERS_SILENT

    def _absent(self, name: str, reason: Reason, t_ns: int) -> Reason:
        """Return `reason`, or STARTING in the first seconds of an input that has not been there before."""
        start_ns = min(self._first_ns.values(), default=t_ns)
        not_before = self._first_ns.get(name, t_ns + 1) > t_ns
        return Reason.STARTING if not_before and t_ns - start_ns <= _STARTING_NS else reason

    def _saw(self, name: str, t_ns: int) -> None:
        self._first_ns.setdefault(name, t_ns)
        self.newest_ns[name] = max(t_ns, self.newest_ns.get(name, t_ns))
