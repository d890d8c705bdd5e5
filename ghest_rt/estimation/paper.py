"""The paper's way: the latest frame of each camera, the nearest encoder sample, no compensation of time offsets."""

from collections.abc import Mapping

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.arm_chain import CAMERAS, ArmChain, lost
from ghest_rt.estimation.inputs import NO_FRAMES, NOT_SEEN, Inputs
from ghest_rt.estimation.reasons import gravest
from ghest_rt.messages.results import GhEstimate, MarkerObservation, Reason
from ghest_rt.sync.encoder_track import EncoderTrack, JointState
from ghest_rt.sync.pose_track import EXACT_NS, PoseSample


class PaperEstimator:
    """Sections 3.3.2 to 3.3.5, equations (6) to (10), with whatever was latest at the instant asked for.

    A camera whose latest frame is older than 1.6 frame periods, or does not show the marker, gives no pose: the paper's method
    knows no older data.
    """

    def __init__(self, chain: ArmChain, max_gap_ns: int, period_ns: Mapping[str, int]) -> None:
        """Start without samples.

        Args:
            chain: The station's geometry and calibration.
            max_gap_ns: The farthest an encoder sample may be from the frame it is paired with.
            period_ns: Nominal frame period of each camera.
        """
        self._chain = chain
        self._max_gap_ns = max_gap_ns
        self._inputs = Inputs(EncoderTrack(chain.limits), CAMERAS, max_gap_ns)
        self._oldest_ns = {camera: 8 * period_ns[camera] // 5 for camera in CAMERAS}

    def add_encoder(self, sample: EncoderSample) -> None:
        """Take an encoder sample."""
        self._inputs.add_encoder(sample)

    def add_marker(self, observation: MarkerObservation) -> None:
        """Take what became of a marker in a frame."""
        self._inputs.add_frame(observation)

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used, by reason."""
        return self._inputs.counts()

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint by the frames that were the latest at `t_ns`."""
        m0, m1 = (self._latest(camera, t_ns) for camera in CAMERAS)
        if isinstance(m0, Reason) or isinstance(m1, Reason):
            return lost(t_ns, gravest(m0, m1), self._inputs.newest_ns)
        return self._chain.estimate(t_ns, m0, m1, self._inputs.newest_ns, self._nearest_joints(t_ns))

    def _latest(self, camera: str, t_ns: int) -> PoseSample | Reason:
        found = self._inputs.frames[camera].before(t_ns + EXACT_NS)
        needs_encoders = self._chain.needs_encoders(camera)
        if found is None:
            return self._inputs.why_no_pose(camera, t_ns, needs_encoders=needs_encoders)
        captured_ns, observation = found
        if t_ns - captured_ns > self._oldest_ns[camera]:
            return NO_FRAMES[camera]
        if observation.camera_from_marker is None:
            return NOT_SEEN[camera]
        pose = self._chain.marker_in_e(observation, self._nearest_joints(captured_ns) if needs_encoders else None)
        return pose or self._inputs.why_no_joints(captured_ns) or Reason.ENCODERS_SILENT

    def _nearest_joints(self, t_ns: int) -> JointState | None:
        sample = self._inputs.encoders.nearest(t_ns)
        if sample is None or abs(sample.t_capture_ns - t_ns) > self._max_gap_ns:
            return None
        return JointState(sample.angles_rad, sample.t_capture_ns, 0)
