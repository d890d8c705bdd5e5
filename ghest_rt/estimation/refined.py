"""The refined way: every frame with the joints at its capture time, both markers brought to the instant asked for."""

from collections import deque
from collections.abc import Mapping
from typing import Literal

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.arm_chain import CAMERAS, ArmChain, lost
from ghest_rt.estimation.inputs import Inputs
from ghest_rt.estimation.reasons import gravest
from ghest_rt.messages.results import GhEstimate, MarkerObservation, Reason
from ghest_rt.sync.encoder_track import EncoderTrack, JointState
from ghest_rt.sync.miss import Miss
from ghest_rt.sync.pose_track import PoseSample, PoseTrack

_WAITING_FRAMES = 32


class RefinedEstimator:
    """Sections 3.3.2 to 3.3.5, equations (6) to (10), with everything brought to one instant first.

    Each marker observation becomes a pose in E by the joint angles interpolated to its capture time; a frame waits until
    encoder samples on both sides have come. Both markers are then interpolated on SE(3) to the instant asked for. Nothing is
    extrapolated: ask for an instant some 45 ms back (`estimator.lag_ms`), which the inputs cover by then.
    """

    def __init__(
        self,
        chain: ArmChain,
        max_gap_ns: int,
        period_ns: Mapping[str, int],
        encoder_pairing: Literal["interpolate", "nearest"] = "interpolate",
    ) -> None:
        """Start without samples.

        Args:
            chain: The station's geometry and calibration.
            max_gap_ns: The longest gap in an input that is interpolated over.
            period_ns: Nominal frame period of each camera.
            encoder_pairing: Whether joints are interpolated to a frame's capture time, or the nearest sample is taken.
        """
        self._chain = chain
        self._max_gap_ns = max_gap_ns
        self._nearest = encoder_pairing == "nearest"
        self._inputs = Inputs(EncoderTrack(chain.limits), CAMERAS, max_gap_ns)
        self._tracks = {camera: PoseTrack(period_ns[camera]) for camera in CAMERAS}
        self._waiting: deque[MarkerObservation] = deque()
        self._unpaired = 0

    def add_encoder(self, sample: EncoderSample) -> None:
        """Take an encoder sample; frames that waited for it become poses."""
        if not self._inputs.add_encoder(sample):
            return
        for _ in range(len(self._waiting)):
            self._pair(self._waiting.popleft())

    def add_marker(self, observation: MarkerObservation) -> None:
        """Take what became of a marker in a frame."""
        if not self._inputs.add_frame(observation) or observation.camera_from_marker is None:
            return
        if self._chain.needs_encoders(observation.camera):
            self._pair(observation)
        else:
            self._store(observation, None)

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used, by reason."""
        counts = self._inputs.counts()
        return {**counts, "frames_without_encoders": self._unpaired} if self._unpaired else counts

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint at `t_ns`, or why there is none."""
        m0, m1 = (self._pose(camera, t_ns) for camera in CAMERAS)
        if isinstance(m0, Reason) or isinstance(m1, Reason):
            return lost(t_ns, gravest(m0, m1), self._inputs.newest_ns)
        joints = self._inputs.encoders.at(t_ns, self._max_gap_ns)
        known = None if isinstance(joints, Miss) else joints
        return self._chain.estimate(t_ns, m0, m1, self._inputs.newest_ns, known)

    def _pose(self, camera: str, t_ns: int) -> PoseSample | Reason:
        found = self._tracks[camera].at(t_ns, self._max_gap_ns)
        if isinstance(found, Miss):
            return self._inputs.why_no_pose(camera, t_ns, needs_encoders=self._chain.needs_encoders(camera))
        return found

    def _pair(self, observation: MarkerObservation) -> None:
        """Turn a frame into a pose if the encoders cover its capture time; let it wait if they may yet."""
        joints = self._inputs.encoders.at(observation.t_capture_ns, self._max_gap_ns)
        if joints is Miss.NOT_YET or joints is Miss.EMPTY:
            if len(self._waiting) == _WAITING_FRAMES:
                self._waiting.popleft()
                self._unpaired += 1
            self._waiting.append(observation)
        elif isinstance(joints, Miss):
            self._unpaired += 1
        else:
            self._store(observation, self._nearest_to(observation.t_capture_ns, joints) if self._nearest else joints)

    def _nearest_to(self, t_ns: int, joints: JointState) -> JointState:
        sample = self._inputs.encoders.nearest(t_ns)
        return joints if sample is None else JointState(sample.angles_rad, sample.t_capture_ns, joints.gap_ns)

    def _store(self, observation: MarkerObservation, joints: JointState | None) -> None:
        pose = self._chain.marker_in_e(observation, joints)
        if pose is not None:
            self._tracks[observation.camera].add(pose)
